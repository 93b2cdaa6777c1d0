// SPDX-License-Identifier: MIT
// The brightness of a colour frame in blocks, and of the points of a depth image: what colour tells the
// tracker.
#pragma once

#include "capture/frame.h"
#include "core/arena.h"
#include "core/jobs.h"
#include "track/track_points.h"

namespace burin {

// BT.601 of 8-bit sRGB values, in units of 1/256.
inline int luma_256(int red, int green, int blue) { return 77 * red + 150 * green + 29 * blue; }

// Luma (BT.601) of sRGB values, 0 .. 255, averaged over blocks of TrackPoints::block_side of the colour
// image. It is not linearised: gain and bias are fitted from frame to frame, and in sRGB the noise is about
// the same at every brightness.
class GreyImage {
  public:
    void place(Arena& arena);
    // False when the frame has no colour.
    bool build(const FrameView& frame, Jobs& jobs);
    // At a pixel of the colour image, bilinear between block centres; negative beside the image.
    float at(double u, double v) const;

  private:
    int width_ = 0, height_ = 0, side_ = 1;
    float* blocks_ = nullptr;
};

// Brightness at the grids of TrackPoints, -1 where there is no point or the colour camera does not see it.
class PointBrightness {
  public:
    void place(Arena& arena);
    void build(const TrackPoints& points, const GreyImage& grey, const FrameView& frame, Jobs& jobs);
    const float* grid(int level) const { return grids_[level]; }

  private:
    float* grids_[TrackPoints::kLevels] = {};
};

}  // namespace burin
