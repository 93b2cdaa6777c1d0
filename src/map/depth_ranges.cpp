// SPDX-License-Identifier: MIT
#include "map/depth_ranges.h"

#include <algorithm>
#include <bit>

#include "simd/visibility.h"

namespace burin {
namespace {

constexpr int kTile = DepthTiles::kTile;

int tiles_of(int pixels) { return (pixels + kTile - 1) / kTile; }

}  // namespace

// Beyond the image lie as many empty tiles as the largest square reaches; whole vectors of 32.
void DepthRanges::place(Arena& arena, int max_width, int max_height) {
    const std::size_t stride = (static_cast<std::size_t>(tiles_of(max_width)) + 2 * kReach + 31) / 32 * 32 + 32;
    const std::size_t count = stride * (static_cast<std::size_t>(tiles_of(max_height)) + kReach);
    for (int level = 0; level < kLevels; ++level) {
        least_[level] = arena.allocate<std::uint16_t>(count, 64);
        largest_[level] = arena.allocate<std::uint16_t>(count, 64);
    }
}

void DepthRanges::build(const DepthTiles& tiles) {
    width_ = tiles.width[0];
    height_ = tiles.height[0];
    stride_ = (width_ + 2 * kReach + 31) / 32 * 32 + 32;
    all_ = tiles.level[tiles.levels - 1][0];
    for (int level = 0; level < kLevels; ++level) {
        if (level > 0)
            simd::double_ranges(least_[level - 1], largest_[level - 1], height_, stride_, 1 << (level - 1),
                                least_[level], largest_[level]);
        // Empty tiles beyond what was computed.
        const int computed = level == 0 ? 0 : height_;
        std::fill_n(least_[level] + static_cast<std::ptrdiff_t>(computed) * stride_,
                    static_cast<std::ptrdiff_t>(height_ + kReach - computed) * stride_, std::uint16_t{65535});
        std::fill_n(largest_[level] + static_cast<std::ptrdiff_t>(computed) * stride_,
                    static_cast<std::ptrdiff_t>(height_ + kReach - computed) * stride_, std::uint16_t{0});
        if (level > 0) {
            for (int y = 0; y < height_; ++y) {  // the columns that the doubling could not reach
                const std::ptrdiff_t end = static_cast<std::ptrdiff_t>(y + 1) * stride_;
                std::fill_n(least_[level] + end - (1 << (level - 1)), 1 << (level - 1), std::uint16_t{65535});
                std::fill_n(largest_[level] + end - (1 << (level - 1)), 1 << (level - 1), std::uint16_t{0});
            }
            continue;
        }
        for (int y = 0; y < height_; ++y) {
            const DepthRange* from = tiles.level[0] + static_cast<std::ptrdiff_t>(y) * width_;
            std::uint16_t* least = least_[0] + static_cast<std::ptrdiff_t>(y) * stride_;
            std::uint16_t* largest = largest_[0] + static_cast<std::ptrdiff_t>(y) * stride_;
            for (int x = 0; x < width_; ++x) {
                // Empty tiles hold least = 0: 0 - 1 wraps to 65535, and no reading is 65535.
                const auto below = static_cast<std::uint16_t>(from[x].least - 1);
                least[x] = static_cast<std::uint16_t>(below + (below != 65535));
                largest[x] = from[x].largest;
            }
        }
    }
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
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(y0) * stride_ + x0;
    const std::uint16_t* least = least_[level] + at;
    const std::uint16_t* largest = largest_[level] + at;
    return {std::min(std::min(least[0], least[right]), std::min(least[down], least[down + right])),
            std::max(std::max(largest[0], largest[right]), std::max(largest[down], largest[down + right]))};
}

}  // namespace burin
