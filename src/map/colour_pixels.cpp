// SPDX-License-Identifier: MIT
#include "map/colour_pixels.h"

#include <algorithm>

namespace burin {
namespace {

std::uint8_t to_byte(int fixed) {
    return static_cast<std::uint8_t>(std::clamp((fixed + 32768) >> 16, 0, 255));
}

// ITU-R BT.601, as in JFIF 1.02 (Y of 0..255); coefficients times 65536.
void full_range(int y, int u, int v, std::uint8_t* rgb) {
    u -= 128;
    v -= 128;
    rgb[0] = to_byte(65536 * y + 91881 * v);
    rgb[1] = to_byte(65536 * y - 22554 * u - 46802 * v);
    rgb[2] = to_byte(65536 * y + 116130 * u);
}

// The same with Y of 16..235 and U, V of 16..240.
void video_range(int y, int u, int v, std::uint8_t* rgb) {
    y = 76309 * (y - 16);
    u -= 128;
    v -= 128;
    rgb[0] = to_byte(y + 104597 * v);
    rgb[1] = to_byte(y - 25675 * u - 53279 * v);
    rgb[2] = to_byte(y + 132201 * u);
}

void read_pixel(const FrameView& frame, int x, int y, std::uint8_t* rgb) {
    const View<const std::uint8_t>& colour = frame.colour;
    const std::uint8_t* row = colour.row(y);
    const std::uint8_t* p = row + colour.channels * x;
    switch (frame.colour_format) {
        case PixelFormat::rgb8:
        case PixelFormat::rgba8:
            std::copy_n(p, 3, rgb);
            return;
        case PixelFormat::bgr8:
        case PixelFormat::bgra8:
            std::reverse_copy(p, p + 3, rgb);
            return;
        case PixelFormat::grey8:
            std::fill_n(rgb, 3, *p);
            return;
        case PixelFormat::yuyv: {
            const std::uint8_t* pair = row + 4 * (x / 2);
            video_range(*p, pair[1], pair[3], rgb);
            return;
        }
        case PixelFormat::nv12:
        case PixelFormat::nv21: {
            const std::uint8_t* uv = frame.chroma.row(y / 2) + 2 * (x / 2);
            const bool swapped = frame.colour_format == PixelFormat::nv21;
            full_range(*p, uv[swapped], uv[!swapped], rgb);
            return;
        }
    }
}

}  // namespace

int fuse_other_format(const FrameView& frame, const std::uint16_t* list, int count,
                      const simd::ColourFrame& colour, const std::int32_t* offsets, std::uint8_t* colours) {
    alignas(64) std::uint8_t readings[simd::kChunkVoxels * 4];  // RGB and one byte that is not looked at
    alignas(64) std::int32_t places[simd::kChunkVoxels];
    const int whole = (count + 15) & ~15;
    for (int k = 0; k < whole; ++k) {
        places[k] = offsets[k] < 0 ? -1 : 4 * k;
        std::uint8_t* reading = readings + 4 * k;
        std::fill_n(reading, 4, std::uint8_t{0});
        const int pixel = offsets[k] / 3;
        if (offsets[k] >= 0)
            read_pixel(frame, pixel % frame.colour.width, pixel / frame.colour.width, reading);
    }
    simd::ColourFrame here = colour;
    here.rgb = readings;
    return simd::fuse_colours(list, count, here, places, colours);
}

}  // namespace burin
