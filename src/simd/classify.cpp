// SPDX-License-Identifier: MIT
#include "simd/classify.h"

namespace burin::simd {

namespace scalar {

void classify_chunk(const std::int16_t* sdf, const std::uint16_t* weight, int planes, CellLimits limits,
                    ChunkBits* bits) {
    for (int z = 0; z < planes; ++z) {
        std::uint64_t known = 0, inside = 0, deep = 0, high = 0;
        for (int i = 0; i < 64; ++i) {
            const int v = 64 * z + i;
            known |= std::uint64_t{weight[v] >= limits.min_weight} << i;
            inside |= std::uint64_t{sdf[v] < 0} << i;
            deep |= std::uint64_t{sdf[v] < limits.deep} << i;
            high |= std::uint64_t{sdf[v] > limits.high} << i;
        }
        bits->known[z] = known;
        bits->inside[z] = inside;
        bits->deep[z] = deep;
        bits->high[z] = high;
    }
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
void classify_chunk(const std::int16_t* sdf, const std::uint16_t* weight, int planes, CellLimits limits,
                    ChunkBits* bits) {
    scalar::classify_chunk(sdf, weight, planes, limits, bits);
}
#endif

}  // namespace burin::simd
