// SPDX-License-Identifier: MIT
#include "map/band_marker.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace burin {
namespace {

// Rounding of pixels and coordinates here and in observe_chunk differs by far less than these.
constexpr float kPixelMargin = 0.51f;  // half a pixel, since integration reads the nearest one
constexpr float kVoxelMargin = 0.02f;

int floor_to_int(float x) {
    const int i = static_cast<int>(x);
    return i - (static_cast<float>(i) > x);
}

}  // namespace

void BandMarker::place(Arena& arena) { words_ = arena.allocate<std::uint64_t>(kGridBits / 64, 64); }

float BandMarker::truncation_at(float z) const {
    if (!truncation_.quadratic) return truncation_.truncation_m;
    return std::max(truncation_.floor_m, (truncation_.a * z + truncation_.b) * z + truncation_.c);
}

void BandMarker::begin(const DepthImage& image, const DepthTiles& tiles, const Se3& T,
                       const simd::TruncationModel& truncation, float voxel_m) {
    image_ = &image;
    tiles_ = &tiles;
    truncation_ = truncation;
    voxel_m_ = voxel_m;
    started_ = false;
    cursor_ = kGridBits;  // nothing to read yet
    size_[0] = size_[1] = size_[2] = 0;
    if (image.valid == 0) return;

    const Camera& c = image.camera;
    for (int r = 0; r < 3; ++r) {
        slope_u_[r] = static_cast<float>(T.R(r, 0) / c.fx);
        slope_v_[r] = static_cast<float>(T.R(r, 1) / c.fy);
        slope_1_[r] = static_cast<float>(T.R(r, 2) - T.R(r, 0) * c.cx / c.fx - T.R(r, 1) * c.cy / c.fy);
    }
    // Origin near the camera first, to find the box of the whole view in small numbers; then its low corner.
    const double chunk_m = static_cast<double>(voxel_m) * kChunkSide;
    origin_ = {};
    for (int r = 0; r < 3; ++r) {
        origin_[r] = static_cast<std::int32_t>(
            std::floor(std::clamp(T.t[r] / chunk_m, -2.0 * kChunkLimit, 2.0 * kChunkLimit)));
        start_[r] = static_cast<float>((T.t[r] - origin_[r] * chunk_m) / voxel_m);
    }
    const float half_u = 0.5f * static_cast<float>(image.width),
                half_v = 0.5f * static_cast<float>(image.height);
    float half_slope[3];
    for (int r = 0; r < 3; ++r)
        half_slope[r] = std::fabs(slope_u_[r]) * half_u + std::fabs(slope_v_[r]) * half_v;
    const float reach = truncation_at(image.farthest_m);
    const Box view =
        box_of(half_u - 0.5f, half_v - 0.5f, half_slope, image.nearest_m - reach, image.farthest_m + reach);
    for (int r = 0; r < 3; ++r) {
        origin_[r] += view.low[r];
        start_[r] -= static_cast<float>(view.low[r] * kChunkSide);
        size_[r] = view.high[r] - view.low[r] + 1;
    }
    size_[0] = (size_[0] + 63) & ~63;
    // Cut along z first, then along y; a row along x always fits (kMaxImageSide and 50 m bound it far below
    // the grid).
    const std::size_t row = static_cast<std::size_t>(size_[0]);
    step_[0] = size_[0];
    step_[1] = static_cast<int>(
        std::min<std::size_t>(static_cast<std::size_t>(size_[1]), std::max<std::size_t>(kGridBits / row, 1)));
    step_[2] = static_cast<int>(std::min<std::size_t>(
        static_cast<std::size_t>(size_[2]),
        std::max<std::size_t>(kGridBits / (row * static_cast<std::size_t>(step_[1])), 1)));
}

BandMarker::Box BandMarker::box_of(float u, float v, const float half_slope[3], float z_low,
                                   float z_high) const {
    z_low = std::max(z_low, 0.0f);
    Box box;
    for (int r = 0; r < 3; ++r) {
        const float slope = slope_u_[r] * u + slope_v_[r] * v + slope_1_[r];
        const float low = slope - half_slope[r], high = slope + half_slope[r];
        const float world_low = std::min(z_low * low, z_high * low) / voxel_m_ + start_[r];
        const float world_high = std::max(z_low * high, z_high * high) / voxel_m_ + start_[r];
        // Voxel i has its centre at i + 1/2: the first at or above world_low, the last at or below
        // world_high.
        box.low[r] = (floor_to_int(world_low - 0.5f - kVoxelMargin) + 1) >> 3;
        box.high[r] = floor_to_int(world_high - 0.5f + kVoxelMargin) >> 3;
    }
    return box;
}

