// SPDX-License-Identifier: MIT
// Packed words: every target against the specification, and the specification against bits set one by one and
// against bytes written by hand from the documents.
#include "simd/unpack.h"

#include "kernel_test.h"

namespace burin {
namespace {

using namespace simd;

constexpr Packing kAll[kPackings] = {Packing::u8,    Packing::le16,  Packing::be16,   Packing::msb10,
                                     Packing::msb11, Packing::msb12, Packing::mipi10, Packing::mipi12};

std::vector<std::uint8_t> random_bytes(Rng& rng, std::size_t count) {
    std::vector<std::uint8_t> bytes = tight<std::uint8_t>(count, 0);
    for (auto& b : bytes)
        b = static_cast<std::uint8_t>(rng.below(8) == 0 ? rng.below(2) * 255 : rng.below(256));
    return bytes;
}

class Unpack : public KernelTest {};

TEST_P(Unpack, GivesTheSpecificationsPixels) {
    Rng rng(200);
    for (int round = 0; round < 4000; ++round) {
        const Packing p = kAll[round % kPackings];
        const int count = round < 1000 ? round / kPackings : rng.below(700);
        const auto whole = packed_bytes(p, static_cast<std::size_t>(count));
        // Now and then fewer bytes than the pixels need, or more; none beyond them is readable.
        std::size_t bytes = whole;
        if (rng.below(3) == 0) bytes = static_cast<std::size_t>(rng.below(static_cast<int>(whole) + 40));
        const std::vector<std::uint8_t> in = random_bytes(rng, bytes);
        std::vector<std::uint16_t> got = tight<std::uint16_t>(static_cast<std::size_t>(count), 7),
                                   expected = got;
        const int n = unpack(p, in.data(), bytes, count, got.data());
        ASSERT_EQ(n, scalar::unpack(p, in.data(), bytes, count, expected.data()));
        ASSERT_TRUE(same_bytes(got, expected))
            << "packing " << static_cast<int>(p) << ", " << count << " pixels";
        ASSERT_EQ(n,
                  bytes >= whole ? count : std::min<int>(count, static_cast<int>(packed_pixels(p, bytes))));
        for (int i = n; i < count; ++i) ASSERT_EQ(got[static_cast<std::size_t>(i)], 7);
    }
}

TEST_P(Unpack, LooksUpInTheSamePass) {
    Rng rng(201);
    for (int round = 0; round < 3000; ++round) {
        const Packing p = kAll[round % kPackings];
        const int count = rng.below(500);
        const int entries = round % 3 == 0 ? 1 << packing_bits(p) : 1 + rng.below(1 << packing_bits(p));
        std::vector<std::uint16_t> table = tight<std::uint16_t>(static_cast<std::size_t>(entries), 0);
        for (auto& value : table) value = static_cast<std::uint16_t>(rng.below(65536));
        auto bytes = packed_bytes(p, static_cast<std::size_t>(count));
        if (rng.below(4) == 0) bytes = static_cast<std::size_t>(rng.below(static_cast<int>(bytes) + 1));
        const std::vector<std::uint8_t> in = random_bytes(rng, bytes);
        std::vector<std::uint16_t> got = tight<std::uint16_t>(static_cast<std::size_t>(count), 7),
                                   expected = got, readings = got;
        const int n = unpack_table(p, in.data(), bytes, count, table.data(), entries, got.data());
        ASSERT_EQ(n,
                  scalar::unpack_table(p, in.data(), bytes, count, table.data(), entries, expected.data()));
        ASSERT_TRUE(same_bytes(got, expected))
            << "packing " << static_cast<int>(p) << ", " << count << " pixels";
        scalar::unpack(p, in.data(), bytes, count, readings.data());
        for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i)
            ASSERT_EQ(got[i], readings[i] < entries ? table[readings[i]] : 0);
    }
}

TEST_P(Unpack, WordsChangeInPlace) {
    Rng rng(202);
    for (int count = 0; count < 200; ++count)
        for (const Packing p : {Packing::le16, Packing::be16}) {
            std::vector<std::uint16_t> words(static_cast<std::size_t>(count)), expected = words;
            for (auto& w : words) w = static_cast<std::uint16_t>(rng.below(65536));
            const auto* in = reinterpret_cast<const std::uint8_t*>(words.data());
            const auto bytes = 2 * static_cast<std::size_t>(count);
            scalar::unpack(p, in, bytes, count, expected.data());
            ASSERT_EQ(unpack(p, in, bytes, count, words.data()), count);
            ASSERT_TRUE(same_bytes(words, expected));
        }
}

BURIN_EVERY_TARGET(Unpack);

// Bits set one by one.
TEST(UnpackSpecification, FindsEveryBitOfARun) {
    for (const Packing p : {Packing::msb10, Packing::msb11, Packing::msb12}) {
        const auto bits = static_cast<std::size_t>(packing_bits(p));
        constexpr std::size_t kPixels = 19;
        for (std::size_t bit = 0; bit < kPixels * bits; ++bit) {
            std::vector<std::uint8_t> in(packed_bytes(p, kPixels));
            in[bit / 8] = static_cast<std::uint8_t>(128 >> bit % 8);
            std::uint16_t out[kPixels];
            ASSERT_EQ(scalar::unpack(p, in.data(), in.size(), kPixels, out), static_cast<int>(kPixels));
            for (std::size_t i = 0; i < kPixels; ++i)
                ASSERT_EQ(out[i], i == bit / bits ? 1u << (bits - 1 - bit % bits) : 0u);
        }
    }
}

// The tables of the kernel's documents, pixfmt-yuv-luma.
TEST(UnpackSpecification, ReadsTheLayoutsOfTheDocuments) {
    const auto expect = [](Packing p, std::vector<std::uint8_t> in, std::vector<std::uint16_t> pixels) {
        std::vector<std::uint16_t> out(pixels.size(), 9);
        EXPECT_EQ(scalar::unpack(p, in.data(), in.size(), static_cast<int>(out.size()), out.data()),
                  static_cast<int>(out.size()));
        EXPECT_EQ(out, pixels) << "packing " << static_cast<int>(p);
    };
    // Y10P: the fifth byte has the low bits of the fourth pixel highest.
    expect(Packing::mipi10, {0x12, 0x34, 0x56, 0x78, 0b11100100}, {0x48, 0xd1, 0x15a, 0x1e3});
    expect(Packing::mipi12, {0x12, 0x34, 0xba}, {0x12a, 0x34b});
    expect(Packing::msb10, {0xff, 0xc0, 0x00, 0x00, 0x01}, {0x3ff, 0, 0, 1});
    expect(Packing::msb12, {0x12, 0x34, 0x56}, {0x123, 0x456});
    expect(Packing::msb11, {0xff, 0xe0, 0x00, 0x80, 0x00}, {0x7ff, 0, 0x100});
    expect(Packing::le16, {0x12, 0x34}, {0x3412});
    expect(Packing::be16, {0x12, 0x34}, {0x1234});
    expect(Packing::u8, {0x12, 0x34}, {0x12, 0x34});
}

TEST(UnpackSpecification, CountsBytesAndPixels) {
    EXPECT_EQ(packed_bytes(Packing::msb11, 640 * 480), 422400u);
    EXPECT_EQ(packed_bytes(Packing::msb10, 640 * 480), 384000u);
    EXPECT_EQ(packed_bytes(Packing::mipi10, 5), 10u);
    EXPECT_EQ(packed_bytes(Packing::mipi12, 3), 6u);
    for (const Packing p : kAll)
        for (std::size_t n = 0; n < 100; ++n) {
            const std::size_t bytes = packed_bytes(p, n);
            EXPECT_GE(packed_pixels(p, bytes), n);
            if (bytes > 0) {
                EXPECT_LT(packed_pixels(p, bytes - 1), n);
            }
        }
}

}  // namespace
}  // namespace burin
