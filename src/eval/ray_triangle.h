// SPDX-License-Identifier: MIT
// Which side of each edge of a triangle a ray passes on, without gaps between neighbours (Woop, Benthin &
// Wald, "Watertight ray/triangle intersection", JCGT 2013).
#pragma once

#include "core/vec.h"

namespace burin {

// A corner moved along the ray into a plane across it, the ray at the origin.
struct Sheared {
    double x = 0, y = 0;
};

// Twice the signed areas opposite the corners a, b, c; divided by their sum they are the weights of the
// corners. Rounding is monotonic: fl(p) - fl(q) is never positive when p < q. So an area may come out as
// zero, but with the wrong sign never, and triangles that share corners agree on where the ray passes.
struct EdgeAreas {
    double a = 0, b = 0, c = 0;

    EdgeAreas(Sheared pa, Sheared pb, Sheared pc)
        : a(pb.x * pc.y - pb.y * pc.x), b(pc.x * pa.y - pc.y * pa.x), c(pa.x * pb.y - pa.y * pb.x) {}

    // Inside or on the border, whichever way the triangle is wound.
    bool inside() const { return !((a < 0 || b < 0 || c < 0) && (a > 0 || b > 0 || c > 0)); }
    double sum() const { return a + b + c; }
};

}  // namespace burin