void BandMarker::mark(const Box& box) {
    int low[3], high[3];
    for (int r = 0; r < 3; ++r) {
        low[r] = std::max(box.low[r] - slab_low_[r], 0);
        high[r] = std::min(box.high[r] - slab_low_[r], slab_size_[r] - 1);
        if (low[r] > high[r]) return;
    }
    const int first = low[0] >> 6, last = high[0] >> 6;
    for (int z = low[2]; z <= high[2]; ++z)
        for (int y = low[1]; y <= high[1]; ++y) {
            std::uint64_t* row =
                words_ + (static_cast<std::size_t>(z) * slab_size_[1] + y) * (slab_size_[0] / 64);
            for (int word = first; word <= last; ++word) {
                std::uint64_t bits = ~std::uint64_t{0};
                if (word == first) bits &= ~std::uint64_t{0} << (low[0] & 63);
                if (word == last) bits &= ~std::uint64_t{0} >> (63 - (high[0] & 63));
                row[word] |= bits;
            }
        }
}

void BandMarker::mark_tiles() {
    constexpr int kTile = DepthTiles::kTile;
    const float half_tile = 0.5f * (kTile - 1) + kPixelMargin;
    float half_slope[3], half_pixel[3];
    for (int r = 0; r < 3; ++r) {
        half_slope[r] = half_tile * (std::fabs(slope_u_[r]) + std::fabs(slope_v_[r]));
        half_pixel[r] = kPixelMargin * (std::fabs(slope_u_[r]) + std::fabs(slope_v_[r]));
    }
    const float deep_m = 2.0f * kChunkSide * voxel_m_;  // beyond this a tile's box holds mostly air
    for (int ty = 0; ty < tiles_->height[0]; ++ty) {
        Box previous{{1, 1, 1}, {0, 0, 0}};
        for (int tx = 0; tx < tiles_->width[0]; ++tx) {
            const DepthRange range =
                tiles_->level[0][static_cast<std::ptrdiff_t>(ty) * tiles_->width[0] + tx];
            if (range.largest == 0) continue;
            const float near_m = static_cast<float>(range.least) * image_->unit_m;
            const float far_m = static_cast<float>(range.largest) * image_->unit_m;
            if (far_m - near_m <= deep_m) {
                const float tau = truncation_at(far_m);
                const Box box = box_of(static_cast<float>(tx * kTile) + 0.5f * (kTile - 1),
                                       static_cast<float>(ty * kTile) + 0.5f * (kTile - 1), half_slope,
                                       near_m - tau, far_m + tau);
                if (!(box == previous)) mark(box);
                previous = box;
                continue;
            }
            for (int y = ty * kTile; y < std::min((ty + 1) * kTile, image_->height); ++y)
                for (int x = tx * kTile; x < std::min((tx + 1) * kTile, image_->width); ++x) {
                    const std::uint16_t raw = image_->at(x, y);
                    if (raw == 0) continue;
                    const float depth_m = static_cast<float>(raw) * image_->unit_m,
                                tau = truncation_at(depth_m);
                    mark(box_of(static_cast<float>(x), static_cast<float>(y), half_pixel, depth_m - tau,
                                depth_m + tau));
                }
        }
    }
}

bool BandMarker::next_slab() {
    if (size_[0] == 0) return false;
    if (!started_) {
        started_ = true;
        slab_low_[0] = slab_low_[1] = slab_low_[2] = 0;
    } else {
        slab_low_[1] += step_[1];
        if (slab_low_[1] >= size_[1]) {
            slab_low_[1] = 0;
            slab_low_[2] += step_[2];
        }
        if (slab_low_[2] >= size_[2]) return false;
    }
    slab_size_[0] = size_[0];
    for (int r = 1; r < 3; ++r) slab_size_[r] = std::min(step_[r], size_[r] - slab_low_[r]);
    std::memset(words_, 0,
                static_cast<std::size_t>(slab_size_[0]) / 8 * static_cast<std::size_t>(slab_size_[1]) *
                    static_cast<std::size_t>(slab_size_[2]));
    mark_tiles();
    cursor_ = 0;
    return true;
}

int BandMarker::collect(std::int32_t* x, std::int32_t* y, std::int32_t* z, int capacity) {
    const int row = slab_size_[0] / 64;
    const std::size_t words = static_cast<std::size_t>(row) * static_cast<std::size_t>(slab_size_[1]) *
                              static_cast<std::size_t>(slab_size_[2]);
    int count = 0;
    for (; cursor_ < words; ++cursor_) {
        if (words_[cursor_] == 0) continue;
        const std::size_t line = cursor_ / static_cast<std::size_t>(row);
        const int low_x = static_cast<int>(cursor_ % static_cast<std::size_t>(row)) * 64,
                  at_y = slab_low_[1] + static_cast<int>(line % static_cast<std::size_t>(slab_size_[1])),
                  at_z = slab_low_[2] + static_cast<int>(line / static_cast<std::size_t>(slab_size_[1]));
        while (words_[cursor_] != 0) {
            if (count == capacity) return count;
            const int at_x = low_x + std::countr_zero(words_[cursor_]);
            words_[cursor_] &= words_[cursor_] - 1;
            if (!chunk_in_range({origin_.x + at_x, origin_.y + at_y, origin_.z + at_z})) continue;
            x[count] = at_x;
            y[count] = at_y;
            z[count++] = at_z;
        }
    }
    return count;
}

}  // namespace burin
