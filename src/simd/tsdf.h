// SPDX-License-Identifier: MIT
// Kernels of integration. A chunk is fused in two passes: `observe_chunk` turns 512 voxel centres and the
// depth image into 512 signed distances in L1 without touching the map; `fuse_distances` averages them in.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin::simd {

inline constexpr int kChunkVoxels = 512;  // 8 x 8 x 8, voxel i at (i & 7, i >> 3 & 7, i >> 6)

inline constexpr std::int16_t kUnseen = -32768;  // no reading, or hidden behind the surface beyond truncation
inline constexpr std::int16_t kFree = 32767;     // in front of the surface by the truncation distance or more

// An observation of weight 1 counts this many units of the stored weight. With 1/64 as unit, (1 m / z)^2
// still has one unit at 8 m, and 1000 observations fit the 16 bits.
inline constexpr int kWeightOne = 64;

// Voxel centres in projective coordinates: U = (fx X + (cx + 1) Z) k and V likewise (pixels of the bordered
// image times length), Z k (length), with lengths in stored units, k = 32767 / truncation. The projection of
// a sum is the sum of projections, so a voxel costs three additions: base + offset.
// A block is 4x4x1 voxels, a slab two blocks side by side; voxel (x, y, z) is number 4 * (y & 3) + (x & 3) of
// block (x >> 2) + 2 * (y >> 2) + 4 * z. With this order, narrowing a vector of left halves of rows and one
// of right halves to 16 bits leaves whole rows, whatever the width of a vector.
inline constexpr int kBlocks = 32, kSlabs = 16, kBlockVoxels = 16;
struct ProjectiveOffsets {
    struct Block {
        float u[kBlockVoxels], v[kBlockVoxels], z[kBlockVoxels];
    };
    alignas(64) Block block[kBlocks];
};
struct ProjectiveBase {
    float u, v, z;  // of voxel 0
};

// How the voxels of a chunk find their pixels. exact: each by its own division. Otherwise by groups of 4x4x2
// voxels, whose middles divide; the others lie where the map that is affine in the group puts them, in fixed
// point. A group must fall into a window around its middle: 8x8 pixels (narrow) or 16x16 (wide). Where the
// true offset from the middle is d pixels, the affine one is off by d times the voxel's relative depth in the
// group, so by less than reach^2 / focal length.
enum class Pixels : std::uint8_t { exact, narrow, wide };

// A chunk in the image. far and inside are hints that save work; false is always right.
struct ProjectedChunk {
    float u, v, z;  // of voxel 0
    bool far;       // all voxels lie farther than 32768 units
    bool inside;    // far, and all voxels fall into the image
    Pixels pixels;  // not exact: far, inside, the frame allows groups, and ChunkBatch::group_reach is below
                    // kNarrowReach or kWideReach
    float along;    // factor of all distances: 1, or the length of the ray with z = 1, to measure along it
};
// From the middle of a window of 8 or 16 pixels; the rest is for rounding.
inline constexpr float kNarrowReach = 3.45f, kWideReach = 7.45f;

// Groups of 4x4x2 voxels: group g begins at voxel (4 (g & 1), 4 (g >> 1 & 1), 2 (g >> 2)); its voxel (x, y,
// z) is in lane 8 y + 4 z + x. With this order, the halves of 64 bits of a left and a right group,
// interleaved, are whole rows. (u, v) of a voxel relative to the middle are written as the part at the
// middle's depth, (fx X, fy Y), and the shear (c - middle) Z: terms of the same size as their sum.
inline constexpr int kGroups = 16, kGroupVoxels = 32;
struct GroupOffsets {
    // fx X and fy Y over most_across, Z over most_z, of the voxels of a group from its middle, in 1/32767.
    alignas(64) std::int16_t across_u[kGroupVoxels], across_v[kGroupVoxels], z[kGroupVoxels];
    alignas(64) float middle_u[kGroups], middle_v[kGroups], middle_z[kGroups];  // as ProjectiveOffsets
    float most_across, most_z;                                                  // above 0
    float centre_u, centre_v;  // principal point, pixels of the bordered image
};

struct TruncationModel {
    float
        truncation_m;  // constant model: the truncation; quadratic model: its largest value, the stored scale
    bool quadratic;    // tau(z) = max(floor_m, a z^2 + b z + c): Chisel 2015, eq. of its noise model
    float a, b, c, floor_m;
    float units_per_m() const { return 32767.0f / truncation_m; }
    float at(float depth_m) const;  // tau, metres
};

