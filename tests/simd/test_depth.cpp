// SPDX-License-Identifier: MIT
// Conversion of depth and ranges over tiles: every target against the specification, and the specification
// against the plain formulas.
#include "simd/depth.h"

#include "kernel_test.h"

namespace burin {
namespace {

using namespace simd;

class Depth : public KernelTest {};

const DepthConversion kConversions[] = {
    {0.2f, 4.0f, 0.001f, 4.0f / 65534},       // millimetres
    {0.2f, 4.0f, 1.0f / 5000, 4.0f / 65534},  // TUM
    {0.01f, 50.0f, 1.0f, 50.0f / 65534},      // metres
    {1.0f, 1.0f, 0.001f, 1.0f / 65534},       // a single reading
    {0.2f, 4.0f, 1e-6f, 4.0f / 65534},        // nothing is in range
    {0.2f, 50.0f, 1000.0f, 50.0f / 65534},    // nor here: the least reading is beyond
    {0.2f, 4.0f, 5e-5f, 4.0f / 65534},        // 65534 is in range, 65535 no depth
};

TEST(DepthSpecification, TheRawRangeIsTheRangeInMetres) {
    for (const DepthConversion& c : kConversions) {
        const RawRange range = raw_range(c);
        for (int raw = 0; raw < 65536; ++raw) {
            const float metres = static_cast<float>(raw) * c.raw_to_m;
            const bool in = raw != 0 && raw != 65535 && metres >= c.min_m && metres <= c.max_m;
            ASSERT_EQ(raw >= range.low && raw <= range.high, in) << raw << " at " << c.raw_to_m;
        }
    }
}

TEST_P(Depth, EveryReadingOfSixteenBits) {
    std::vector<std::uint16_t> all(65536);
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint16_t>(i);
    std::vector<std::uint16_t> got(all.size()), expected(all.size());
    for (const DepthConversion& c : kConversions) {
        convert_u16(all.data(), 65536, c, got.data());
        scalar::convert_u16(all.data(), 65536, c, expected.data());
        ASSERT_TRUE(same_bytes(got, expected)) << c.raw_to_m;
        keep_in_range(all.data(), 65536, raw_range(c), got.data());
        scalar::keep_in_range(all.data(), 65536, raw_range(c), expected.data());
        ASSERT_TRUE(same_bytes(got, expected)) << c.raw_to_m;
    }
}

TEST_P(Depth, FloatsGoodAndBad) {
    Rng rng(100);
    std::vector<float> in(20000);
    for (const DepthConversion& c : kConversions) {
        for (float& v : in) {
            const float edges[] = {c.min_m / c.raw_to_m, c.max_m / c.raw_to_m};
            const int kind = rng.below(4);
            v = kind == 0   ? awkward_floats()[static_cast<std::size_t>(
                                rng.below(static_cast<int>(awkward_floats().size())))]
                : kind == 1 ? std::nextafter(edges[rng.below(2)], rng.below(2) ? 0.0f : 1e9f)
                : kind == 2 ? edges[rng.below(2)]
                            : static_cast<float>(rng.uniform(-0.1, 1.1)) * edges[1];
        }
        std::vector<std::uint16_t> got(in.size()), expected(in.size());
        convert_f32(in.data(), static_cast<int>(in.size()), c, got.data());
        scalar::convert_f32(in.data(), static_cast<int>(in.size()), c, expected.data());
        ASSERT_TRUE(same_bytes(got, expected)) << c.raw_to_m;
    }
}

TEST_P(Depth, AnyCountAndNothingBeside) {
    Rng rng(101);
    const DepthConversion c = kConversions[0];
    for (int count = 0; count < 140; ++count)
        for (int shift = 0; shift < 3; ++shift) {
            const auto n = static_cast<std::size_t>(count), s = static_cast<std::size_t>(shift);
            std::vector<std::uint16_t> raw = tight<std::uint16_t>(n + s, 0);
            std::vector<float> metres = tight<float>(n + s, 0);
            for (std::size_t i = 0; i < n + s; ++i) {
                raw[i] = static_cast<std::uint16_t>(rng.below(5000));
                metres[i] = static_cast<float>(raw[i]);
            }
            const auto run = [&](auto kernel) {
                auto out = tight<std::uint16_t>(n + s + 3, 7);  // 3 sentinels
                kernel(out.data() + s);
                return out;
            };
            EXPECT_TRUE(
                same_bytes(run([&](auto* out) { convert_u16(raw.data() + s, count, c, out); }),
                           run([&](auto* out) { scalar::convert_u16(raw.data() + s, count, c, out); })));
            EXPECT_TRUE(
                same_bytes(run([&](auto* out) { convert_f32(metres.data() + s, count, c, out); }),
                           run([&](auto* out) { scalar::convert_f32(metres.data() + s, count, c, out); })));
            EXPECT_TRUE(same_bytes(
                run([&](auto* out) { keep_in_range(raw.data() + s, count, raw_range(c), out); }),
                run([&](auto* out) { scalar::keep_in_range(raw.data() + s, count, raw_range(c), out); })));
        }
}

std::uint16_t any_depth(Rng& rng, int density) {
    const std::uint16_t awkward[] = {0, 1, 2, 32767, 32768, 65533, 65534, 65535};
    if (rng.below(100) >= density) return 0;
    return rng.below(3) ? static_cast<std::uint16_t>(rng.below(65536)) : awkward[rng.below(8)];
}

TEST_P(Depth, TilesOfEverySize) {
    Rng rng(102);
    for (int width = 1; width <= 200; ++width)
        for (int rows = 1; rows <= 4; ++rows) {
            const int stride = width + rng.below(5), density = rng.below(3) ? 60 : 2;
            auto pixels = tight<std::uint16_t>(static_cast<std::size_t>(stride * (rows - 1) + width), 0);
            for (auto& d : pixels) d = any_depth(rng, density);
            const std::size_t tiles = static_cast<std::size_t>(width + 3) / 4;
            auto got = tight<DepthRange>(tiles + 1, {9, 9}), expected = got;
            const int valid = tile_ranges(pixels.data(), stride, rows, width, got.data());
            ASSERT_EQ(valid, scalar::tile_ranges(pixels.data(), stride, rows, width, expected.data()));
            ASSERT_TRUE(same_bytes(got, expected)) << width << " x " << rows;
            int count = 0;
            for (int y = 0; y < rows; ++y)
                for (int x = 0; x < width; ++x)
                    count += pixels[static_cast<std::size_t>(y * stride + x)] != 0;
            ASSERT_EQ(valid, count);
        }
}

TEST_P(Depth, TilesOfTheWidestImage) {
    Rng rng(103);
    std::vector<std::uint16_t> pixels(4 * 16384, 0);  // without depth: as many to count as there can be
    std::vector<DepthRange> ranges(4096, {1, 1});
    EXPECT_EQ(tile_ranges(pixels.data(), 16384, 4, 16384, ranges.data()), 0);
    for (const DepthRange& r : ranges) ASSERT_EQ(r, (DepthRange{0, 0}));
    std::fill(pixels.begin(), pixels.end(), std::uint16_t{65535});
    EXPECT_EQ(tile_ranges(pixels.data(), 16384, 4, 16384, ranges.data()), 4 * 16384);
    for (const DepthRange& r : ranges) ASSERT_EQ(r, (DepthRange{65535, 65535}));
}

BURIN_EVERY_TARGET(Depth);

}  // namespace
}  // namespace burin
