// SPDX-License-Identifier: MIT
#include "simd/sample.h"

#include <limits>

namespace burin::simd {
namespace scalar {

void locate_cells(const LatticeMap& map, const float* x, const float* y, const float* z, int count,
                  Cells* cells) {
    for (int i = 0; i < count; ++i) {
        bool inside = true;
        for (int k = 0; k < 3; ++k) {
            const float* m = map.m + 3 * k;
            const float at = m[0] * x[i] + m[1] * y[i] + m[2] * z[i] + map.offset[k];
            const bool near = at > -kLatticeLimit && at < kLatticeLimit;  // NaN is not
            const float v = near ? at : 0.0f;
            int floor = static_cast<int>(v);
            if (static_cast<float>(floor) > v) --floor;
            cells->v[k][i] = floor;
            cells->t[k][i] = v - static_cast<float>(floor);
            inside &= near;
        }
        if (!inside) cells->v[0][i] = kNoCell;
    }
}

void interpolate_cells(const Corners& corners, const float (*t)[kSampleBatch], int count, SampleScale scale,
                       float* distances, float (*gradients)[kSampleBatch]) {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    for (int i = 0; i < count; ++i) {
        float d[8];
        bool known = true;
        for (int row = 0; row < 4; ++row) {
            const std::uint32_t sdf = corners.sdf[row][i], weight = corners.weight[row][i];
            d[2 * row] = static_cast<float>(static_cast<std::int16_t>(sdf & 0xffff));
            d[2 * row + 1] = static_cast<float>(static_cast<std::int16_t>(sdf >> 16));
            known &= (weight & 0xffff) != 0 && weight >> 16 != 0;
        }
        const Trilinear at = trilinear(d, t[0][i], t[1][i], t[2][i]);
        distances[i] = known ? scale.distance * at.value : kNone;
        if (!gradients) continue;
        for (int k = 0; k < 3; ++k) gradients[k][i] = known ? scale.gradient * at.gradient[k] : kNone;
    }
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
void locate_cells(const LatticeMap& map, const float* x, const float* y, const float* z, int count,
                  Cells* cells) {
    scalar::locate_cells(map, x, y, z, count, cells);
}
void interpolate_cells(const Corners& corners, const float (*t)[kSampleBatch], int count, SampleScale scale,
                       float* distances, float (*gradients)[kSampleBatch]) {
    scalar::interpolate_cells(corners, t, count, scale, distances, gradients);
}
#endif

}  // namespace burin::simd
