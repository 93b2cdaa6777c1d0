// SPDX-License-Identifier: MIT
// The range of depth over any rectangle of pixels in four look-ups: ranges over squares of 1, 2, 4 and 8
// tiles that begin at every tile, so that two by two of them cover a rectangle.
#pragma once

#include <cstdint>

#include "core/arena.h"
#include "depth/depth_image.h"

namespace burin {

class DepthRanges {
  public:
    // Largest image that will come.
    void place(Arena& arena, int max_width, int max_height);
    void build(const DepthTiles& tiles);

    // A range that holds every valid depth in the pixels [x0, x1] x [y0, y1], clipped to the image; it may be
    // wider by the rest of the tiles, and is the whole image's for more than 64 pixels a side. largest == 0:
    // no pixel there is valid.
    DepthRange over(int x0, int y0, int x1, int y1) const;

    DepthRange all() const { return all_; }  // of the whole image

  private:
    static constexpr int kLevels = 4;                  // squares of 4, 8, 16 and 32 pixels
    static constexpr int kReach = 1 << (kLevels - 1);  // the largest square, tiles

    // The square that begins at tile (x, y) at y * stride_ + x: the least depth, 65535 where there is none,
    // and 65535 - largest in the upper half. So both are joined by minima.
    std::uint32_t* squares_[kLevels] = {};
    int width_ = 0, height_ = 0, stride_ = 0;  // tiles
    DepthRange all_{0, 0};
};

}  // namespace burin
