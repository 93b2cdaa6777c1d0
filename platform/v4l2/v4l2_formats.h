// SPDX-License-Identifier: MIT
// The pixel formats of V4L2 that we read: what each shows, and how it becomes what a stream delivers. Byte
// layouts: docs/capture_pixels.md; names: docs/v4l2.md.
#pragma once

#include <cstdint>

#include "capture/demosaic.h"
#include "capture/stream.h"
#include "simd/unpack.h"

namespace burin {

enum class V4l2Way : std::uint8_t {
    as_is,   // already as the stream delivers it: lent without a copy
    packed,  // one sample a pixel in a simd::Packing
    inzi,    // infrared and depth
    y8i,     // left and right infrared
    y12i,
    y16i,
    cnf4,  // confidence, 4 bits
    uyvy,
    mjpeg,
    bayer,  // one sample a pixel in a simd::Packing, a mosaic
};

struct V4l2Format {
    std::uint32_t code;  // of V4L2
    const char* name;    // in SourceOptions and StreamInfo
    StreamKind kind;     // grey formats: infrared, but depth when asked for by name
    V4l2Way way;
    StreamPixels pixels;
    PixelFormat colour = PixelFormat::rgb8;
    simd::Packing packing = simd::Packing::le16;
    BayerOrder order = BayerOrder::grbg;
    int bits = 16;  // of a sample
};

// Null: none that we read. Of several that a node offers the earlier in the table is the better.
const V4l2Format* find_v4l2_format(std::uint32_t code);
const V4l2Format* find_v4l2_format(const char* name);
// Place in the table: less is better.
int v4l2_format_rank(const V4l2Format& format);

// Grey words, which some sensors fill with depth.
inline bool may_be_depth(const V4l2Format& f) {
    return f.way == V4l2Way::packed || f.way == V4l2Way::bayer ||
           (f.way == V4l2Way::as_is && f.kind == StreamKind::infrared && f.pixels == StreamPixels::u16);
}

// Bytes of an image; MJPEG: 0, nobody knows. 64 bits hold any size V4L2 can name.
std::uint64_t v4l2_image_bytes(const V4l2Format& format, int width, int height, std::uint64_t stride);
// Bytes of a row without padding; MJPEG: 0.
std::uint64_t v4l2_row_bytes(const V4l2Format& format, int width);

}  // namespace burin
