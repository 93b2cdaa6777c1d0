// SPDX-License-Identifier: MIT
// Kernel of marking: the boxes of chunks around pieces of a truncated view frustum.
#pragma once

#include <cstdint>

#include "simd/tsdf.h"

namespace burin::simd {

// A frame's view in units of chunks. A point at depth z on the ray of pixel (u, v) lies at
// z * ((slope_u u + slope_v v) + slope_1) along each axis, from the camera.
struct BandView {
    float slope_u[3], slope_v[3], slope_1[3];  // chunks a metre of depth
    float half_slope[3];  // to either side of the middle of a piece (a tile or a pixel), rounding included
    float start_low[3],
        start_high[3];  // added to the low and high ends of a box before they are rounded down
    float unit_m;       // a step of the depth image
    float deep_m;       // pieces deeper than this are not boxed
    TruncationModel truncation;
};

// From chunk `low` to chunk `high`, inclusive.
struct ChunkBox {
    enum Kind : std::uint16_t {
        kNone = 0,  // no depth
        kBox = 1,
        kDeep = 2  // deeper than deep_m: mostly air; the box holds all of it
    };
    std::uint16_t low[3], kind, high[3], unused;
};

// boxes[i] for the piece around pixel (u[i], v[i]) with depths ranges[i] = least | largest << 16, both 0
// where there is none: near = least - tau(largest), not below 0, far = largest + tau(largest). Ends are
// clipped to 0..65535. u, v, ranges and boxes have room for `count` rounded up to 16.
void band_boxes(const BandView& view, const float* u, const float* v, const std::uint32_t* ranges, int count,
                ChunkBox* boxes);

namespace scalar {
void band_boxes(const BandView& view, const float* u, const float* v, const std::uint32_t* ranges, int count,
                ChunkBox* boxes);
}

}  // namespace burin::simd
