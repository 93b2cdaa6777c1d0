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

template <PixelFormat kFormat>
void read_pixel(const FrameView& frame, int x, int y, std::uint8_t* rgb) {
    const std::uint8_t* row = frame.colour.row(y);
    if constexpr (kFormat == PixelFormat::bgr8 || kFormat == PixelFormat::bgra8) {
        const std::uint8_t* p = row + (kFormat == PixelFormat::bgr8 ? 3 : 4) * x;
        rgb[0] = p[2], rgb[1] = p[1], rgb[2] = p[0];
    } else if constexpr (kFormat == PixelFormat::rgba8) {
        std::copy_n(row + 4 * x, 3, rgb);
    } else if constexpr (kFormat == PixelFormat::grey8) {
        rgb[0] = rgb[1] = rgb[2] = row[x];
    } else if constexpr (kFormat == PixelFormat::yuyv) {
        const std::uint8_t* pair = row + 4 * (x / 2);
        video_range(row[2 * x], pair[1], pair[3], rgb);
    } else {
        const std::uint8_t* uv = frame.chroma.row(y / 2) + 2 * (x / 2);
        constexpr bool kSwapped = kFormat == PixelFormat::nv21;
        full_range(row[x], uv[kSwapped], uv[!kSwapped], rgb);
    }
}

// For each offset >= 0 its pixel, four bytes each.
template <PixelFormat kFormat>
void read_pixels(const FrameView& frame, int count, const std::int32_t* offsets, std::uint8_t* readings) {
    // A multiplication in double precision: below 2^28 pixels the half keeps it on the right side of every
    // row's end.
    const double rows_per_pixel = 1.0 / frame.colour.width;
    for (int k = 0; k < count; ++k) {
        if (offsets[k] < 0) continue;
        const int pixel = offsets[k] / 3;
        const int y = static_cast<int>((pixel + 0.5) * rows_per_pixel);
        read_pixel<kFormat>(frame, pixel - y * frame.colour.width, y, readings + 4 * k);
    }
}

using Reader = void (*)(const FrameView& frame, int count, const std::int32_t* offsets,
                        std::uint8_t* readings);
// By PixelFormat, without the first, which needs none.
constexpr Reader kReaders[] = {
    nullptr,
    read_pixels<PixelFormat::bgr8>,
    read_pixels<PixelFormat::rgba8>,
    read_pixels<PixelFormat::bgra8>,
    read_pixels<PixelFormat::grey8>,
    read_pixels<PixelFormat::yuyv>,
    read_pixels<PixelFormat::nv12>,
    read_pixels<PixelFormat::nv21>,
};

// Bytes from pixel to pixel and to red, green and blue, by PixelFormat: all but the last three, which have
// luminance and chroma.
struct Packing {
    int pixel, red, green, blue;
};
constexpr Packing kPackings[] = {{3, 0, 1, 2}, {3, 2, 1, 0}, {4, 0, 1, 2}, {4, 2, 1, 0}, {1, 0, 0, 0}};
constexpr int kPacked = sizeof kPackings / sizeof kPackings[0];

using PixelReader = void (*)(const FrameView& frame, int x, int y, std::uint8_t* rgb);
constexpr PixelReader kPixelReaders[] = {
    read_pixel<PixelFormat::yuyv>,
    read_pixel<PixelFormat::nv12>,
    read_pixel<PixelFormat::nv21>,
};

}  // namespace

// One loop for the packed formats and a call a pixel for the others: a loop for each takes 18 KB of code.
void add_colours(const FrameView& frame, const PixelSpan& columns, const PixelSpan& rows,
                 std::uint32_t sum[3]) {
    const int format = static_cast<int>(frame.colour_format);
    const Packing packing = format < kPacked ? kPackings[format] : Packing{};
    const PixelReader read = format < kPacked ? nullptr : kPixelReaders[format - kPacked];
    std::uint32_t r = 0, g = 0, b = 0;
    for (int j = 0; j < rows.count; ++j) {
        const int y = rows.first + j * rows.step;
        const std::uint8_t* row = frame.colour.row(y);
        for (int i = 0; i < columns.count; ++i) {
            const int x = columns.first + i * columns.step;
            if (read) {
                std::uint8_t rgb[3];
                read(frame, x, y, rgb);
                r += rgb[0], g += rgb[1], b += rgb[2];
            } else {
                const std::uint8_t* p = row + std::ptrdiff_t{x} * packing.pixel;
                r += p[packing.red], g += p[packing.green], b += p[packing.blue];
            }
        }
    }
    sum[0] += r, sum[1] += g, sum[2] += b;
}

int fuse_other_format(const FrameView& frame, const std::uint16_t* list, int count,
                      const simd::ColourFrame& colour, const std::int32_t* offsets, std::uint8_t* colours) {
    alignas(64) std::uint8_t readings[simd::kChunkVoxels * 4] = {};  // RGB and one byte that is not looked at
    alignas(64) std::int32_t places[simd::kChunkVoxels];
    const int whole = (count + 15) & ~15;
    kReaders[static_cast<int>(frame.colour_format)](frame, whole, offsets, readings);
    for (int k = 0; k < whole; ++k) places[k] = offsets[k] < 0 ? -1 : 4 * k;
    simd::ColourFrame here = colour;
    here.rgb = readings;
    return simd::fuse_colours(list, count, here, places, colours);
}

}  // namespace burin
