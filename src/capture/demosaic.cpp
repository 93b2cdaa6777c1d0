// SPDX-License-Identifier: MIT
#include "capture/demosaic.h"

#include <algorithm>
#include <cstring>

namespace burin {
namespace {

// Index `i` reflected into 0..count-1 about the ends: parity, and with it the colour, stays (but in images of
// one pixel).
int mirrored(int i, int count) {
    if (count == 1) return 0;
    while (i < 0 || i >= count) i = i < 0 ? -i : 2 * (count - 1) - i;
    return i;
}

simd::BayerRow row_of(BayerOrder order, int y) {
    using simd::BayerRow;
    constexpr BayerRow kRows[4][2] = {{BayerRow::rg, BayerRow::gb},
                                      {BayerRow::gr, BayerRow::bg},
                                      {BayerRow::gb, BayerRow::rg},
                                      {BayerRow::bg, BayerRow::gr}};
    return kRows[static_cast<int>(order)][y & 1];
}

}  // namespace

std::size_t Demosaic::fetch(const BayerFormat& format, const RawBytes& raw, int y, int width) {
    const std::size_t tight = simd::packed_bytes(format.packing, static_cast<std::size_t>(width));
    const std::size_t start = static_cast<std::size_t>(y) * (raw.stride ? raw.stride : tight);
    const std::size_t bytes = start < raw.size ? std::min(raw.size - start, tight) : 0;
    std::uint8_t* to = row(y);
    int found = 0;
    if (format.packing == simd::Packing::u8) {
        found = static_cast<int>(bytes);
        if (found) std::memcpy(to, raw.data + start, bytes);
    } else if (bytes) {
        found = simd::unpack(format.packing, raw.data + start, bytes, width, words_);
        simd::narrow_u16(words_, found, format.bits - 8, to);
    }
    std::memset(to + found, 0, static_cast<std::size_t>(width - found));
    for (int i = 1; i <= simd::kBayerMargin; ++i) {
        to[-i] = to[mirrored(-i, width)];
        to[width - 1 + i] = to[mirrored(width - 1 + i, width)];
    }
    return static_cast<std::size_t>(found);
}

std::size_t Demosaic::run(const BayerFormat& format, const RawBytes& raw, View<std::uint8_t> rgb) {
    const int width = rgb.width, height = rgb.height;
    std::size_t pixels = 0;
    int next = 0;
    for (int y = 0; y < height; ++y) {
        // Rows y - 2 to y + 2 are in the ring; those beyond a border are mirror images, which are among them.
        for (; next < height && next <= y + simd::kBayerMargin; ++next)
            pixels += fetch(format, raw, next, width);
        const std::uint8_t* rows[5];
        for (int k = 0; k < 5; ++k) rows[k] = row(mirrored(y - 2 + k, height));
        simd::demosaic_row(rows, row_of(format.order, y), width, rgb.row(y));
    }
    return pixels;
}

}  // namespace burin
