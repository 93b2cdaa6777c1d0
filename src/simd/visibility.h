// SPDX-License-Identifier: MIT
// Kernels of choosing chunks: where the corners of chunks fall in the image, and the range of depth over any
// rectangle of tiles.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin::simd {

// The projective coordinates (see ProjectiveOffsets) of chunk (x, y, z), relative to some chunk near the
// camera: those of its voxel 0 are ((x * step[0] + y * step[1]) + z * step[2]) + origin.
struct ChunkProjection {
    float origin_u, origin_v, origin_z;
    float step_u[3], step_v[3], step_z[3];
    float corner_u[8], corner_v[8], corner_z[8];    // of the eight voxels in the corners, relative to voxel 0
    float voxel_u[3], voxel_v[3], voxel_z[3];       // a step of one voxel along x, y, z
    float centre_u, centre_v, most_across, most_z;  // as in GroupOffsets
};

inline constexpr int kBatchChunks = 16;
struct ChunkBatch {
    alignas(64) std::int32_t x[kBatchChunks], y[kBatchChunks], z[kBatchChunks];  // in
    // out: voxel 0, and the box around the corners: pixels of the bordered image, and depths
    alignas(64) float base_u[kBatchChunks], base_v[kBatchChunks], base_z[kBatchChunks];
    alignas(64) float least_u[kBatchChunks], most_u[kBatchChunks];
    alignas(64) float least_v[kBatchChunks], most_v[kBatchChunks];
    alignas(64) float least_z[kBatchChunks], most_z[kBatchChunks];
    // No voxel of a group of 4x4x2 falls farther from the group's middle, pixels in u or in v, nor by one of
    // the terms of GroupOffsets alone.
    alignas(64) float group_reach[kBatchChunks];
};
// The reach of a group: from a point at pixel u, a step of k voxels along x leads k (Ux - u Zx) / (Z + k Zx)
// pixels away, (Ux, Zx) the projective coordinates of one voxel along x; u within the box bounds the
// numerator, least_z the denominator. For all kBatchChunks chunks (give the unused ones any coordinates).
// Pixels mean nothing where least_z is not above 0. |x|, |y|, |z| < 2^20.
void project_chunks(const ChunkProjection& projection, ChunkBatch* batch);

// Joins ranges (two 16-bit minima each) of squares of `side` tiles to squares of twice the
// side, over a plane of `count` values in rows of `stride`: to[i] = from[i], from[i + side], from[i + down]
// and from[i + side + down] joined, down = side * stride. At the end of a row that takes in the beginning of
// another: the caller leaves room there. count: a multiple of 16; from has count + side + down values.
void double_ranges(const std::uint32_t* from, int count, int stride, int side, std::uint32_t* to);

namespace scalar {
void project_chunks(const ChunkProjection& projection, ChunkBatch* batch);
void double_ranges(const std::uint32_t* from, int count, int stride, int side, std::uint32_t* to);
}  // namespace scalar

}  // namespace burin::simd