// The weight behind the surface (Bylow 2013): full down to `start_m` behind it, then falling to 0 at -tau.
enum class Drop { none, linear, exponential };

// What all chunks of a frame share. Depth has a border of one pixel of zeros around the image, so that a
// projection clipped to the border reads "no depth".
struct DepthProjection {
    const std::uint16_t*
        pixels;  // (height + 2) rows of `stride`, image pixel (x, y) at (y + 1) * stride + x + 1
    const std::uint16_t*
        weights;  // same layout, in units of 1/kWeightOne; null: every reading weighs kWeightOne
    int width, height, stride;
    float unit_m;
    TruncationModel truncation;
    Drop drop;
    float drop_start_m;
    ProjectiveOffsets offsets;
    GroupOffsets groups;

    // May chunks be projected by groups, with distances of up to `along` times their depth? No with weights
    // by pixel or drop, with the quadratic model, for images whose windows do not fit them or a 16-bit
    // offset, and where a step of depth or the depth of a group is too large or too small beside the
    // truncation for 16 bits.
    bool allows_groups(float along) const;
    bool weighted() const { return weights != nullptr || drop != Drop::none; }
};

// distances[i] = s = (depth at the nearest pixel - z of voxel i) in stored units, rounded to nearest; kFree
//   from 32767 on; kUnseen when there is no reading, s <= -tau(depth) (from -32768 on), or z <= kLeastZ.
// weights[i], written when frame.weighted(): the pixel's weight times the drop; kUnseen where that is 0.
//   chunk.pixels not exact: the same to within 4 units, at the pixel of the affine map (observe_groups).
// touched: some voxel lies in the band: neither kUnseen (before the drop) nor kFree, and with the quadratic
//   model s < tau(depth). free: some voxel is kFree. When nothing is touched and nothing is free, the arrays
//   may be left unwritten.
// ahead: 2 KiB that will be wanted next; they are asked for piece by piece, since asking at once keeps the
// depth
//   waiting. May be null.
struct Observation {
    bool touched, free;
};
inline constexpr float kLeastZ =
    1e-3f;  // metres; keeps 1 / z finite, a tenth of the nearest depth any config allows
Observation observe_chunk(const DepthProjection& frame, const ProjectedChunk& chunk, std::int16_t* distances,
                          std::uint16_t* weights, const void* ahead = nullptr);

// The weighted running average (Curless & Levoy 1996): for every voxel that is not kUnseen
//   sdf += round(w (distance - sdf) / (weight_sum + w));  weight_sum = min(weight_sum + w, max_weight)
// `weights` null: every observation weighs kWeightOne, and the step is taken in fixed point, with the share
// r = round(2^15 kWeightOne / (weight_sum + kWeightOne)) of this observation: [r distance] - [r sdf], where
// [x] = floor(x / 2^15 + 1/2); within a unit of the above, never beyond the distance, saturated at 16 bits;
// a voxel without weight takes the distance. max_weight <= 64000. Returns the least |sdf| over the voxels it
// changed, kFree when it changed none.
// *moved (may be null) = the largest |step| of the voxels with |sdf| <= near before or after it; 65535 when
// one of them
//   had no weight before and lies near now.
int fuse_distances(const std::int16_t* distances, const std::uint16_t* weights, std::uint16_t max_weight,
                   std::int16_t* sdf, std::uint16_t* weight_sum, std::uint16_t near = 0,
                   std::uint16_t* moved = nullptr);

// Free space only: as fuse_distances over the voxels that are kFree, and of those only the ones with weight >
// 0 and sdf < kFree; each reading counts `times` times. Returns the least |sdf| over all voxels with weight
// afterwards (kFree when there is none), or -1 when nothing changed.
int carve_distances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                    std::uint16_t max_weight, std::int16_t* sdf, std::uint16_t* weight_sum);

// What the functions above specify, one lane at a time.
namespace scalar {
Observation observe_chunk(const DepthProjection& frame, const ProjectedChunk& chunk, std::int16_t* distances,
                          std::uint16_t* weights, const void* ahead = nullptr);
Observation observe_groups(const DepthProjection& frame, const ProjectedChunk& chunk,
                           std::int16_t* distances);
int fuse_distances(const std::int16_t* distances, const std::uint16_t* weights, std::uint16_t max_weight,
                   std::int16_t* sdf, std::uint16_t* weight_sum, std::uint16_t near = 0,
                   std::uint16_t* moved = nullptr);
int carve_distances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                    std::uint16_t max_weight, std::int16_t* sdf, std::uint16_t* weight_sum);
}  // namespace scalar

}  // namespace burin::simd
