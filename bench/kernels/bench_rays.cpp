// SPDX-License-Identifier: MIT
// Ray casting of 640 x 480 pixels on one thread, from the middle of a ball of 1.5 m at 5 mm voxels with
// smaller balls before its wall, and the kernels alone.
#include <memory>
#include <vector>

#include "kernels/kernels.h"
#include "map/raycast.h"
#include "scene_helpers.h"
#include "simd/rays.h"

using namespace burin;

namespace {

double distance(Vec3d p) {
    double d = 1.5 - norm(p);
    for (const Vec3d& centre : {Vec3d{0.3, 0.1, 1.0}, Vec3d{-0.4, -0.2, 0.9}, Vec3d{0, 0.3, 0.7}})
        d = std::min(d, norm(p - centre) - 0.15);
    return d;
}

const TestVolume& scene() {
    static const std::unique_ptr<TestVolume> map = [] {
        auto made = std::make_unique<TestVolume>(VolumeShape{40000, true, 0.005f, 0.02f});
        for (int z = 10; z < 40; ++z)
            for (int y = -30; y < 30; ++y)
                for (int x = -40; x < 40; ++x)
                    if (std::fabs(distance({(x + 0.5) * 0.04, (y + 0.5) * 0.04, (z + 0.5) * 0.04})) < 0.05)
                        made->fill({x, y, z}, {x, y, z}, distance);
        return made;
    }();
    return *map;
}

void cast(benchmark::State& state, bool with_normals_and_colour) {
    const Camera camera{640, 480, 525, 525, 319.5, 239.5};
    std::vector<float> depth(640 * 480), normals(3 * depth.size());
    std::vector<std::uint8_t> rgb(3 * depth.size());
    Jobs one(1);
    RaycastImages out{depth.data(), nullptr, nullptr};
    if (with_normals_and_colour) out = {depth.data(), normals.data(), rgb.data()};
    const Volume& volume = scene().volume;
    for (auto _ : state) {
        raycast(volume, camera, {}, 4, out, one);
        benchmark::ClobberMemory();
    }
    long hits = 0;
    for (const float d : depth) hits += d > 0;
    state.counters["hits"] = static_cast<double>(hits);
}

void kernels(benchmark::State& state) {
    auto rays = std::make_unique<simd::RayPacket>();
    *rays = {};
    std::int32_t readings[simd::kRays];
    for (int i = 0; i < simd::kRays; ++i) {
        const Vec3f d = to_float(normalised(Vec3d{0.01 * i, 0.3, 1}));
        for (int k = 0; k < 3; ++k) {
            rays->direction[k][i] = d[k];
            rays->inverse[k][i] = d[k] != 0 ? 1 / d[k] : 0;
        }
        rays->front[i] = rays->fine_end[i] = -1;
        readings[i] = i % 2 ? 32767 : simd::kNoChunkThere;
    }
    for (auto _ : state) {
        for (int i = 0; i < simd::kRays; ++i) rays->t[i] = 0, rays->t_end[i] = 100;
        benchmark::DoNotOptimize(simd::locate_voxels(rays.get()));
        benchmark::DoNotOptimize(simd::step_rays(rays.get(), readings, 4.0f / 32767));
    }
}

const bool registered = [] {
    bench::on_every_target("raycast_depth", [](auto& s) { cast(s, false); });
    bench::on_every_target("raycast_all", [](auto& s) { cast(s, true); });
    bench::on_every_target("step_64_rays", kernels);
    return true;
}();

}  // namespace
