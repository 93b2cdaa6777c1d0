// SPDX-License-Identifier: MIT
// Two images in one, nibbles and scales: every target against the specification, and that against sums by
// hand.
#include "simd/split.h"

#include "kernel_test.h"

namespace burin {
namespace {

using namespace simd;

class Split : public KernelTest {};

std::vector<std::uint8_t> random_bytes(Rng& rng, std::size_t count) {
    std::vector<std::uint8_t> bytes = tight<std::uint8_t>(count, 0);
    for (auto& b : bytes) b = static_cast<std::uint8_t>(rng.below(256));
    return bytes;
}

// Random sizes, bytes that end too early or too late, all of them to the end of the allocation.
template <class T, class Kernel, class Specification>
void expect_splits(int per_pixel, Kernel&& kernel, Specification&& specification) {
    Rng rng(220);
    for (int round = 0; round < 1500; ++round) {
        const int count = round < 200 ? round : rng.below(500);
        std::size_t bytes = static_cast<std::size_t>(count * per_pixel);
        if (rng.below(3) == 0) bytes = static_cast<std::size_t>(rng.below(count * per_pixel + 9));
        const auto in = random_bytes(rng, bytes);
        std::vector<T> left = tight<T>(static_cast<std::size_t>(count), 7), right = left, l = left, r = left;
        const int n = kernel(in.data(), bytes, count, left.data(), right.data());
        ASSERT_EQ(n, specification(in.data(), bytes, count, l.data(), r.data()));
        ASSERT_EQ(n, std::min(count, static_cast<int>(bytes) / per_pixel));
        ASSERT_TRUE(same_bytes(left, l));
        ASSERT_TRUE(same_bytes(right, r));
    }
}

TEST_P(Split, PairsOfImages) {
    expect_splits<std::uint8_t>(2, split_y8i, scalar::split_y8i);
    expect_splits<std::uint16_t>(3, split_y12i, scalar::split_y12i);
    expect_splits<std::uint16_t>(4, split_y16i, scalar::split_y16i);
}

TEST_P(Split, Nibbles) {
    Rng rng(221);
    for (int round = 0; round < 1500; ++round) {
        const int count = round < 300 ? round : rng.below(500);
        std::size_t bytes = static_cast<std::size_t>((count + 1) / 2);
        if (rng.below(3) == 0) bytes = static_cast<std::size_t>(rng.below(count / 2 + 9));
        const auto in = random_bytes(rng, bytes);
        std::vector<std::uint8_t> got = tight<std::uint8_t>(static_cast<std::size_t>(count), 77),
                                  expected = got;
        ASSERT_EQ(unpack_nibbles(in.data(), bytes, count, got.data()),
                  scalar::unpack_nibbles(in.data(), bytes, count, expected.data()));
        ASSERT_TRUE(same_bytes(got, expected));
    }
}

TEST_P(Split, ScalesAndNarrows) {
    Rng rng(222);
    for (int round = 0; round < 2000; ++round) {
        const auto count = static_cast<std::size_t>(round < 100 ? round : rng.below(300));
        std::vector<std::uint16_t> words = tight<std::uint16_t>(count, 0);
        for (auto& w : words)
            w = static_cast<std::uint16_t>(rng.below(4) ? rng.below(65536) : rng.below(2) * 65535);
        const auto bytes = random_bytes(rng, count);
        Affine a;
        a.scale = static_cast<float>(rng.uniform(-2, 8));
        if (rng.below(8) == 0) a.scale = rng.below(2) ? 65536.0f : -65536.0f;
        a.offset = static_cast<float>(rng.uniform(-2000, 2000));
        if (rng.below(8) == 0) a.offset = rng.below(2) ? 16777216.0f : -16777216.0f;
        a.mask = static_cast<std::uint16_t>(rng.below(2) ? 0xffff : rng.below(65536));
        a.none = rng.below(3) ? static_cast<std::uint32_t>(rng.below(65536)) : 0xffffffffu;
        if (count && rng.below(2)) a.none = words[0] & a.mask;
        const int n = static_cast<int>(count);
        std::vector<std::uint16_t> got = tight<std::uint16_t>(count, 7), expected = got;
        affine_u16(words.data(), n, a, got.data());
        scalar::affine_u16(words.data(), n, a, expected.data());
        ASSERT_TRUE(same_bytes(got, expected));
        affine_u8(bytes.data(), n, a, got.data());
        std::vector<std::uint16_t> of_bytes = expected;
        scalar::affine_u8(bytes.data(), n, a, of_bytes.data());
        ASSERT_TRUE(same_bytes(got, of_bytes));
        const int shift = rng.below(9);
        std::vector<std::uint8_t> narrow = tight<std::uint8_t>(count, 7), expected_narrow = narrow;
        narrow_u16(words.data(), n, shift, narrow.data());
        scalar::narrow_u16(words.data(), n, shift, expected_narrow.data());
        ASSERT_TRUE(same_bytes(narrow, expected_narrow));
        affine_u16(words.data(), n, a, words.data());  // in place
        ASSERT_TRUE(same_bytes(words, expected));
    }
}

BURIN_EVERY_TARGET(Split);

TEST(SplitSpecification, ReadsTheLayoutsOfTheDocuments) {
    // pixfmt-y12i: left is the low 12 bits of the little-endian word, right the high ones.
    const std::uint8_t y12i[] = {0xbc, 0x3a, 0x12};
    std::uint16_t left, right;
    EXPECT_EQ(scalar::split_y12i(y12i, 3, 1, &left, &right), 1);
    EXPECT_EQ(left, 0xabc);
    EXPECT_EQ(right, 0x123);
    // pixfmt-cnf4: bits 0-3 are the even pixel.
    const std::uint8_t cnf4[] = {0x21, 0x43};
    std::uint8_t confidence[3];
    EXPECT_EQ(scalar::unpack_nibbles(cnf4, 2, 3, confidence), 3);
    EXPECT_EQ(confidence[0], 1);
    EXPECT_EQ(confidence[1], 2);
    EXPECT_EQ(confidence[2], 3);
    // 12-bit words with flags above, quarters of a millimetre, 4095 for none.
    const std::uint16_t words[] = {0x8064, 0x7fff, 0x0000, 0x0003};
    std::uint16_t depth[4];
    scalar::affine_u16(words, 4, {0.25f, 10, 0x0fff, 0x0fff}, depth);
    EXPECT_EQ(depth[0], 35);
    EXPECT_EQ(depth[1], 0);
    EXPECT_EQ(depth[2], 10);
    EXPECT_EQ(depth[3], 11);
    const std::uint16_t wide[] = {1023, 1020, 65535};
    std::uint8_t bytes[3];
    scalar::narrow_u16(wide, 3, 2, bytes);
    EXPECT_EQ(bytes[0], 255);
    EXPECT_EQ(bytes[1], 255);
    EXPECT_EQ(bytes[2], 255);
}

}  // namespace
}  // namespace burin
