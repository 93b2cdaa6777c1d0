// SPDX-License-Identifier: MIT
// The specification of the kernels of mosaic.h.
#include "simd/mosaic.h"

#include <algorithm>

namespace burin::simd {
namespace {

std::uint8_t to_byte(int value) { return static_cast<std::uint8_t>(std::clamp(value, 0, 255)); }

}  // namespace

namespace scalar {

int yuv422_to_rgb(Yuv422 order, const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* rgb) {
    // Whole pairs. A row of an odd number of pixels has a whole pair at its end too.
    const int n = static_cast<int>(std::min(static_cast<std::size_t>(count), bytes / 4 * 2));
    const int luma = order == Yuv422::yuyv ? 0 : 1;
    for (int i = 0; i < n; ++i, rgb += 3) {
        const std::uint8_t* pair = in + i / 2 * 4;
        // Coefficients times 65536: 255 / 219 of Y, 255 / 224 of U and V times those of the standard.
        const int y = 76309 * (pair[2 * (i % 2) + luma] - 16) + 32768;
        const int u = pair[1 - luma] - 128, v = pair[3 - luma] - 128;
        rgb[0] = to_byte((y + 104597 * v) >> 16);
        rgb[1] = to_byte((y - 25675 * u - 53279 * v) >> 16);
        rgb[2] = to_byte((y + 132201 * u) >> 16);
    }
    return n;
}

void demosaic_row(const std::uint8_t* const rows[5], BayerRow first, int width, std::uint8_t* rgb) {
    const bool red_row = first == BayerRow::rg || first == BayerRow::gr;
    const int green_at = first == BayerRow::gr || first == BayerRow::gb ? 0 : 1;  // parity of green columns
    const std::uint8_t *n2 = rows[0], *n = rows[1], *c = rows[2], *s = rows[3], *s2 = rows[4];
    for (int x = 0; x < width; ++x, rgb += 3) {
        const int beside = c[x - 1] + c[x + 1], beside2 = c[x - 2] + c[x + 2];
        const int along = n[x] + s[x], along2 = n2[x] + s2[x];
        const int diagonal = n[x - 1] + n[x + 1] + s[x - 1] + s[x + 1];
        std::uint8_t own, green, other;
        if ((x & 1) == green_at) {
            own = to_byte((10 * c[x] + 8 * beside - 2 * (diagonal + beside2) + along2 + 8) >> 4);
            green = c[x];
            other = to_byte((10 * c[x] + 8 * along - 2 * (diagonal + along2) + beside2 + 8) >> 4);
        } else {
            own = c[x];
            green = to_byte((8 * c[x] + 4 * (beside + along) - 2 * (beside2 + along2) + 8) >> 4);
            other = to_byte((12 * c[x] + 4 * diagonal - 3 * (beside2 + along2) + 8) >> 4);
        }
        rgb[0] = red_row ? own : other;
        rgb[1] = green;
        rgb[2] = red_row ? other : own;
    }
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
int yuv422_to_rgb(Yuv422 order, const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* rgb) {
    return scalar::yuv422_to_rgb(order, in, bytes, count, rgb);
}
void demosaic_row(const std::uint8_t* const rows[5], BayerRow first, int width, std::uint8_t* rgb) {
    scalar::demosaic_row(rows, first, width, rgb);
}
#endif

}  // namespace burin::simd
