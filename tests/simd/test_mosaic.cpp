// SPDX-License-Identifier: MIT
// Colour as sensors send it: every target against the specification, and that against what must come out.
#include "simd/mosaic.h"

#include "kernel_test.h"

namespace burin {
namespace {

using namespace simd;

class Mosaic : public KernelTest {};

TEST_P(Mosaic, Yuv422) {
    Rng rng(230);
    for (int round = 0; round < 2000; ++round) {
        const int count = round < 200 ? round : rng.below(400);
        std::size_t bytes = static_cast<std::size_t>((count + 1) / 2 * 4);
        if (rng.below(3) == 0) bytes = static_cast<std::size_t>(rng.below(2 * count + 9));
        std::vector<std::uint8_t> in = tight<std::uint8_t>(bytes, 0);
        for (auto& b : in) b = static_cast<std::uint8_t>(rng.below(4) ? rng.below(256) : rng.below(2) * 255);
        std::vector<std::uint8_t> got = tight<std::uint8_t>(static_cast<std::size_t>(3 * count), 7),
                                  expected = got;
        const Yuv422 order = round % 2 ? Yuv422::yuyv : Yuv422::uyvy;
        const int n = yuv422_to_rgb(order, in.data(), bytes, count, got.data());
        ASSERT_EQ(n, scalar::yuv422_to_rgb(order, in.data(), bytes, count, expected.data()));
        ASSERT_EQ(n, std::min(count, static_cast<int>(bytes / 4 * 2)));
        ASSERT_TRUE(same_bytes(got, expected));
    }
}

TEST_P(Mosaic, Bayer) {
    Rng rng(231);
    for (int round = 0; round < 2000; ++round) {
        const int width = round < 150 ? round : 1 + rng.below(300);
        // Rows end where their margin does.
        std::vector<std::uint8_t> rows[5];
        const std::uint8_t* at[5];
        const bool extreme = rng.below(2) == 0;
        for (int k = 0; k < 5; ++k) {
            rows[k] = tight<std::uint8_t>(static_cast<std::size_t>(width + 2 * kBayerMargin), 0);
            for (auto& b : rows[k])
                b = static_cast<std::uint8_t>(extreme ? rng.below(2) * 255 : rng.below(256));
            at[k] = rows[k].data() + kBayerMargin;
        }
        std::vector<std::uint8_t> got = tight<std::uint8_t>(static_cast<std::size_t>(3 * width), 7),
                                  expected = got;
        const auto first = static_cast<BayerRow>(round % 4);
        demosaic_row(at, first, width, got.data());
        scalar::demosaic_row(at, first, width, expected.data());
        ASSERT_TRUE(same_bytes(got, expected)) << "round " << round;
    }
}

BURIN_EVERY_TARGET(Mosaic);

TEST(MosaicSpecification, KnowsBlackWhiteAndThePrimaries) {
    // BT.601 of video range: white, black, and the primaries of full saturation.
    const struct {
        std::uint8_t y, u, v;
        int rgb[3];
    } kColours[] = {{235, 128, 128, {255, 255, 255}},
                    {16, 128, 128, {0, 0, 0}},
                    {81, 90, 240, {255, 0, 0}},
                    {145, 54, 34, {0, 255, 0}},
                    {41, 240, 110, {0, 0, 255}}};
    for (const auto& c : kColours) {
        const std::uint8_t yuyv[] = {c.y, c.u, c.y, c.v}, uyvy[] = {c.u, c.y, c.v, c.y};
        std::uint8_t a[6], b[6];
        ASSERT_EQ(scalar::yuv422_to_rgb(Yuv422::yuyv, yuyv, 4, 2, a), 2);
        ASSERT_EQ(scalar::yuv422_to_rgb(Yuv422::uyvy, uyvy, 4, 2, b), 2);
        EXPECT_EQ(std::memcmp(a, b, 6), 0);
        for (int k = 0; k < 6; ++k) EXPECT_NEAR(a[k], c.rgb[k % 3], 2);
    }
}

// A plane of one colour, and a grey ramp: a linear interpolation keeps both.
TEST(MosaicSpecification, KeepsPlainColoursAndRamps) {
    constexpr int kWidth = 40, kHeight = 12;
    for (int order = 0; order < 4; ++order) {
        const int kSites[4][2][2] = {{{0, 1}, {1, 2}}, {{1, 0}, {2, 1}}, {{1, 2}, {0, 1}}, {{2, 1}, {1, 0}}};
        const BayerRow kFirst[4][2] = {{BayerRow::rg, BayerRow::gb},
                                       {BayerRow::gr, BayerRow::bg},
                                       {BayerRow::gb, BayerRow::rg},
                                       {BayerRow::bg, BayerRow::gr}};
        for (const bool ramp : {false, true}) {
            const auto colour = [&](int x, int y, int c) { return ramp ? 20 + 3 * x + 2 * y : 40 + 70 * c; };
            std::vector<std::uint8_t> mosaic(kWidth * kHeight);
            for (int y = 0; y < kHeight; ++y)
                for (int x = 0; x < kWidth; ++x)
                    mosaic[static_cast<std::size_t>(y * kWidth + x)] =
                        static_cast<std::uint8_t>(colour(x, y, kSites[order][y & 1][x & 1]));
            for (int y = 2; y < kHeight - 2; ++y) {
                const std::uint8_t* rows[5];
                for (int k = 0; k < 5; ++k) rows[k] = mosaic.data() + (y - 2 + k) * kWidth + 2;
                std::uint8_t rgb[3 * (kWidth - 4)];
                scalar::demosaic_row(rows, kFirst[order][y & 1], kWidth - 4,
                                     rgb);  // 2 columns on: same colours
                for (int x = 0; x < kWidth - 4; ++x)
                    for (int c = 0; c < 3; ++c)
                        ASSERT_EQ(rgb[3 * x + c], colour(x + 2, y, c)) << order << " " << x << " " << y;
            }
        }
    }
}

}  // namespace
}  // namespace burin
