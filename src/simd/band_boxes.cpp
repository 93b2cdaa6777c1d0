// SPDX-License-Identifier: MIT
#include "simd/band_boxes.h"

#include <algorithm>

namespace burin::simd {

namespace scalar {

void band_boxes(const BandView& view, const float* u, const float* v, const std::uint32_t* ranges, int count,
                ChunkBox* boxes) {
    for (int i = 0; i < count; ++i) {
        const float least_m = static_cast<float>(ranges[i] & 0xffff) * view.unit_m,
                    largest_m = static_cast<float>(ranges[i] >> 16) * view.unit_m;
        const float tau = view.truncation.at(largest_m);
        const float near = std::max(least_m - tau, 0.0f), far = largest_m + tau;
        ChunkBox& box = boxes[i];
        box = {};
        for (int r = 0; r < 3; ++r) {
            const float slope = (view.slope_u[r] * u[i] + view.slope_v[r] * v[i]) + view.slope_1[r];
            const float left = slope - view.half_slope[r], right = slope + view.half_slope[r];
            const float low = std::min(near * left, far * left) + view.start_low[r];
            const float high = std::max(near * right, far * right) + view.start_high[r];
            box.low[r] = static_cast<std::uint16_t>(std::min(std::max(low, 0.0f), 65535.0f));
            box.high[r] = static_cast<std::uint16_t>(std::min(std::max(high, 0.0f), 65535.0f));
        }
        box.kind = ranges[i] == 0                      ? ChunkBox::kNone
                   : largest_m - least_m > view.deep_m ? ChunkBox::kDeep
                                                       : ChunkBox::kBox;
    }
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
void band_boxes(const BandView& view, const float* u, const float* v, const std::uint32_t* ranges, int count,
                ChunkBox* boxes) {
    scalar::band_boxes(view, u, v, ranges, count, boxes);
}
#endif

}  // namespace burin::simd
