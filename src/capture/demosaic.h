// SPDX-License-Identifier: MIT
// Bayer mosaics to RGB of 8 bits, over simd/mosaic.h.
#pragma once

#include <cstdint>

#include "capture/raw_image.h"
#include "core/camera.h"

namespace burin {

// The first two pixels of the first row, then of the second: GRBG has green and red, then blue and green.
enum class BayerOrder : std::uint8_t { rggb, grbg, gbrg, bggr };

// A mosaic's pixels: u8 for SBGGR8 and the like; le16 with 10, 12 or 16 bits; mipi10, mipi12, msb10, msb12.
// What is above 8 bits is cut off before interpolation. 8 <= bits <= 16.
struct BayerFormat {
    BayerOrder order = BayerOrder::grbg;
    simd::Packing packing = simd::Packing::u8;
    int bits = 8;
};

// Rows with their borders, in fixed memory of some 120 KB: one a stream. Not for two threads at a time.
class Demosaic {
  public:
    // Image `rgb` (3 channels, width and height 1..kMaxImageSide) out of raw bytes, whose rows begin at whole
    // bytes. Missing pixels count as 0. Beyond its border the mosaic goes on as its mirror image, about the
    // last pixel, so that colours fall on their like. Returns how many pixels were there.
    std::size_t run(const BayerFormat& format, const RawBytes& raw, View<std::uint8_t> rgb);

  private:
    // Vectors read up to 64 bytes beyond a row's margin.
    static constexpr int kBefore = 64, kRow = kBefore + kMaxImageSide + 128, kRows = 5;
    std::uint8_t* row(int y) { return rows_[y % kRows] + kBefore; }
    std::size_t fetch(const BayerFormat& format, const RawBytes& raw, int y, int width);

    alignas(64) std::uint8_t rows_[kRows][kRow] = {};
    std::uint16_t words_[kMaxImageSide];
};

}  // namespace burin
