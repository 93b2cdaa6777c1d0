// SPDX-License-Identifier: MIT
// Footprints and cells of a row: every target against the specification, and the specification against the
// cameras' own projection in double.
#include "simd/reproject.h"

#include "kernel_test.h"

namespace burin {
namespace {

using namespace simd;

class Reproject : public KernelTest {};

float awkward(Rng& rng) {
    return awkward_floats()[static_cast<std::size_t>(rng.below(static_cast<int>(awkward_floats().size())))];
}

Reprojection random_reprojection(Rng& rng, bool adversarial) {
    Reprojection by;
    by.width = 1 + rng.below(60);
    by.height = 1 + rng.below(40);
    by.pitch = by.width + rng.below(9);
    const float scale = static_cast<float>(rng.uniform(0.3, 3));
    const auto small = [&] { return static_cast<float>(rng.uniform(-0.05, 0.05)); };
    by.h[0] = scale, by.h[1] = small(), by.h[2] = static_cast<float>(rng.uniform(-10, 10));
    by.h[3] = small(), by.h[4] = scale, by.h[5] = static_cast<float>(rng.uniform(-10, 10));
    by.h[6] = small() * 0.01f, by.h[7] = small() * 0.01f, by.h[8] = 1;
    for (float& t : by.t) t = static_cast<float>(rng.uniform(-900, 900));
    by.half_u = by.half_v = 0.53f * scale;
    by.nearest = static_cast<float>(rng.uniform(1, 400));
    by.distorted = rng.below(2) == 0;
    if (by.distorted) {
        const float f = static_cast<float>(by.width);
        for (int i = 0; i < 6; ++i) by.h[i] /= f;
        by.t[0] /= f, by.t[1] /= f;
        by.half_u = by.half_v = 0.53f * scale;
        by.fx = by.fy = f;
        by.k1 = small() * 4, by.k2 = small(), by.k3 = small(), by.p1 = small() * 0.1f, by.p2 = small() * 0.1f;
        by.most_r2 = static_cast<float>(rng.uniform(0.1, 2));
    }
    if (adversarial) {
        float* const numbers[] = {by.h, by.h + 4, by.h + 8, by.t, by.t + 2, &by.k1, &by.half_u, &by.most_r2};
        // The contract wants finite numbers of sensible size in h and t; large ones must stay harmless.
        *numbers[rng.below(8)] = rng.below(2) ? 1e9f : -1e9f;
        by.half_u = std::fabs(by.half_u);
    }
    return by;
}

struct Row {
    std::vector<std::uint16_t> depth;
    std::vector<float> x, y, span;
    int line;
    Row(Rng& rng, int width)
        : depth(tight<std::uint16_t>(static_cast<std::size_t>(width), 0)),
          x(tight<float>(static_cast<std::size_t>(width), 0)),
          y(tight<float>(static_cast<std::size_t>(width), 0)),
          span(tight<float>(static_cast<std::size_t>(width), 0)),
          line(rng.below(50)) {
        for (std::size_t i = 0; i < depth.size(); ++i) {
            const int kind = rng.below(12);
            depth[i] = static_cast<std::uint16_t>(kind == 0   ? 0
                                                  : kind == 1 ? 65535
                                                  : kind == 2 ? rng.below(65536)
                                                              : 500 + rng.below(4000));
            x[i] = static_cast<float>(i) + static_cast<float>(rng.uniform(-2, 2));
            y[i] = static_cast<float>(line) + static_cast<float>(rng.uniform(-2, 2));
            span[i] = static_cast<float>(rng.uniform(0.25, 4));
            if (rng.below(200) == 0) x[i] = awkward(rng);
        }
    }
};

struct Landed {
    std::vector<std::int32_t> cell;
    std::vector<std::uint32_t> what;
    std::vector<std::uint16_t> depth;
    explicit Landed(int width) {
        const auto n =
            static_cast<std::size_t>((width + kFootprintBatch - 1) / kFootprintBatch * kFootprintBatch);
        cell = tight<std::int32_t>(n, 77);
        what = tight<std::uint32_t>(n, 77);
        depth = tight<std::uint16_t>(n, 77);
    }
    Footprints view() { return {cell.data(), what.data()}; }
    int columns(std::size_t i) const { return static_cast<int>(what[i] & 255); }
    int rows(std::size_t i) const { return static_cast<int>(what[i] >> 8 & 255); }
    std::uint32_t less_one(std::size_t i) const { return what[i] >> 16; }
};

TEST_P(Reproject, FindsTheSpecificationsFootprints) {
    Rng rng(210);
    int landed = 0, nowhere = 0;
    for (int round = 0; round < 3000; ++round) {
        const int width = round < 200 ? round / 2 : 1 + rng.below(150);
        const Reprojection by = random_reprojection(rng, round % 5 == 4);
        const Row row(rng, width);
        const RayRow table = {row.x.data(), row.y.data(), row.span.data()};
        const RayRow* rays = rng.below(2) ? &table : nullptr;
        Landed got(width), expected(width);
        footprints_row(row.depth.data(), width, row.line, rays, by, got.view());
        scalar::footprints_row(row.depth.data(), width, row.line, rays, by, expected.view());
        ASSERT_TRUE(same_bytes(got.cell, expected.cell)) << "round " << round;
        ASSERT_TRUE(same_bytes(got.what, expected.what)) << "round " << round;
        for (std::size_t i = 0; i < got.cell.size(); ++i) {
            const int columns = got.columns(i), rows = got.rows(i);
            ASSERT_TRUE(columns >= 1 && columns <= 16 && rows >= 1 && rows <= 16);
            ASSERT_GE(got.cell[i], 0);
            ASSERT_LE(got.cell[i] % by.pitch + columns, by.width);
            ASSERT_LE(got.cell[i] / by.pitch + rows, by.height);
            (got.less_one(i) == 65535 ? nowhere : landed) += 1;
        }
        cells_row(row.depth.data(), width, row.line, rays, by, got.cell.data(), got.depth.data());
        scalar::cells_row(row.depth.data(), width, row.line, rays, by, expected.cell.data(),
                          expected.depth.data());
        ASSERT_TRUE(same_bytes(got.cell, expected.cell)) << "round " << round;
        ASSERT_TRUE(same_bytes(got.depth, expected.depth)) << "round " << round;
    }
    EXPECT_GT(landed, 5000);
    EXPECT_GT(nowhere, 10000);
}

TEST_P(Reproject, AddsOne) {
    Rng rng(211);
    for (int count = 0; count < 150; ++count) {
        std::vector<std::uint16_t> got = tight<std::uint16_t>(static_cast<std::size_t>(count), 65535);
        for (auto& v : got)
            if (rng.below(3)) v = static_cast<std::uint16_t>(rng.below(65536));
        std::vector<std::uint16_t> expected = got;
        add_one(got.data(), count);
        for (auto& v : expected) v = static_cast<std::uint16_t>(v == 65535 ? 0 : v + 1);
        ASSERT_TRUE(same_bytes(got, expected));
    }
}

TEST_P(Reproject, SplatsTheNearest) {
    Rng rng(213);
    for (int round = 0; round < 300; ++round) {
        const int width = 1 + rng.below(60), pitch = 20 + rng.below(2) * rng.below(9);
        constexpr int kHeight = 30;
        Landed row(width);
        const Reprojection by = [&] {
            Reprojection r;
            r.width = 20, r.height = kHeight, r.pitch = pitch;
            return r;
        }();
        std::vector<std::uint16_t> expected(static_cast<std::size_t>(pitch * kHeight), 65535);
        for (std::size_t i = 0; i < row.cell.size(); ++i) {
            const bool none = i >= static_cast<std::size_t>(width) || rng.below(5) == 0;
            const int columns = round % 2 || none ? 1 : 1 + rng.below(3),
                      rows = round % 2 || none ? 1 : 1 + rng.below(3);
            const int x = none ? 0 : rng.below(by.width - columns + 1),
                      y = none ? 0 : rng.below(kHeight - rows + 1);
            row.cell[i] = y * pitch + x;
            const int less_one = none ? 65535 : rng.below(65535);
            row.what[i] =
                static_cast<std::uint32_t>(less_one) << 16 | static_cast<std::uint32_t>(columns | rows << 8);
            for (int v = y; v < y + rows; ++v)
                for (int u = x; u < x + columns; ++u) {
                    std::uint16_t& at = expected[static_cast<std::size_t>(v * pitch + u)];
                    at = std::min(at, static_cast<std::uint16_t>(less_one));
                }
        }
        expected.resize(
            static_cast<std::size_t>((kHeight - 1) * pitch + by.width));  // no cell behind the last
        std::vector<std::uint16_t> got = tight<std::uint16_t>(expected.size(), 65535);
        splat_row(row.view(), width, by, got.data());
        ASSERT_TRUE(same_bytes(got, expected));
        got.assign(got.size(), 65535);
        scalar::splat_row(row.view(), width, by, got.data());
        ASSERT_TRUE(same_bytes(got, expected));
    }
}

BURIN_EVERY_TARGET(Reproject);

// Against the definition: a cell is covered when its centre lies in the footprint.
TEST(ReprojectSpecification, CoversTheCellsWhoseCentresLieInside) {
    Rng rng(212);
    int covered = 0, unsure = 0;
    for (int round = 0; round < 400; ++round) {
        Reprojection by = random_reprojection(rng, false);
        by.distorted = false;
        by.h[0] = by.h[4] = static_cast<float>(rng.uniform(0.5, 3));
        by.half_u = by.half_v = 0.53f * by.h[0];
        const Row row(rng, 40);
        Landed got(40);
        scalar::footprints_row(row.depth.data(), 40, row.line, nullptr, by, got.view());
        for (int i = 0; i < 40; ++i) {
            const auto k = static_cast<std::size_t>(i);
            const double z = row.depth[k];
            double q[3];
            for (int a = 0; a < 3; ++a)
                q[a] =
                    (by.h[3 * a] * static_cast<double>(i) + by.h[3 * a + 1] * static_cast<double>(row.line) +
                     static_cast<double>(by.h[3 * a + 2])) *
                        z +
                    static_cast<double>(by.t[a]);
            if (row.depth[k] == 0 || row.depth[k] == 65535 || q[2] < static_cast<double>(by.nearest)) {
                EXPECT_EQ(got.what[k], kNowhere);
                continue;
            }
            const double u = q[0] / q[2], v = q[1] / q[2], half = static_cast<double>(by.half_u) * z / q[2];
            if (half > static_cast<double>(kMostHalf)) continue;
            for (int cy = 0; cy < by.height; ++cy)
                for (int cx = 0; cx < by.width; ++cx) {
                    const double edge =
                        std::min(std::fabs(std::fabs(cx - u) - half), std::fabs(std::fabs(cy - v) - half));
                    const bool inside = cx >= u - half && cx < u + half && cy >= v - half && cy < v + half;
                    const int x = got.cell[k] % by.pitch, y = got.cell[k] / by.pitch;
                    const bool claimed = got.what[k] != kNowhere && cx >= x && cx < x + got.columns(k) &&
                                         cy >= y && cy < y + got.rows(k);
                    if (edge < 1e-3) {
                        ++unsure;
                        continue;
                    }
                    ASSERT_EQ(claimed, inside)
                        << "round " << round << " pixel " << i << " cell " << cx << " " << cy;
                    covered += inside;
                }
        }
    }
    EXPECT_GT(covered, 1000);
}

TEST(ReprojectSpecification, HidesWhatASurfaceStandsBefore) {
    const std::uint8_t rgb[] = {1, 2, 3,  4,  5,  6,  7,
                                8, 9, 10, 11, 12, 99, 99};            // two rows of two, and two bytes
    const std::uint16_t registered[] = {1000, 0, 77, 2000, 500, 77};  // pitch 3
    const std::int32_t cell[] = {0, 0, 1, 3, 4, 0};
    const std::uint16_t there[] = {1015, 1035, 900, 2000, 600, 0};
    std::uint8_t out[18], mask[6];
    colours_row(cell, there, 6, {rgb, 6, registered, 3, 10}, out, mask);
    const std::uint8_t expected_mask[] = {255, 0, 255, 255, 0, 0};
    const std::uint8_t expected[] = {1, 2, 3, 0, 0, 0, 4, 5, 6, 7, 8, 9, 0, 0, 0, 0, 0, 0};
    EXPECT_EQ(std::memcmp(mask, expected_mask, 6), 0);
    EXPECT_EQ(std::memcmp(out, expected, 18), 0);
}

}  // namespace
}  // namespace burin
