// SPDX-License-Identifier: MIT
// Kernel of marching cubes: rows of voxels to rows of bits.
#pragma once

#include <cstdint>

namespace burin::simd {

// For each of `count` rows of 8 voxels, the first at sdf/weight + 8 * first, each next one 8 * step voxels
// on:
//   known[i] bit x = weight >= min_weight;  inside[i] bit x = sdf < 0.
// count <= 64; min_weight >= 1.
void classify_rows(const std::int16_t* sdf, const std::uint16_t* weight, int first, int step, int count,
                   std::uint16_t min_weight, std::uint8_t* known, std::uint8_t* inside);

namespace scalar {
void classify_rows(const std::int16_t* sdf, const std::uint16_t* weight, int first, int step, int count,
                   std::uint16_t min_weight, std::uint8_t* known, std::uint8_t* inside);
}

}  // namespace burin::simd
