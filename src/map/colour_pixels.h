// SPDX-License-Identifier: MIT
// Colour images other than RGB. The kernels read RGB; for other formats they find pixels in a packed RGB
// image that is not there, and the few pixels that voxels ask for are converted one by one: no copy of the
// image, no memory.
#pragma once

#include <cstddef>
#include <cstdint>

#include "capture/frame.h"
#include "simd/colour.h"

namespace burin {

// Stride (bytes) by which simd::find_pixels counts its offsets.
inline std::ptrdiff_t offsets_stride(const FrameView& frame) {
    return frame.colour_format == PixelFormat::rgb8 ? frame.colour.stride
                                                    : std::ptrdiff_t{3} * frame.colour.width;
}

// simd::fuse_colours for a frame of another format; the bits are those of the same image in RGB.
int fuse_other_format(const FrameView& frame, const std::uint16_t* list, int count,
                      const simd::ColourFrame& colour, const std::int32_t* offsets, std::uint8_t* colours);

// Pixels first, first + step, ... along one side of an image.
struct PixelSpan {
    int first, step, count;
};

// Adds red, green and blue over these columns and rows to `sum`; any format, also RGB.
void add_colours(const FrameView& frame, const PixelSpan& columns, const PixelSpan& rows,
                 std::uint32_t sum[3]);

}  // namespace burin
