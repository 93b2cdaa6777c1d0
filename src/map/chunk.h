// SPDX-License-Identifier: MIT
// A chunk is 8 x 8 x 8 voxels. Voxel (x, y, z) of the world lattice has its centre at ((x, y, z) + 1/2) *
// voxel_m and belongs to chunk (x >> 3, y >> 3, z >> 3). Inside a chunk, voxel i lies at (i & 7, i >> 3 & 7,
// i >> 6).
#pragma once

#include <cmath>
#include <cstdint>

#include "core/vec.h"

namespace burin {

inline constexpr int kChunkSide = 8;
inline constexpr int kChunkVoxels = 512;

// Half of a page each (design, promise 2): geometry streams alone.
struct ChunkGeometry {
    std::int16_t sdf[kChunkVoxels];      // signed distance in units of truncation / 32767, + in free space
    std::uint16_t weight[kChunkVoxels];  // 0: never observed; in units of 1/64 observation
};
struct ChunkColour {
    std::uint8_t rgbn[kChunkVoxels][4];  // red, green, blue, number of readings
};
static_assert(sizeof(ChunkGeometry) == 2048 && sizeof(ChunkColour) == 2048);

// Chunk coordinates packed in 63 bits, z most significant, each offset by 2^20: keys sort like (z, y, x).
// 0 is no key.
using ChunkKey = std::uint64_t;
inline constexpr std::int32_t kChunkLimit = 1 << 20;  // |coordinate| below this: 41 km at 5 mm voxels

inline bool chunk_in_range(Vec3i c) {
    return c.x > -kChunkLimit && c.x < kChunkLimit && c.y > -kChunkLimit && c.y < kChunkLimit &&
           c.z > -kChunkLimit && c.z < kChunkLimit;
}
inline ChunkKey pack_key(Vec3i c) {
    return static_cast<ChunkKey>(c.z + kChunkLimit) << 42 | static_cast<ChunkKey>(c.y + kChunkLimit) << 21 |
           static_cast<ChunkKey>(c.x + kChunkLimit);
}
inline Vec3i unpack_key(ChunkKey key) {
    const auto field = [key](int shift) {
        return static_cast<std::int32_t>(key >> shift & ((1u << 21) - 1)) - kChunkLimit;
    };
    return {field(0), field(21), field(42)};
}

// The voxel that holds a point, both in range; false where the lattice ends or the point is no number.
inline bool voxel_at(Vec3d x, double voxel_m, Vec3i* voxel) {
    for (int r = 0; r < 3; ++r) {
        const double lattice = std::floor(x[r] / voxel_m);
        if (!(std::fabs(lattice) < 1.0 * kChunkSide * (kChunkLimit - 1))) return false;
        (*voxel)[r] = static_cast<std::int32_t>(lattice);
    }
    return true;
}
inline Vec3i chunk_of_voxel(Vec3i v) { return {v.x >> 3, v.y >> 3, v.z >> 3}; }
// Index within its chunk of a voxel.
inline int voxel_index(Vec3i v) { return (v.z & 7) << 6 | (v.y & 7) << 3 | (v.x & 7); }

}  // namespace burin
