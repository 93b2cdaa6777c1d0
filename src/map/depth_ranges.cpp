// SPDX-License-Identifier: MIT
#include "map/depth_ranges.h"

#include <algorithm>
#include <bit>

#include "simd/visibility.h"

namespace burin {
namespace {

constexpr int kTile = DepthTiles::kTile;
constexpr std::uint32_t kNothing = 0xffffffffu;  // joined with anything, leaves it as it is

int tiles_of(int pixels) { return (pixels + kTile - 1) / kTile; }

// Squares that begin in the image reach over its right end by less than kReach tiles, at each level they are
// joined from ones that do; what comes from beyond that is another row's.
int stride_for(int width, int reach) { return (width + 2 * reach + 15) / 16 * 16; }

}  // namespace

void DepthRanges::place(Arena& arena, int max_width, int max_height) {
    const auto stride = static_cast<std::size_t>(stride_for(tiles_of(max_width), kReach));
    const std::size_t count = stride * (static_cast<std::size_t>(tiles_of(max_height)) + kReach) + kReach;
    for (int level = 0; level < kLevels; ++level) squares_[level] = arena.allocate<std::uint32_t>(count, 64);
}

void DepthRanges::build(const DepthTiles& tiles) {
    width_ = tiles.width;
    height_ = tiles.height;
    stride_ = stride_for(width_, kReach);
    all_ = tiles.all;
    for (int y = 0; y < height_; ++y) {
        const std::ptrdiff_t from = static_cast<std::ptrdiff_t>(y) * width_,
                             to = static_cast<std::ptrdiff_t>(y) * stride_;
        for (int x = 0; x < width_; ++x) {
            const std::uint32_t least = tiles.ranges[from + x].least,
                                largest = tiles.ranges[from + x].largest;
            squares_[0][to + x] = (((least - 1) & 0xffff) + (least != 0)) | (65535 - largest) << 16;
        }
        std::fill(squares_[0] + to + width_, squares_[0] + to + stride_, kNothing);
    }
    for (int level = 0; level < kLevels; ++level)
        std::fill_n(squares_[level] + static_cast<std::ptrdiff_t>(height_) * stride_,
                    static_cast<std::ptrdiff_t>(kReach) * stride_ + kReach, kNothing);
    for (int level = 1; level < kLevels; ++level)
        simd::double_ranges(squares_[level - 1], height_ * stride_, stride_, 1 << (level - 1),
                            squares_[level]);
}

DepthRange DepthRanges::over(int x0, int y0, int x1, int y1) const {
    x0 = std::max(x0, 0) / kTile;
    y0 = std::max(y0, 0) / kTile;
    x1 = std::min(x1 / kTile, width_ - 1);
    y1 = std::min(y1 / kTile, height_ - 1);
    if (x1 < x0 || y1 < y0) return {0, 0};
    // The least square of which two by two cover the rectangle.
    const unsigned side = static_cast<unsigned>(std::max(x1 - x0, y1 - y0)) + 1;
    const int level = side <= 1 ? 0 : std::bit_width(side - 1) - 1;
    if (level >= kLevels) return all_;
    const int step = 1 << level;
    const std::ptrdiff_t right = std::max(x1 - step + 1 - x0, 0),
                         down = std::ptrdiff_t{std::max(y1 - step + 1 - y0, 0)} * stride_;
    const std::uint32_t* at = squares_[level] + static_cast<std::ptrdiff_t>(y0) * stride_ + x0;
    const std::uint32_t four[4] = {at[0], at[right], at[down], at[down + right]};
    std::uint32_t least = 65535, above = 65535;
    for (const std::uint32_t range : four) {
        least = std::min(least, range & 0xffff);
        above = std::min(above, range >> 16);
    }
    return {static_cast<std::uint16_t>(least), static_cast<std::uint16_t>(65535 - above)};
}

}  // namespace burin
