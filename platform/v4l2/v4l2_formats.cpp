// SPDX-License-Identifier: MIT
#include "platform/v4l2/v4l2_formats.h"

#include <linux/videodev2.h>

#include <cstring>

// Formats that headers of older kernels lack; codes of linux/videodev2.h (6.x).
#ifndef V4L2_PIX_FMT_Y16I
#define V4L2_PIX_FMT_Y16I v4l2_fourcc('Y', '1', '6', 'I')
#endif
#ifndef V4L2_PIX_FMT_Y12P
#define V4L2_PIX_FMT_Y12P v4l2_fourcc('Y', '1', '2', 'P')
#endif

namespace burin {
namespace {

using simd::Packing;

constexpr V4l2Format depth(std::uint32_t code, const char* name, V4l2Way way) {
    return {code, name, StreamKind::depth, way, StreamPixels::u16};
}
constexpr V4l2Format grey(std::uint32_t code, const char* name, V4l2Way way, Packing packing, int bits) {
    V4l2Format f = {code, name, StreamKind::infrared, way, bits > 8 ? StreamPixels::u16 : StreamPixels::u8};
    f.packing = packing;
    f.bits = bits;
    return f;
}
constexpr V4l2Format colour(std::uint32_t code, const char* name, V4l2Way way, PixelFormat format) {
    return {code, name, StreamKind::colour, way, StreamPixels::colour, format};
}
constexpr V4l2Format bayer(std::uint32_t code, const char* name, BayerOrder order, Packing packing,
                           int bits) {
    V4l2Format f = colour(code, name, V4l2Way::bayer, PixelFormat::rgb8);
    f.packing = packing;
    f.order = order;
    f.bits = bits;
    return f;
}

constexpr V4l2Format kFormats[] = {
    depth(V4L2_PIX_FMT_Z16, "Z16", V4l2Way::as_is),
    depth(V4L2_PIX_FMT_INZI, "INZI", V4l2Way::inzi),
    {V4L2_PIX_FMT_CNF4, "CNF4", StreamKind::confidence, V4l2Way::cnf4, StreamPixels::u8},
    grey(V4L2_PIX_FMT_Y8I, "Y8I", V4l2Way::y8i, Packing::u8, 8),
    grey(V4L2_PIX_FMT_Y12I, "Y12I", V4l2Way::y12i, Packing::le16, 12),
    grey(V4L2_PIX_FMT_Y16I, "Y16I", V4l2Way::y16i, Packing::le16, 16),
    grey(V4L2_PIX_FMT_GREY, "GREY", V4l2Way::as_is, Packing::u8, 8),
    grey(V4L2_PIX_FMT_Y16, "Y16", V4l2Way::as_is, Packing::le16, 16),
    grey(V4L2_PIX_FMT_Y16_BE, "Y16_BE", V4l2Way::packed, Packing::be16, 16),
    grey(V4L2_PIX_FMT_Y12, "Y12", V4l2Way::as_is, Packing::le16, 12),
    grey(V4L2_PIX_FMT_Y10, "Y10", V4l2Way::as_is, Packing::le16, 10),
    grey(V4L2_PIX_FMT_Y10P, "Y10P", V4l2Way::packed, Packing::mipi10, 10),
    grey(V4L2_PIX_FMT_Y12P, "Y12P", V4l2Way::packed, Packing::mipi12, 12),
    grey(V4L2_PIX_FMT_Y10BPACK, "Y10BPACK", V4l2Way::packed, Packing::msb10, 10),
    colour(V4L2_PIX_FMT_YUYV, "YUYV", V4l2Way::as_is, PixelFormat::yuyv),
    colour(V4L2_PIX_FMT_RGB24, "RGB24", V4l2Way::as_is, PixelFormat::rgb8),
    colour(V4L2_PIX_FMT_BGR24, "BGR24", V4l2Way::as_is, PixelFormat::bgr8),
    colour(V4L2_PIX_FMT_NV12, "NV12", V4l2Way::as_is, PixelFormat::nv12),
    colour(V4L2_PIX_FMT_NV21, "NV21", V4l2Way::as_is, PixelFormat::nv21),
    colour(V4L2_PIX_FMT_UYVY, "UYVY", V4l2Way::uyvy, PixelFormat::rgb8),
    colour(V4L2_PIX_FMT_MJPEG, "MJPG", V4l2Way::mjpeg, PixelFormat::rgb8),
    bayer(V4L2_PIX_FMT_SGRBG8, "GRBG8", BayerOrder::grbg, Packing::u8, 8),
    bayer(V4L2_PIX_FMT_SRGGB8, "RGGB8", BayerOrder::rggb, Packing::u8, 8),
    bayer(V4L2_PIX_FMT_SGBRG8, "GBRG8", BayerOrder::gbrg, Packing::u8, 8),
    bayer(V4L2_PIX_FMT_SBGGR8, "BGGR8", BayerOrder::bggr, Packing::u8, 8),
    bayer(V4L2_PIX_FMT_SGRBG10, "GRBG10", BayerOrder::grbg, Packing::le16, 10),
    bayer(V4L2_PIX_FMT_SRGGB10, "RGGB10", BayerOrder::rggb, Packing::le16, 10),
    bayer(V4L2_PIX_FMT_SGBRG10, "GBRG10", BayerOrder::gbrg, Packing::le16, 10),
    bayer(V4L2_PIX_FMT_SBGGR10, "BGGR10", BayerOrder::bggr, Packing::le16, 10),
    bayer(V4L2_PIX_FMT_SGRBG12, "GRBG12", BayerOrder::grbg, Packing::le16, 12),
    bayer(V4L2_PIX_FMT_SRGGB12, "RGGB12", BayerOrder::rggb, Packing::le16, 12),
    bayer(V4L2_PIX_FMT_SGBRG12, "GBRG12", BayerOrder::gbrg, Packing::le16, 12),
    bayer(V4L2_PIX_FMT_SBGGR12, "BGGR12", BayerOrder::bggr, Packing::le16, 12),
    bayer(V4L2_PIX_FMT_SGRBG16, "GRBG16", BayerOrder::grbg, Packing::le16, 16),
    bayer(V4L2_PIX_FMT_SRGGB16, "RGGB16", BayerOrder::rggb, Packing::le16, 16),
    bayer(V4L2_PIX_FMT_SGBRG16, "GBRG16", BayerOrder::gbrg, Packing::le16, 16),
    bayer(V4L2_PIX_FMT_SBGGR16, "BGGR16", BayerOrder::bggr, Packing::le16, 16),
    // As Raspberry Pi's and RealSense's raw modes have it. (Here last: what nobody wants to look at.)
    bayer(V4L2_PIX_FMT_SRGGB10P, "RGGB10P", BayerOrder::rggb, Packing::mipi10, 10),
    bayer(V4L2_PIX_FMT_SGRBG10P, "GRBG10P", BayerOrder::grbg, Packing::mipi10, 10),
    bayer(V4L2_PIX_FMT_SGBRG10P, "GBRG10P", BayerOrder::gbrg, Packing::mipi10, 10),
    bayer(V4L2_PIX_FMT_SBGGR10P, "BGGR10P", BayerOrder::bggr, Packing::mipi10, 10),
};

}  // namespace

const V4l2Format* find_v4l2_format(std::uint32_t code) {
    for (const V4l2Format& f : kFormats)
        if (f.code == code) return &f;
    return nullptr;
}

const V4l2Format* find_v4l2_format(const char* name) {
    for (const V4l2Format& f : kFormats)
        if (std::strcmp(f.name, name) == 0) return &f;
    return nullptr;
}

int v4l2_format_rank(const V4l2Format& format) { return static_cast<int>(&format - kFormats); }

std::uint64_t v4l2_row_bytes(const V4l2Format& f, int width) {
    const auto w = static_cast<std::uint64_t>(width);
    switch (f.way) {
        case V4l2Way::packed:
        case V4l2Way::bayer:
            return simd::packed_bytes(f.packing, static_cast<std::size_t>(width));
        case V4l2Way::inzi:
        case V4l2Way::y8i:
            return 2 * w;
        case V4l2Way::y12i:
            return 3 * w;
        case V4l2Way::y16i:
            return 4 * w;
        case V4l2Way::cnf4:
            return (w + 1) / 2;
        case V4l2Way::uyvy:
            return (w + 1) / 2 * 4;
        case V4l2Way::mjpeg:
            return 0;
        case V4l2Way::as_is:
            break;
    }
    StreamInfo s;
    s.pixels = f.pixels;
    s.colour_format = f.colour;
    s.width = width;
    return static_cast<std::uint64_t>(row_bytes_of(s));
}

std::uint64_t v4l2_image_bytes(const V4l2Format& f, int width, int height, std::uint64_t stride) {
    const auto rows = static_cast<std::uint64_t>(height);
    if (f.way == V4l2Way::mjpeg || height < 1) return 0;
    // Two images below one another, whose rows uvcvideo states together: 4 bytes a pixel, without padding.
    if (f.way == V4l2Way::inzi) return 2 * rows * v4l2_row_bytes(f, width);
    const std::uint64_t whole =
        f.colour == PixelFormat::nv12 || f.colour == PixelFormat::nv21 ? rows + (rows + 1) / 2 : rows;
    // The last row may lack its padding.
    return stride * (whole - 1) + v4l2_row_bytes(f, width);
}

}  // namespace burin
