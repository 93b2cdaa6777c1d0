// SPDX-License-Identifier: MIT
// Kernels of ray casting: the 64 rays of a square of pixels walk through the field side by side. A ray is at
// v(t) = start + direction t in lattice coordinates (voxel centres at integers); t and distances in voxels.
#pragma once

#include <cstdint>

namespace burin::simd {

inline constexpr int kRays = 64;  // 8 x 8 pixels: bits of a word, and few chunks for all of them

// Rays end here: the parts of a voxel's address below hold |v| < 2^15. 160 m at 5 mm.
inline constexpr float kRayLimit = 32000.0f;

struct RayPacket {
    float start[3];                         // of all rays
    alignas(64) float direction[3][kRays];  // unit
    alignas(64) float inverse[3][kRays];    // 1 / direction; not used where that is 0
    alignas(64) float t[kRays];
    alignas(64) float t_end[kRays];  // the ray walks while t < t_end

    // A step as long as the distance may jump over the surface: the nearest voxel is off by up to one, and
    // projective distances taken at a grazing angle are several times the true ones. So where a step from
    // `front` in free space (< 0: none) lands behind the surface or in the unknown, the way up to there,
    // `fine_end`, is walked again in short steps.
    alignas(64) float front[kRays];
    alignas(64) float fine_end[kRays];
    // The last distance interpolated and where, when it was positive and nothing else came since; else < 0.
    alignas(64) float before_d[kRays];
    alignas(64) float before_t[kRays];

    // The voxel nearest to v(t), by locate_voxels: its chunk relative to that of voxel 0, in two parts, and
    // its index there.
    alignas(64) std::int32_t chunk[3][kRays];
    alignas(64) std::int32_t chunk_low[kRays];   // low three bits of z, y, x
    alignas(64) std::int32_t chunk_high[kRays];  // ten more of each
    alignas(64) std::int32_t voxel[kRays];
};

inline constexpr float kFarVoxels = 2.0f;    // beyond this distance the nearest voxel is good enough
inline constexpr float kLongStep = 0.8f;     // of the distance
inline constexpr float kShortStep = 0.5f;    // in the unknown: a voxel is the nearest for a whole one
inline constexpr float kBehindWall = 0.01f;  // a step into the next chunk, more than rounding errors

// Fills chunk*, voxel for the rays with t < t_end; their bits are the result. |v| < 2^15.
std::uint64_t locate_voxels(RayPacket* rays);

// What was read at `voxel`: a distance in stored units, or
inline constexpr std::int32_t kNoChunkThere = -2147483647 - 1;
inline constexpr std::int32_t kNotObserved = kNoChunkThere + 1;

// One step of each ray with t < t_end: by kLongStep * distance in free space, out of the chunk where there is
// none, by kShortStep where nothing was observed or where the way is walked again. `units`: voxels a stored
// unit. The rays of the resulting bits are near the surface or walk finely and have not moved: they want the
// interpolated distance.
std::uint64_t step_rays(RayPacket* rays, const std::int32_t* readings, float units);

// What the functions above specify, one lane at a time.
namespace scalar {
std::uint64_t locate_voxels(RayPacket* rays);
std::uint64_t step_rays(RayPacket* rays, const std::int32_t* readings, float units);
}  // namespace scalar

}  // namespace burin::simd
