// SPDX-License-Identifier: MIT
// Whole images of a sensor's raw bytes to pixels, over the kernels of simd/unpack.h, split.h and mosaic.h.
// What is missing at the end of the bytes becomes 0. No allocation, no state; any thread. Byte layouts:
// docs/capture_pixels.md.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/image.h"
#include "simd/mosaic.h"
#include "simd/split.h"
#include "simd/unpack.h"

namespace burin {

// Raw bytes of one image as they came: `size` bytes there are, rows `stride` apart. 0: a run of pixels
// without any row (Kinect, PrimeSense), or rows packed as tightly as their packing allows.
struct RawBytes {
    const std::uint8_t* data = nullptr;
    std::size_t size = 0;
    std::size_t stride = 0;  // bytes
};

// Depth by reading: of `entries` (1..65536) values, 0 for readings without depth. Null: readings as they are.
struct DepthTable {
    const std::uint16_t* values = nullptr;
    int entries = 0;
};

// Each returns how many pixels were there (of each image where there are two); `out` has the size wanted.
std::size_t unpack_image(simd::Packing packing, const RawBytes& raw, const DepthTable& table,
                         View<std::uint16_t> out);
// INZI: a plane of infrared, then one of depth, 16 bits each, little-endian; raw.stride is that of both.
std::size_t unpack_inzi(const RawBytes& raw, View<std::uint16_t> infrared, View<std::uint16_t> depth);
std::size_t unpack_y8i(const RawBytes& raw, View<std::uint8_t> left, View<std::uint8_t> right);
std::size_t unpack_y12i(const RawBytes& raw, View<std::uint16_t> left, View<std::uint16_t> right);
std::size_t unpack_y16i(const RawBytes& raw, View<std::uint16_t> left, View<std::uint16_t> right);
// CNF4.
std::size_t unpack_confidence(const RawBytes& raw, View<std::uint8_t> out);
// YUYV or UYVY to RGB, 3 channels.
std::size_t unpack_yuv422(simd::Yuv422 order, const RawBytes& raw, View<std::uint8_t> rgb);

}  // namespace burin
