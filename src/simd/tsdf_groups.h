// SPDX-License-Identifier: MIT
// Inside of observe_groups: what its specification and its vector form share.
#pragma once

#include <algorithm>

#include "core/rounding.h"
#include "simd/tsdf.h"

namespace burin::simd {

// A step of depth is whole + fraction / 32767 halves of stored units (halves: what is beyond the truncation
// still fits 16 bits); steps beyond +-limit lie beyond the truncation; a group's depth is +-slope.
struct GroupScale {
    float unit;       // stored units a step of depth, along z
    float half_unit;  // halves of them along the distances' direction
    int whole, fraction, limit, slope;

    GroupScale(const DepthProjection& frame, float along)
        : unit(frame.unit_m * frame.truncation.units_per_m()),
          half_unit(unit * 0.5f * along),
          whole(static_cast<int>(half_unit)),
          fraction(round_to_int(32767.0f * (half_unit - static_cast<float>(whole)))),
          limit(static_cast<int>(32767.0f /
                                 static_cast<float>(whole + 1))),  // exact, and no division of integers
          slope(round_to_int(frame.groups.most_z * 0.5f * along)) {}
};

// Pixels a window is wide, fraction bits of 16 below them, steps a pixel.
constexpr int window_side(Pixels pixels) { return pixels == Pixels::narrow ? 8 : 16; }
constexpr int pixel_bits(Pixels pixels) { return pixels == Pixels::narrow ? 13 : 12; }
constexpr float pixel_steps(Pixels pixels) { return pixels == Pixels::narrow ? 8192.0f : 4096.0f; }

}  // namespace burin::simd
