// SPDX-License-Identifier: MIT
// A frame as small as a stamp: what keyframe ferns look at.
#pragma once

#include <cstdint>

#include "capture/frame.h"
#include "depth/depth_image.h"

namespace burin {

// 40 x 30 cells, the size of Glocker et al. (TVCG 2015, section 3). 6 KB.
struct Thumbnail {
    static constexpr int kWidth = 40, kHeight = 30, kCells = kWidth * kHeight;
    std::uint16_t depth_mm[kCells];  // 0: none
    std::uint8_t rgb[3 * kCells];    // 0 when there is no colour
    bool has_colour;
};

// Each image by itself is divided into 40 x 30 blocks, and a cell is the mean over its block, which is the
// blur. Depth and colour may thus be of two cameras: a cell of one need not look where that of the other
// does, as long as it does so in every frame. Only valid depth counts; a block with less than a quarter of it
// has none. `image` is that of the frame, from DepthStage::prepare. Large blocks are sampled.
Thumbnail make_thumbnail(const DepthImage& image, const FrameView& frame);

}  // namespace burin
