// SPDX-License-Identifier: MIT
// What ICP does some 20 times a frame: 19,200 points find their cells in a view of as many, and their sums.
#include <vector>

#include "kernels/kernels.h"
#include "scene_helpers.h"
#include "simd/associate.h"
#include "simd/track.h"

using namespace burin;

namespace {

constexpr int kWidth = 160, kHeight = 120, kPoints = kWidth * kHeight;

// A wavy wall at 1.5 m, seen from two places 20 mm apart.
struct Scene {
    Scene() {
        const Camera camera = test_camera(kWidth, kHeight);
        for (auto& a : axis) a.resize(kPoints);
        for (std::size_t i = 0; i < kPoints; ++i) {
            const int u = static_cast<int>(i) % kWidth, v = static_cast<int>(i) / kWidth;
            const Vec3d ray = unproject(camera, {static_cast<double>(u), static_cast<double>(v)});
            const Vec3d p = ray * (1.5 + 0.05 * std::sin(9 * ray.x) + 0.05 * std::sin(7 * ray.y));
            const Vec3d n = normalised(Vec3d{0.3 * std::cos(9 * ray.x), 0.23 * std::cos(7 * ray.y), -1});
            for (int k = 0; k < 3; ++k) {
                axis[k][i] = static_cast<float>(p[k]);
                axis[3 + k][i] = static_cast<float>(n[k]);
            }
        }
        inverse_sigma.assign(kPoints, 300.0f);
        view = {kWidth,
                kHeight,
                static_cast<float>(camera.fx),
                static_cast<float>(camera.fy),
                static_cast<float>(camera.cx),
                static_cast<float>(camera.cy),
                {axis[0].data(), axis[1].data(), axis[2].data()},
                {axis[3].data(), axis[4].data(), axis[5].data()}};
    }
    std::vector<float> axis[6], inverse_sigma;
    simd::SurfaceGrid view;
};

void run(benchmark::State& state, bool with_sums) {
    static const Scene scene;
    simd::Association by = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.015f, 0.01f, 0.005f}, 0.1f, 0.7f, 0.05f};
    alignas(64) simd::TrackSums sums = {};
    long found = 0;
    for (auto _ : state) {
        for (int first = 0; first < kPoints; first += simd::kSampleBatch) {
            alignas(64) float distance[simd::kSampleBatch], gradient[3][simd::kSampleBatch],
                normalised[simd::kSampleBatch];
            float* const gradients[3] = {gradient[0], gradient[1], gradient[2]};
            const float* a[6];
            for (int k = 0; k < 6; ++k) a[k] = scene.axis[k].data() + first;
            simd::associate(scene.view, by, {a[0], a[1], a[2], a[3], a[4], a[5]}, simd::kSampleBatch,
                            distance, gradients);
            if (with_sums)
                simd::track_sums({a[0], a[1], a[2], scene.inverse_sigma.data() + first, distance, gradients},
                                 simd::kSampleBatch, by.R, {1.0f, 1.345f, false, 0.1f}, sums, normalised);
            found += distance[7] == distance[7];
            benchmark::DoNotOptimize(sums);
        }
        benchmark::ClobberMemory();
    }
    if (found == 0) state.SkipWithError("nothing corresponds");
    state.counters["ns_point"] =
        benchmark::Counter(static_cast<double>(kPoints) * 1e-9,
                           benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

const bool registered[] = {
    bench::on_every_target("associate", [](benchmark::State& state) { run(state, false); }),
    bench::on_every_target("associate_and_sums", [](benchmark::State& state) { run(state, true); }),
};

}  // namespace
