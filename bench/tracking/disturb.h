// SPDX-License-Identifier: MIT
// What goes wrong in front of a depth camera, done to recorded frames: the lens covered, a hand before it,
// readings missing, nothing but one plane in sight.
#pragma once

#include "capture/frame.h"

namespace burin::bench {

struct Span {
    int first = 0, last = 0;  // steps of the run, half open: TrackedFrame::step
    bool empty() const { return first >= last; }
    bool has(int step) const { return step >= first && step < last; }
};

struct Disturbance {
    Span blank;          // neither depth nor colour
    Span hand;           // a surface 0.3 m away over four fifths of the image
    Span plane;          // only the readings of the largest plane, and no colour
    double dropout = 0;  // share of the depth pixels without a reading, in every frame
    int skip = 1;        // only every skip-th frame is tracked: a camera that moves so much faster

    bool any() const { return !blank.empty() || !hand.empty() || !plane.empty() || dropout > 0 || skip > 1; }
    // From the first disturbed frame to behind the last one. Of a dropout, a fast camera or nothing: all
    // frames.
    Span span() const;
};

void disturb(const Disturbance& disturbance, int step, Frame* frame);

}  // namespace burin::bench
