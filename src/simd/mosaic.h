// SPDX-License-Identifier: MIT
// Kernels of colour as sensors send it: YCbCr 4:2:2 and Bayer mosaics to interleaved RGB of 8 bits.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin::simd {

// Y0 U Y1 V (YUYV) or U Y0 V Y1 (UYVY), a pair of pixels in four bytes; ITU-R BT.601 with Y of 16..235, the
// same coefficients as map/colour_pixels.cpp. The first `count` pixels, or as many as are complete in the
// bytes (the first of a pair when its chroma is there): returns how many. UYVY to YUYV needs no kernel of its
// own: swapped bytes are Packing::be16.
enum class Yuv422 : std::uint8_t { yuyv, uyvy };
int yuv422_to_rgb(Yuv422 order, const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* rgb);

// The first two pixels of a row of the mosaic.
enum class BayerRow : std::uint8_t { rg, gr, gb, bg };

// One row of a mosaic: rows[2] is the row, rows[0..1] those above, rows[3..4] those below; each readable from
// kBayerMargin bytes before its first pixel to kBayerMargin after its last, the border's mirror images.
// Linear interpolation with gradient correction of Malvar, He and Cutler, "High-quality linear interpolation
// for demosaicing of Bayer-patterned color images", ICASSP 2004, figure 2, in sixteenths:
//   green at red or blue   (8 C + 4 (N + S + E + W) - 2 (N2 + S2 + E2 + W2)) / 16
//   row's colour at green  (10 C + 8 (E + W) - 2 (NE + NW + SE + SW + E2 + W2) + N2 + S2) / 16
//   other colour at green  (10 C + 8 (N + S) - 2 (NE + NW + SE + SW + N2 + S2) + E2 + W2) / 16
//   red at blue, blue at red  (12 C + 4 (NE + NW + SE + SW) - 3 (N2 + S2 + E2 + W2)) / 16
// each plus 1/2, rounded down, clamped to 0..255.
inline constexpr int kBayerMargin = 2;
void demosaic_row(const std::uint8_t* const rows[5], BayerRow first, int width, std::uint8_t* rgb);

namespace scalar {
int yuv422_to_rgb(Yuv422 order, const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* rgb);
void demosaic_row(const std::uint8_t* const rows[5], BayerRow first, int width, std::uint8_t* rgb);
}  // namespace scalar

}  // namespace burin::simd
