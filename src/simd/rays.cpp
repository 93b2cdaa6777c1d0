// SPDX-License-Identifier: MIT
#include "simd/rays.h"

#include <algorithm>

namespace burin::simd {
namespace {

// Where the ray leaves its voxel's chunk: the nearest voxels of a chunk lie from -1/2 to 7 1/2.
float chunk_exit(const RayPacket& r, int i) {
    float exit = 1e30f;
    for (int k = 0; k < 3; ++k) {
        const float direction = r.direction[k][i];
        if (direction == 0.0f) continue;
        const float wall = static_cast<float>(8 * r.chunk[k][i]) + (direction > 0.0f ? 7.5f : -0.5f);
        exit = std::min((wall - r.start[k]) * r.inverse[k][i], exit);
    }
    return exit;
}

}  // namespace

namespace scalar {

std::uint64_t locate_voxels(RayPacket* rays) {
    RayPacket& r = *rays;
    std::uint64_t walking = 0;
    for (int i = 0; i < kRays; ++i) {
        if (!(r.t[i] < r.t_end[i])) continue;
        walking |= std::uint64_t{1} << i;
        std::int32_t low = 0, high = 0, voxel = 0;
        for (int k = 2; k >= 0; --k) {
            const float v = r.start[k] + r.direction[k][i] * r.t[i] + 0.5f;
            std::int32_t floor = static_cast<std::int32_t>(v);
            floor -= static_cast<float>(floor) > v;
            const std::int32_t chunk = floor >> 3;
            r.chunk[k][i] = chunk;
            low = low << 3 | (chunk & 7);
            high = high << 10 | (chunk >> 3 & 1023);
            voxel = voxel << 3 | (floor & 7);
        }
        r.chunk_low[i] = low;
        r.chunk_high[i] = high;
        r.voxel[i] = voxel;
    }
    return walking;
}

std::uint64_t step_rays(RayPacket* rays, const std::int32_t* readings, float units) {
    RayPacket& r = *rays;
    std::uint64_t near = 0;
    for (int i = 0; i < kRays; ++i) {
        const float t = r.t[i];
        if (!(t < r.t_end[i])) continue;
        const bool known = readings[i] > kNotObserved;
        const bool fine = t < r.fine_end[i];
        const float d = static_cast<float>(readings[i]) * units;
        const bool coarse = known && d > kFarVoxels && !fine;
        if (known && !coarse) {
            near |= std::uint64_t{1} << i;
            continue;
        }
        r.before_d[i] = -1.0f;
        if (coarse) {
            r.front[i] = t;
            r.t[i] = t + kLongStep * d;
        } else if (r.front[i] >= 0.0f) {
            r.fine_end[i] = t;
            r.t[i] = r.front[i];
            r.front[i] = -1.0f;
        } else if (fine || readings[i] == kNotObserved) {
            r.t[i] = t + kShortStep;
        } else {
            r.t[i] = std::max(chunk_exit(r, i), t) + kBehindWall;
        }
    }
    return near;
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
std::uint64_t locate_voxels(RayPacket* rays) { return scalar::locate_voxels(rays); }
std::uint64_t step_rays(RayPacket* rays, const std::int32_t* readings, float units) {
    return scalar::step_rays(rays, readings, units);
}
#endif

}  // namespace burin::simd
