// SPDX-License-Identifier: MIT
// What goes wrong in front of a depth camera, done to recorded frames: the lens covered, a hand before it,
// readings missing.
#pragma once

#include "capture/frame.h"

namespace burin::bench {

struct Span {
    int first = 0, last = 0;  // frames of the data set, half open
    bool empty() const { return first >= last; }
    bool has(int index) const { return index >= first && index < last; }
};

struct Disturbance {
    Span blank;          // neither depth nor colour
    Span hand;           // a surface 0.3 m away over four fifths of the image
    double dropout = 0;  // share of the depth pixels without a reading, in every frame
    int skip = 1;        // only every skip-th frame is tracked: a camera that moves so much faster

    bool any() const { return !blank.empty() || !hand.empty() || dropout > 0 || skip > 1; }
    // From the first disturbed frame to behind the last one. Of a dropout or a fast camera: all frames.
    Span span() const;
};

void disturb(const Disturbance& disturbance, int index, Frame* frame);

}  // namespace burin::bench
