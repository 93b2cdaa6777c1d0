// SPDX-License-Identifier: MIT
// Kernels of trilinear sampling: points to cells of the voxel lattice, and cells to distance and gradient.
// Which voxels a cell reads is between the two, and the caller's business (map/sample_batch.h).
#pragma once

#include <cstdint>

namespace burin::simd {

// Points a batch: some 4 KiB in all, which stay in L1, and enough loads in flight to hide each other.
inline constexpr int kSampleBatch = 64;

// Lattice coordinates: voxel centres lie at integers, relative to some voxel. v = m p + offset, row-major.
struct LatticeMap {
    float m[9];
    float offset[3];
};

// Where points lie: between voxel `v` and v + (1, 1, 1), at `t` in 0..1 from the first to the second.
struct Cells {
    alignas(64) std::int32_t v[3][kSampleBatch];
    alignas(64) float t[3][kSampleBatch];
};

// Coordinates beyond this, and NaN, are no cell: v[0] = kNoCell. At 2^20 voxels a float still tells eighths
// apart; choose the origin near the points (64 m of 5 mm voxels leave 1/1024).
inline constexpr float kLatticeLimit = 1048576.0f;
inline constexpr std::int32_t kNoCell = -2147483647 - 1;

// v = floor(m p + offset), t = m p + offset - v, for count <= kSampleBatch points. Products are summed from
// left to right.
void locate_cells(const LatticeMap& map, const float* x, const float* y, const float* z, int count,
                  Cells* cells);

// What the eight voxels of each cell hold: four rows (y, z) = (0, 0) (1, 0) (0, 1) (1, 1) of two voxels, x in
// the low half and x + 1 in the high half of 32 bits.
struct Corners {
    alignas(64) std::uint32_t sdf[4][kSampleBatch];     // int16
    alignas(64) std::uint32_t weight[4][kSampleBatch];  // uint16, 0: never observed
};

struct SampleScale {
    float distance;  // of one stored unit
    float gradient;  // of one stored unit a voxel
};

// The trilinear interpolant of d[x + 2 y + 4 z] at (x, y, z) in the unit cell, and its gradient: the one
// specification of reading the field.
struct Trilinear {
    float value, gradient[3];
};
inline Trilinear trilinear(const float d[8], float x, float y, float z) {
    const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
    const float y0 = mix(mix(d[0], d[1], x), mix(d[2], d[3], x), y);
    const float y1 = mix(mix(d[4], d[5], x), mix(d[6], d[7], x), y);
    return {mix(y0, y1, z),
            {mix(mix(d[1] - d[0], d[3] - d[2], y), mix(d[5] - d[4], d[7] - d[6], y), z),
             mix(mix(d[2] - d[0], d[3] - d[1], x), mix(d[6] - d[4], d[7] - d[5], x), z), y1 - y0}};
}

// distances[i] = scale.distance * value, gradients[k][i] = scale.gradient * gradient k; NaN where one of the
// eight weights is 0. `gradients` may be null. All arrays hold kSampleBatch: what lies behind `count` may be
// overwritten.
void interpolate_cells(const Corners& corners, const float (*t)[kSampleBatch], int count, SampleScale scale,
                       float* distances, float (*gradients)[kSampleBatch]);

// What the functions above specify, one lane at a time.
namespace scalar {
void locate_cells(const LatticeMap& map, const float* x, const float* y, const float* z, int count,
                  Cells* cells);
void interpolate_cells(const Corners& corners, const float (*t)[kSampleBatch], int count, SampleScale scale,
                       float* distances, float (*gradients)[kSampleBatch]);
}  // namespace scalar

}  // namespace burin::simd
