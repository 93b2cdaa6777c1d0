// SPDX-License-Identifier: MIT
#include "map/band_marker.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace burin {
namespace {

constexpr int kTile = DepthTiles::kTile;

// Rounding of pixels and coordinates here and in observe_chunk differs by far less than these.
constexpr float kPixelMargin = 0.51f;  // half a pixel, since integration reads the nearest one
constexpr float kVoxelMargin = 0.02f;

int tiles_of(int pixels) { return (pixels + kTile - 1) / kTile; }
int whole_vectors(int count) { return (count + 15) & ~15; }  // band_boxes works on 16 at a time

}  // namespace

void BandMarker::place(Arena& arena, int max_width, int max_height) {
    const auto columns = static_cast<std::size_t>(whole_vectors(tiles_of(max_width))),
               rows = static_cast<std::size_t>(tiles_of(max_height));
    words_ = arena.allocate<std::uint64_t>(kGridBits / 64, 64);
    boxes_ = arena.allocate<simd::ChunkBox>(columns * rows, 64);
    row_bounds_ = arena.allocate<simd::ChunkBox>(rows, 64);
    tile_u_ = arena.allocate<float>(columns, 64);
}

void BandMarker::begin(const DepthImage& image, const DepthTiles& tiles, const Se3& T,
                       const simd::TruncationModel& truncation, float voxel_m, Jobs& jobs) {
    image_ = &image;
    tiles_ = &tiles;
    started_ = false;
    cursor_ = kGridBits;  // nothing to read yet
    size_[0] = size_[1] = size_[2] = 0;
    if (image.valid == 0) return;

    const double chunk_m = static_cast<double>(voxel_m) * kChunkSide;
    const Camera& c = image.camera;
    simd::BandView& view = tile_view_;
    for (int r = 0; r < 3; ++r) {
        view.slope_u[r] = static_cast<float>(T.R(r, 0) / c.fx / chunk_m);
        view.slope_v[r] = static_cast<float>(T.R(r, 1) / c.fy / chunk_m);
        view.slope_1[r] =
            static_cast<float>((T.R(r, 2) - T.R(r, 0) * c.cx / c.fx - T.R(r, 1) * c.cy / c.fy) / chunk_m);
    }
    view.unit_m = image.unit_m;
    view.deep_m = static_cast<float>(2 * chunk_m);  // beyond this a tile's box holds mostly air
    view.truncation = truncation;
    pixel_view_ = view;
    for (int r = 0; r < 3; ++r) {
        const float across = std::fabs(view.slope_u[r]) + std::fabs(view.slope_v[r]);
        view.half_slope[r] = across * (0.5f * (kTile - 1) + kPixelMargin);
        pixel_view_.half_slope[r] = across * kPixelMargin;
    }
    place_window(T, voxel_m);
    jobs_ = &jobs;
    box_tiles(jobs);
}

