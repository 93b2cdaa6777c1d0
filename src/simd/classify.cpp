// SPDX-License-Identifier: MIT
#include "simd/classify.h"

namespace burin::simd {

namespace scalar {

void classify_rows(const std::int16_t* sdf, const std::uint16_t* weight, int first, int step, int count,
                   std::uint16_t min_weight, std::uint8_t* known, std::uint8_t* inside) {
    for (int i = 0; i < count; ++i) {
        const int row = 8 * (first + i * step);
        unsigned k = 0, s = 0;
        for (int x = 0; x < 8; ++x) {
            k |= static_cast<unsigned>(weight[row + x] >= min_weight) << x;
            s |= static_cast<unsigned>(sdf[row + x] < 0) << x;
        }
        known[i] = static_cast<std::uint8_t>(k);
        inside[i] = static_cast<std::uint8_t>(s);
    }
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
void classify_rows(const std::int16_t* sdf, const std::uint16_t* weight, int first, int step, int count,
                   std::uint16_t min_weight, std::uint8_t* known, std::uint8_t* inside) {
    scalar::classify_rows(sdf, weight, first, step, count, min_weight, known, inside);
}
#endif

}  // namespace burin::simd
