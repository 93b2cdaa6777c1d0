// SPDX-License-Identifier: MIT
// The size of the pictures of an MP4 or QuickTime file, from its headers alone: what the intrinsics of Stray
// Scanner belong to, also where no video library is at hand.
#pragma once

#include "datasets/random_file.h"

namespace burin {

struct PictureSize {
    int width = 0, height = 0;
};
// The first track with a size (ISO/IEC 14496-12: boxes of u32 size, four letters and content; moov, trak,
// tkhd, whose last two fields are 16.16 fixed-point width and height). Error (format): none found, a box that
// runs past its parent.
Result<PictureSize> mp4_picture_size(const RandomFile& file);

}  // namespace burin