// The box of chunks around the whole view: the boxes of its near and far ends, by the view's own ranges.
void BandMarker::place_window(const Se3& T, float voxel_m) {
    const double chunk_m = static_cast<double>(voxel_m) * kChunkSide;
    const float half_u = 0.5f * static_cast<float>(image_->width),
                half_v = 0.5f * static_cast<float>(image_->height);
    const simd::BandView& view = tile_view_;
    const float reach = view.truncation.at(image_->farthest_m);
    const float near = std::max(image_->nearest_m - reach, 0.0f), far = image_->farthest_m + reach;
    for (int r = 0; r < 3; ++r) {
        // Origin near the camera first, to find the window in small numbers; then its low corner. One chunk
        // more on either side stands for all roundings.
        const double camera = std::floor(std::clamp(T.t[r] / chunk_m, -2.0 * kChunkLimit, 2.0 * kChunkLimit));
        const double start = T.t[r] / chunk_m - camera;
        const float slope =
            view.slope_u[r] * (half_u - 0.5f) + view.slope_v[r] * (half_v - 0.5f) + view.slope_1[r];
        const float half =
            std::fabs(view.slope_u[r]) * (half_u + 1) + std::fabs(view.slope_v[r]) * (half_v + 1);
        const float left = slope - half, right = slope + half;
        const int low =
            static_cast<int>(std::floor(std::min(near * left, far * left) + static_cast<float>(start))) - 1;
        const int high =
            static_cast<int>(std::floor(std::max(near * right, far * right) + static_cast<float>(start))) + 1;
        origin_[r] = static_cast<std::int32_t>(camera) + low;
        size_[r] = high - low + 1;
        // Voxel i of a chunk has its centre at (i + 1/2) / 8: the first chunk with a centre at or above the
        // low end, the last with one at or below the high end.
        for (simd::BandView* v : {&tile_view_, &pixel_view_}) {
            v->start_low[r] =
                static_cast<float>(start - low + (0.5 - static_cast<double>(kVoxelMargin)) / kChunkSide);
            v->start_high[r] =
                static_cast<float>(start - low - (0.5 - static_cast<double>(kVoxelMargin)) / kChunkSide);
        }
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

void BandMarker::box_tiles(Jobs& jobs) {
    const int columns = tiles_->width;
    box_stride_ = whole_vectors(columns);
    for (int x = 0; x < box_stride_; ++x) tile_u_[x] = static_cast<float>(x * kTile) + 0.5f * (kTile - 1);
    jobs.run(tiles_->height, [&](int ty, int) {
        float v[16];
        std::uint32_t ranges[16];
        std::fill_n(v, 16, static_cast<float>(ty * kTile) + 0.5f * (kTile - 1));
        simd::ChunkBox* row = boxes_ + static_cast<std::ptrdiff_t>(ty) * box_stride_;
        simd::ChunkBox bounds{{65535, 65535, 65535}, simd::ChunkBox::kNone, {0, 0, 0}, 0};
        for (int x = 0; x < columns; x += 16) {
            const int count = std::min(16, columns - x);
            std::fill_n(ranges, 16, 0u);
            std::memcpy(ranges, tiles_->ranges + static_cast<std::ptrdiff_t>(ty) * columns + x,
                        static_cast<std::size_t>(count) * sizeof(DepthRange));
            simd::band_boxes(tile_view_, tile_u_ + x, v, ranges, 16, row + x);
        }
        for (int x = 0; x < columns; ++x) {
            if (row[x].kind == simd::ChunkBox::kNone) continue;
            bounds.kind = simd::ChunkBox::kBox;
            for (int r = 0; r < 3; ++r) {
                bounds.low[r] = std::min(bounds.low[r], row[x].low[r]);
                bounds.high[r] = std::max(bounds.high[r], row[x].high[r]);
            }
        }
        row_bounds_[ty] = bounds;
    });
}

// Most bits are set already, by the tile beside. Several threads set the others.
inline void BandMarker::set_bits(std::uint64_t* word, std::uint64_t bits) const {
    if ((__atomic_load_n(word, __ATOMIC_RELAXED) & bits) == bits) return;
    if (jobs_->threads() == 1)
        *word |= bits;
    else
        __atomic_fetch_or(word, bits, __ATOMIC_RELAXED);
}

void BandMarker::mark(const simd::ChunkBox& box) {
    int low[3], high[3];
    for (int r = 0; r < 3; ++r) {
        low[r] = std::max(box.low[r] - slab_low_[r], 0);
        high[r] = std::min(box.high[r] - slab_low_[r], slab_size_[r] - 1);
        if (low[r] > high[r]) return;
    }
    const int first = low[0] >> 6, last = high[0] >> 6;
    const std::uint64_t from = ~std::uint64_t{0} << (low[0] & 63),
                        to = ~std::uint64_t{0} >> (63 - (high[0] & 63));
    const std::ptrdiff_t row_words = slab_size_[0] / 64;
    for (int z = low[2]; z <= high[2]; ++z) {
        std::uint64_t* row = words_ + (static_cast<std::ptrdiff_t>(z) * slab_size_[1] + low[1]) * row_words;
        for (int y = low[1]; y <= high[1]; ++y, row += row_words) {
            if (first == last) {
                set_bits(&row[first], from & to);
                continue;
            }
            set_bits(&row[first], from);
            for (int word = first + 1; word < last; ++word) set_bits(&row[word], ~std::uint64_t{0});
            set_bits(&row[last], to);
        }
    }
}

void BandMarker::mark_row(int ty) {
    const auto same = [](const simd::ChunkBox& a, const simd::ChunkBox& b) {
        return std::memcmp(&a, &b, sizeof a) == 0;
    };
    const simd::ChunkBox& bounds = row_bounds_[ty];
    bool apart = bounds.kind == simd::ChunkBox::kNone;
    for (int r = 1; r < 3; ++r)
        apart |= bounds.high[r] < slab_low_[r] || bounds.low[r] >= slab_low_[r] + slab_size_[r];
    if (apart) return;
    const simd::ChunkBox* row = boxes_ + static_cast<std::ptrdiff_t>(ty) * box_stride_;
    for (int tx = 0; tx < tiles_->width; ++tx) {
        const simd::ChunkBox& box = row[tx];
        if (box.kind == simd::ChunkBox::kNone) continue;
        if (box.kind == simd::ChunkBox::kDeep) {
            mark_deep(tx, ty);
            continue;
        }
        if (tx > 0 && same(box, row[tx - 1])) continue;
        if (ty > 0 && same(box, row[tx - box_stride_])) continue;
        mark(box);
    }
}

// A tile across a jump in depth: as its nearer and its farther half of the range, if these are not deep too.
void BandMarker::mark_deep(int tx, int ty) {
    const DepthRange range = tiles_->ranges[static_cast<std::ptrdiff_t>(ty) * tiles_->width + tx];
    const int middle = (range.least + range.largest) / 2;
    int near_largest = 0, far_least = 65535;
    for (int y = ty * kTile; y < std::min((ty + 1) * kTile, image_->height); ++y)
        for (int x = tx * kTile; x < std::min((tx + 1) * kTile, image_->width); ++x) {
            const int raw = image_->at(x, y);
            if (raw <= middle)
                near_largest = std::max(near_largest, raw);
            else
                far_least = std::min(far_least, raw);
        }
    float u[16], v[16];
    std::fill_n(u, 16, tile_u_[tx]);
    std::fill_n(v, 16, static_cast<float>(ty * kTile) + 0.5f * (kTile - 1));
    const std::uint32_t halves[16] = {
        static_cast<std::uint32_t>(range.least) | static_cast<std::uint32_t>(near_largest) << 16,
        static_cast<std::uint32_t>(far_least) | static_cast<std::uint32_t>(range.largest) << 16};
    simd::ChunkBox boxes[16];
    simd::band_boxes(tile_view_, u, v, halves, 2, boxes);
    if (boxes[0].kind == simd::ChunkBox::kDeep || boxes[1].kind == simd::ChunkBox::kDeep)
        return mark_pixels(tx, ty);
    mark(boxes[0]);
    mark(boxes[1]);
}

// A tile with readings all over a deep range: pixel by pixel.
void BandMarker::mark_pixels(int tx, int ty) {
    static_assert(kTile * kTile == 16);
    float u[16], v[16];
    std::uint32_t ranges[16];
    for (int i = 0; i < 16; ++i) {
        const int x = tx * kTile + i % kTile, y = ty * kTile + i / kTile;
        const std::uint32_t raw = x < image_->width && y < image_->height ? image_->at(x, y) : 0u;
        u[i] = static_cast<float>(x);
        v[i] = static_cast<float>(y);
        ranges[i] = raw | raw << 16;
    }
    simd::ChunkBox boxes[16];
    simd::band_boxes(pixel_view_, u, v, ranges, 16, boxes);
    for (const simd::ChunkBox& box : boxes)
        if (box.kind != simd::ChunkBox::kNone) mark(box);
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
    constexpr int kRowsPerItem = 8;  // some 10 us
    jobs_->run((tiles_->height + kRowsPerItem - 1) / kRowsPerItem, [&](int item, int) {
        for (int ty = item * kRowsPerItem; ty < std::min((item + 1) * kRowsPerItem, tiles_->height); ++ty)
            mark_row(ty);
    });
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
