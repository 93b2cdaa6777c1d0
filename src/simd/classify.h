// SPDX-License-Identifier: MIT
// Kernel of marching cubes: voxels of a chunk to bits.
#pragma once

#include <cstdint>

namespace burin::simd {

struct CellLimits {
    std::uint16_t min_weight;  // >= 1: voxels with less are unknown
    std::int16_t deep, high;   // <= 0, >= -1
};

// Bit 8 * y + x of word z for voxel (x, y, z) of a chunk.
struct ChunkBits {
    alignas(64) std::uint64_t known[8];   // weight >= min_weight
    alignas(64) std::uint64_t inside[8];  // sdf < 0
    alignas(64) std::uint64_t deep[8];    // sdf < deep
    alignas(64) std::uint64_t high[8];    // sdf > high
};

// The words of the first `planes` (1 to 8) planes of a chunk; the others are left as they are.
void classify_chunk(const std::int16_t* sdf, const std::uint16_t* weight, int planes, CellLimits limits,
                    ChunkBits* bits);

namespace scalar {
void classify_chunk(const std::int16_t* sdf, const std::uint16_t* weight, int planes, CellLimits limits,
                    ChunkBits* bits);
}

}  // namespace burin::simd
