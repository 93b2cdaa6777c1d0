// SPDX-License-Identifier: MIT
// Where a plane lies against gravity and how far it reaches: what rules about rooms and furniture ask for.
#pragma once

#include <cstdint>

#include "planes/plane.h"

namespace burin {

enum class Facing : std::uint8_t { sloped, up, down, sideways };

// The box around a plane's outline. Its third axis is up; the first two are level: along a wall and out of
// it, or those of the smallest rectangle around a floor, a table top.
struct PlaneExtent {
    Facing facing = Facing::sloped;
    Vec3d axis[2];        // unit, level, perpendicular
    double low[3] = {};   // along axis[0], axis[1] and up, metres from the world's origin
    double high[3] = {};  //
    double reach(int i) const { return high[i] - low[i]; }
    double middle(int i) const { return 0.5 * (low[i] + high[i]); }
    double narrow() const { return reach(0) < reach(1) ? reach(0) : reach(1); }
    double wide() const { return reach(0) < reach(1) ? reach(1) : reach(0); }
};

struct Interval {
    double low, high;
};

// `up` is a unit vector. A plane without an outline, or with one that is not finite, is `sloped`: nothing can
// be said about it.
PlaneExtent extent_of(const PlaneShape& plane, Vec3d up);

// What the box covers along a level unit vector.
Interval cover(const PlaneExtent& extent, Vec3d level_axis);

// Length of what two intervals have in common, 0 when nothing.
double common(Interval a, Interval b);

// Seen from above: area of what both rectangles cover, measured in the axes of `a` (exact when they are
// parallel, else an upper bound), m^2.
double common_area(const PlaneExtent& a, const PlaneExtent& b);

}  // namespace burin
