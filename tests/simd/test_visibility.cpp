// SPDX-License-Identifier: MIT
// Kernels of choosing and marking chunks: every target against the specification.
#include "simd/visibility.h"

#include "kernel_test.h"
#include "simd/band_boxes.h"

namespace burin {
namespace {

using namespace simd;

class Visibility : public KernelTest {};

TEST_P(Visibility, BoxesOfChunks) {
    Rng rng(150);
    const auto any = [&](float scale) {
        return scale * static_cast<float>(rng.below(20) ? rng.uniform(-1, 1) : rng.below(3) - 1);
    };
    for (int round = 0; round < 500; ++round) {
        ChunkProjection p{};
        const float scale = round % 3 ? 1e6f : 1e9f;
        for (float* v : {&p.origin_u, &p.origin_v, &p.origin_z}) *v = any(scale);
        for (int k = 0; k < 3; ++k) {
            p.step_u[k] = any(scale);
            p.step_v[k] = any(scale);
            p.step_z[k] = any(scale / 100);
        }
        for (int k = 0; k < 8; ++k) {
            p.corner_u[k] = any(scale);
            p.corner_v[k] = any(scale);
            p.corner_z[k] = any(scale / 100);
        }
        for (float* v : {&p.centre_u, &p.centre_v}) *v = any(1000);
        for (float* v : {&p.most_across, &p.most_z}) *v = std::fabs(any(scale));
        for (int k = 0; k < 3; ++k) {
            p.voxel_u[k] = any(scale);
            p.voxel_v[k] = any(scale);
            p.voxel_z[k] = any(scale);
        }
        ChunkBatch got{}, expected{};
        for (int i = 0; i < kBatchChunks; ++i) {
            got.x[i] = rng.below(400) - 200;
            got.y[i] = i == 0 ? (1 << 20) - 1 : rng.below(400) - 200;
            got.z[i] = rng.below(400) - 200;
        }
        expected = got;
        project_chunks(p, &got);
        scalar::project_chunks(p, &expected);
        // A division by exactly 0 may leave any NaN.
        const auto* a = reinterpret_cast<const float*>(&got);
        const auto* b = reinterpret_cast<const float*>(&expected);
        for (std::size_t i = 0; i < sizeof got / sizeof(float); ++i)
            ASSERT_TRUE(std::memcmp(a + i, b + i, sizeof(float)) == 0 ||
                        (std::isnan(a[i]) && std::isnan(b[i])))
                << round << " word " << i << ": " << a[i] << ", expected " << b[i];
    }
}

TEST_P(Visibility, SquaresOfTiles) {
    Rng rng(151);
    for (int round = 0; round < 100; ++round) {
        const int stride = 16 * (1 + rng.below(6)), rows = 1 + rng.below(9), side = 1 << rng.below(4);
        const int count = stride * rows;
        auto from = tight<std::uint32_t>(static_cast<std::size_t>(count + side + side * stride), 0);
        for (std::uint32_t& r : from) r = rng.below(4) ? static_cast<std::uint32_t>(rng.next()) : 0xffffffffu;
        auto got = tight<std::uint32_t>(static_cast<std::size_t>(count), 7), expected = got;
        double_ranges(from.data(), count, stride, side, got.data());
        scalar::double_ranges(from.data(), count, stride, side, expected.data());
        ASSERT_TRUE(same_bytes(got, expected)) << round;
    }
}

TEST_P(Visibility, BoxesOfTheBand) {
    Rng rng(152);
    for (int round = 0; round < 500; ++round) {
        BandView view{};
        for (int r = 0; r < 3; ++r) {
            view.slope_u[r] = static_cast<float>(rng.uniform(-0.1, 0.1));
            view.slope_v[r] = static_cast<float>(rng.uniform(-0.1, 0.1));
            view.slope_1[r] = static_cast<float>(rng.uniform(-30, 30));
            view.half_slope[r] = static_cast<float>(rng.uniform(0, 0.5));
            view.start_low[r] = static_cast<float>(rng.uniform(-10, 300));
            view.start_high[r] = view.start_low[r] - 0.9f;
        }
        view.unit_m = round % 4 ? 0.0002f : 0.001f;
        view.deep_m = static_cast<float>(rng.uniform(0.01, 1));
        view.truncation = {0.05f, round % 2 == 0, 0.0019f, -0.0015f, 0.0032f, 0.02f};
        const int count = 1 + rng.below(48);
        const auto room = static_cast<std::size_t>((count + 15) & ~15);
        std::vector<float> u(room), v(room);
        std::vector<std::uint32_t> ranges(room);
        for (std::size_t i = 0; i < room; ++i) {
            u[i] = static_cast<float>(rng.uniform(0, 640));
            v[i] = static_cast<float>(rng.uniform(0, 480));
            const std::uint32_t a = 1 + static_cast<std::uint32_t>(rng.below(65534)),
                                b = rng.below(3) ? a : 1 + static_cast<std::uint32_t>(rng.below(65534));
            ranges[i] = rng.below(6) == 0 ? 0 : std::min(a, b) | std::max(a, b) << 16;
        }
        std::vector<ChunkBox> got(room), expected(room);
        band_boxes(view, u.data(), v.data(), ranges.data(), count, got.data());
        scalar::band_boxes(view, u.data(), v.data(), ranges.data(), count, expected.data());
        for (int i = 0; i < count; ++i)
            ASSERT_EQ(std::memcmp(&got[static_cast<std::size_t>(i)], &expected[static_cast<std::size_t>(i)],
                                  sizeof(ChunkBox)),
                      0)
                << round << ' ' << i;
    }
}

BURIN_EVERY_TARGET(Visibility);

}  // namespace
}  // namespace burin
