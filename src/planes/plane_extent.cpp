// SPDX-License-Identifier: MIT
#include "planes/plane_extent.h"

namespace burin {
namespace {

// A plane is level within 15 degrees and upright within 15: fits are good to 1 degree and an estimated
// direction of gravity to a few, a chair's back leans by 6, while ramps and stairs' slopes start at 20.
constexpr double kLevel = 0.9659;    // cos 15 degrees
constexpr double kUpright = 0.2588;  // sin 15 degrees

// A turn of 5 degrees: the rectangle found is at most 2.5 degrees off, 4 % too wide for a square.
constexpr double kCos5 = 0.99619469809174555, kSin5 = 0.08715574274765817;
constexpr int kTurns = 18;  // of 5 degrees make 90, after which the axes repeat

Interval span(const PlaneShape& plane, Vec3d axis) {
    Interval s{1e300, -1e300};
    for (int i = 0; i < plane.outline_count; ++i) {
        const double t = dot(axis, to_double(plane.outline[i]));
        if (!(t > -1e30 && t < 1e30)) return {0, -1};  // not finite
        if (t < s.low) s.low = t;
        if (t > s.high) s.high = t;
    }
    return s;
}

}  // namespace

PlaneExtent extent_of(const PlaneShape& plane, Vec3d up) {
    PlaneExtent e;
    const double rise = dot(plane.normal, up);
    const Interval height = span(plane, up);
    if (!(height.low <= height.high) || !(rise >= -1.001 && rise <= 1.001)) return e;
    e.low[2] = height.low;
    e.high[2] = height.high;
    const auto lay = [&](Vec3d first) {
        e.axis[0] = first;
        e.axis[1] = cross(up, first);
        for (int i = 0; i < 2; ++i) {
            const Interval s = span(plane, e.axis[i]);
            e.low[i] = s.low;
            e.high[i] = s.high;
        }
        return e.reach(0) * e.reach(1);
    };
    if (std::fabs(rise) <= kUpright) {
        e.facing = Facing::sideways;
        lay(normalised(cross(plane.normal, up)));
        return e;
    }
    if (std::fabs(rise) < kLevel) return e;
    e.facing = rise > 0 ? Facing::up : Facing::down;
    // Any level vector to start from: the world axis that is least along up, without its part along up.
    int least = 0;
    for (int i = 1; i < 3; ++i)
        if (std::fabs(up[i]) < std::fabs(up[least])) least = i;
    Vec3d start;
    start[least] = 1;
    Vec3d axis = normalised(start - up * dot(start, up)), best = axis;
    double smallest = 1e300;
    for (int i = 0; i < kTurns; ++i) {
        const double area = lay(axis);
        if (area < smallest) {
            smallest = area;
            best = axis;
        }
        axis = axis * kCos5 + cross(up, axis) * kSin5;
    }
    lay(best);
    return e;
}

Interval cover(const PlaneExtent& extent, Vec3d level_axis) {
    Interval s{0, 0};
    for (int i = 0; i < 2; ++i) {
        const double c = dot(extent.axis[i], level_axis);
        s.low += c * (c > 0 ? extent.low[i] : extent.high[i]);
        s.high += c * (c > 0 ? extent.high[i] : extent.low[i]);
    }
    return s;
}

double common(Interval a, Interval b) {
    const double low = a.low > b.low ? a.low : b.low, high = a.high < b.high ? a.high : b.high;
    return high > low ? high - low : 0;
}

double common_area(const PlaneExtent& a, const PlaneExtent& b) {
    double area = 1;
    for (int i = 0; i < 2; ++i) area *= common({a.low[i], a.high[i]}, cover(b, a.axis[i]));
    return area;
}

}  // namespace burin
