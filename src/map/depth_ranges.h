// SPDX-License-Identifier: MIT
// The range of depth over any rectangle of pixels in four look-ups: ranges over squares of 1, 2, 4 and 8 tiles
// that begin at every tile, so that two by two of them cover a rectangle.
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
    // wider by the rest of the tiles, and is the whole image's for more than 64 pixels a side. largest == 0: no
    // pixel there is valid.
    DepthRange over(int x0, int y0, int x1, int y1) const;

    DepthRange all() const { return all_; }  // of the whole image

  private:
    static constexpr int kLevels = 4;
    static constexpr int kReach = 1 << (kLevels - 1);  // the largest square, tiles

    std::uint16_t* least_[kLevels] = {};
    std::uint16_t* largest_[kLevels] = {};
    int width_ = 0, height_ = 0, stride_ = 0;  // tiles
    DepthRange all_{0, 0};
};

}  // namespace burin
