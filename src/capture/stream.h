// SPDX-License-Identifier: MIT
// What a sensor can deliver: its streams, and what each image of one looks like once a back end has unpacked
// it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "capture/frame.h"
#include "core/camera.h"
#include "core/se3.h"

namespace burin {

// The numeric values are those of burin_stream in include/burin/capture.h.
enum class StreamKind : std::uint8_t { depth, colour, infrared, infrared_right, confidence };
inline constexpr int kStreamKinds = 5;
inline constexpr unsigned stream_bit(StreamKind kind) { return 1u << static_cast<unsigned>(kind); }
const char* stream_name(StreamKind kind);

// Pixels as they leave a back end. Depth is always u16 (0: no depth); infrared u8 or u16; confidence u8;
// colour one of PixelFormat.
enum class StreamPixels : std::uint8_t { u8, u16, colour };

// One stream of an open device. Intrinsics and extrinsic are the device's own where it tells them, else those
// of a calibration file, else nominal (by the data sheet's field of view): `calibrated` says which.
struct StreamInfo {
    StreamKind kind = StreamKind::depth;
    StreamPixels pixels = StreamPixels::u16;
    PixelFormat colour_format = PixelFormat::rgb8;  // of colour
    char format[24] = "";                           // as the device sends it: "Z16", "packed11", "MJPG"
    int width = 0, height = 0;                      // pixels
    double fps = 0;                                 // images a second, 0 when the device does not say
    double unit_m = 0.001;                          // of depth: metres a step
    bool calibrated = false;
    Camera camera;       // of this stream, width x height
    Se3 T_stream_depth;  // depth camera coordinates to those of this stream's camera
    // Images that a back end hands out from its own memory may have longer rows; see SourceSink::lend.
    std::size_t row_bytes = 0;    // of an image in a slot: rows packed
    std::size_t image_bytes = 0;  // row_bytes * rows (of all planes)
};

inline constexpr int row_bytes_of(const StreamInfo& s) {
    if (s.pixels == StreamPixels::u8) return s.width;
    if (s.pixels == StreamPixels::u16) return s.width * 2;
    switch (s.colour_format) {
        case PixelFormat::rgb8:
        case PixelFormat::bgr8:
            return s.width * 3;
        case PixelFormat::rgba8:
        case PixelFormat::bgra8:
            return s.width * 4;
        case PixelFormat::yuyv:
            return (s.width + 1) / 2 * 4;
        default:
            return s.width;  // grey8, and the first plane of nv12 and nv21
    }
}

// Sets row_bytes and image_bytes from size and pixels.
inline void set_image_bytes(StreamInfo* s) {
    s->row_bytes = static_cast<std::size_t>(row_bytes_of(*s));
    s->image_bytes = s->row_bytes * static_cast<std::size_t>(s->height);
    if (s->pixels == StreamPixels::colour &&
        (s->colour_format == PixelFormat::nv12 || s->colour_format == PixelFormat::nv21))
        s->image_bytes += static_cast<std::size_t>((s->width + 1) / 2) * 2 * ((s->height + 1) / 2);
}

}  // namespace burin
