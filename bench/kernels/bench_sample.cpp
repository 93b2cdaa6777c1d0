// SPDX-License-Identifier: MIT
// Reading the field at 15,360 points of a depth image, as tracking does 20 times a frame: a wall curved like
// the inside of a ball of 1.5 m at 5 mm voxels, some 7,000 chunks, looked at from its middle.
#include <memory>
#include <vector>

#include "kernels/kernels.h"
#include "map/sample.h"
#include "map/sample_batch.h"
#include "scene_helpers.h"

using namespace burin;

namespace {

constexpr double kVoxel = 0.005, kRadius = 1.5;
constexpr int kColumns = 160, kRows = 96;
constexpr std::size_t kPoints = kColumns * kRows;

struct Scene {
    Scene() : map({40000, false, 0.005f, 0.02f}) {
        const double chunk = 8 * kVoxel;
        for (int z = 10; z < 40; ++z)
            for (int y = -30; y < 30; ++y)
                for (int x = -40; x < 40; ++x) {
                    const Vec3d centre{(x + 0.5) * chunk, (y + 0.5) * chunk, (z + 0.5) * chunk};
                    if (std::fabs(norm(centre) - kRadius) > 0.02 + 0.87 * chunk) continue;
                    map.fill({x, y, z}, {x, y, z}, [](Vec3d p) { return kRadius - norm(p); });
                }
        Rng rng(1);
        for (int v = 0; v < kRows; ++v)
            for (int u = 0; u < kColumns; ++u) {
                // Pixels of a camera with f = 525 / 4, with 3 mm of noise along the ray.
                const Vec3d ray = normalised(Vec3d{(u - 79.5) / 131.0, (v - 47.5) / 131.0, 1});
                const Vec3d p = ray * (kRadius + 0.003 * rng.normal());
                for (int k = 0; k < 3; ++k) {
                    axis[k].push_back(static_cast<float>(p[k]));
                    world.push_back(p[k]);
                }
            }
    }
    TestVolume map;
    std::vector<float> axis[3];
    std::vector<double> world;
};

const Scene& scene() {
    static const Scene the_scene;
    return the_scene;
}

// Every evaluation has another pose, as in an optimiser's steps.
Se3 pose(int i) { return {{}, {0.0004 * (i % 20), -0.0003 * (i % 20), 0.0005 * (i % 20)}}; }

void per_point(benchmark::State& state) {
    state.counters["ns_point"] =
        benchmark::Counter(static_cast<double>(kPoints) * 1e-9,
                           benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
    state.counters["chunks"] = scene().map.volume.live();
}

void track(benchmark::State& state) {
    std::vector<float> d(kPoints), g[3] = {d, d, d};
    float* const gradients[3] = {g[0].data(), g[1].data(), g[2].data()};
    int i = 0;
    std::size_t known = 0;
    for (auto _ : state) {
        BatchSampler sampler(scene().map.volume);
        sampler.sample(LatticeFrame(scene().map.volume, pose(i++)), scene().axis[0].data(),
                       scene().axis[1].data(), scene().axis[2].data(), kPoints, d.data(), gradients);
        known += d[kPoints / 2] == d[kPoints / 2];
        benchmark::ClobberMemory();
    }
    if (known == 0) state.SkipWithError("the points miss the map");
    per_point(state);
}

void world_points(benchmark::State& state) {
    std::vector<float> d(kPoints), g(3 * kPoints);
    for (auto _ : state) {
        BatchSampler(scene().map.volume).sample(scene().world.data(), kPoints, d.data(), g.data());
        benchmark::ClobberMemory();
    }
    per_point(state);
}

// What there is without batches.
void one_at_a_time(benchmark::State& state) {
    std::vector<float> d(kPoints);
    std::vector<Vec3f> g(kPoints);
    int i = 0;
    for (auto _ : state) {
        Sampler sampler(scene().map.volume);
        const Se3 T = pose(i++);
        for (std::size_t k = 0; k < kPoints; ++k)
            sampler.distance_and_gradient(
                T * Vec3d{scene().axis[0][k], scene().axis[1][k], scene().axis[2][k]}, &d[k], &g[k]);
        benchmark::ClobberMemory();
    }
    per_point(state);
}

void interpolate(benchmark::State& state) {
    auto corners = std::make_unique<simd::Corners>();
    auto cells = std::make_unique<simd::Cells>();
    for (int i = 0; i < simd::kSampleBatch; ++i)
        for (int k = 0; k < 4; ++k) {
            corners->sdf[k][i] = static_cast<std::uint32_t>(i * 7919 * (k + 1));
            corners->weight[k][i] = 0x400040;
            cells->t[k % 3][i] = 0.3f;
        }
    float d[simd::kSampleBatch], g[3][simd::kSampleBatch];
    for (auto _ : state) {
        simd::interpolate_cells(*corners, cells->t, simd::kSampleBatch, {1e-6f, 1e-4f}, d, g);
        benchmark::ClobberMemory();
    }
}

const bool registered = [] {
    bench::on_every_target("track_15360_points", track);
    bench::on_every_target("world_points", world_points);
    bench::on_every_target("interpolate_64_cells", interpolate);
    benchmark::RegisterBenchmark("one_at_a_time", one_at_a_time)->Unit(benchmark::kMicrosecond);
    return true;
}();

}  // namespace
