// SPDX-License-Identifier: MIT
#include "depth/depth_image.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include "depth/filters.h"
#include "depth/row_blocks.h"
#include "simd/depth_filters.h"
#include "simd/tsdf.h"

namespace burin {
namespace {

constexpr int kSlack = 64;  // elements past the last row, so that vector loads may overrun
static_assert(kSlack >= simd::kOverread);

std::size_t bordered(int width, int height) {
    return (static_cast<std::size_t>(width) + 2) * (static_cast<std::size_t>(height) + 2) + kSlack;
}

// Rectification: where does the ideal ray of a pixel fall in the recorded image? Nearest reading, since
// depths must not be mixed across an edge. Columns x0..x1-1 of row y.
template <class T>
void rectify(View<const T> in, const Camera& camera, const Camera& ideal, int y, int x0, int x1, T* out) {
    for (int x = x0; x < x1; ++x) {
        const Pixel p = project(camera, unproject(ideal, {static_cast<double>(x), static_cast<double>(y)}));
        const bool inside = p.u >= -0.5 && p.v >= -0.5 && p.u < in.width - 0.5 && p.v < in.height - 0.5;
        *out++ = inside ? in.at(static_cast<int>(p.u + 0.5), static_cast<int>(p.v + 0.5)) : T{0};
    }
}

void drop_unsure(const std::uint8_t* confidence, int count, std::uint8_t least, std::uint16_t* depth) {
    for (int x = 0; x < count; ++x) depth[x] = confidence[x] < least ? std::uint16_t{0} : depth[x];
}

// convert(readings, count, out) for every row, or for the pieces of a rectified one; what the sensor is not
// sure of becomes 0.
template <class T, class Convert>
void convert_rows(View<const T> in, const FrameView& frame, const DepthImage& image, std::uint16_t* out,
                  Jobs& jobs, Convert&& convert) {
    const Camera& camera = frame.depth_camera;
    const bool unsure = !frame.confidence.empty() && frame.min_confidence > 0;
    for_row_blocks(in.height, jobs, [&](int y) {
        std::uint16_t* to = out + image.offset(0, y);
        if (!camera.distorted()) {
            convert(in.row(y), in.width, to);
            if (unsure) drop_unsure(frame.confidence.row(y), in.width, frame.min_confidence, to);
            return;
        }
        constexpr int kPiece = 512;  // 2 KiB of stack
        T rectified[kPiece];
        std::uint8_t confidence[kPiece];
        for (int x = 0; x < in.width; x += kPiece) {
            const int end = std::min(x + kPiece, in.width);
            rectify(in, camera, image.camera, y, x, end, rectified);
            convert(rectified, end - x, to + x);
            if (!unsure) continue;
            rectify(frame.confidence, camera, image.camera, y, x, end, confidence);
            drop_unsure(confidence, end - x, frame.min_confidence, to + x);
        }
    });
}

}  // namespace

void DepthStage::place(Arena& arena, const DepthOptions& options) {
    options_ = options;
    const std::size_t n = bordered(options.max_width, options.max_height);
    pixels_ = arena.allocate<std::uint16_t>(n, 64);
    if (options.bilateral || options.edge_removal) scratch_ = arena.allocate<std::uint16_t>(n, 64);
    if (options.weighted()) weights_ = arena.allocate<std::uint16_t>(n, 64);
    const auto tiles_of = [](int pixels) {
        return static_cast<std::size_t>((pixels + DepthTiles::kTile - 1) / DepthTiles::kTile);
    };
    ranges_ = arena.allocate<DepthRange>(tiles_of(options.max_width) * tiles_of(options.max_height), 64);
}

void DepthStage::prepare(const FrameView& frame, Jobs& jobs) {
    const bool is_u16 = !frame.depth_u16.empty();
    const int width = is_u16 ? frame.depth_u16.width : frame.depth_f32.width;
    const int height = is_u16 ? frame.depth_u16.height : frame.depth_f32.height;
    const float fine_unit_m = options_.max_depth_m / 65534.0f;
    const bool raw_is_result = is_u16 && !options_.bilateral;  // a filter wants finer steps than a sensor's
    const simd::DepthConversion conversion{
        options_.min_depth_m, options_.max_depth_m, static_cast<float>(frame.depth_unit_m),
        raw_is_result ? static_cast<float>(frame.depth_unit_m) : fine_unit_m};

    image = {};
    image.width = width;
    image.height = height;
    image.stride = width + 2;
    image.unit_m = conversion.unit_m;
    image.camera = frame.depth_camera;
    image.camera.k1 = image.camera.k2 = image.camera.p1 = image.camera.p2 = image.camera.k3 = 0;
    image.pixels = pixels_;
    for (std::uint16_t* plane : {pixels_, scratch_, weights_}) {
        if (!plane) continue;
        std::fill_n(plane, image.stride, std::uint16_t{0});
        std::fill_n(plane + static_cast<std::size_t>(image.stride) * (height + 1), image.stride + kSlack,
                    std::uint16_t{0});
        for (int y = 1; y <= height; ++y) {
            plane[static_cast<std::ptrdiff_t>(y) * image.stride] = 0;
            plane[static_cast<std::ptrdiff_t>(y) * image.stride + width + 1] = 0;
        }
    }
    if (!is_u16) {
        convert_rows(
            frame.depth_f32, frame, image, pixels_, jobs,
            [&](const float* in, int n, std::uint16_t* out) { simd::convert_f32(in, n, conversion, out); });
    } else if (raw_is_result) {
        const simd::RawRange range = simd::raw_range(conversion);
        convert_rows(frame.depth_u16, frame, image, pixels_, jobs,
                     [&](const std::uint16_t* in, int n, std::uint16_t* out) {
                         simd::keep_in_range(in, n, range, out);
                     });
    } else {
        convert_rows(frame.depth_u16, frame, image, pixels_, jobs,
                     [&](const std::uint16_t* in, int n, std::uint16_t* out) {
                         simd::convert_u16(in, n, conversion, out);
                     });
    }

    // Each filter reads one plane and writes the other.
    std::uint16_t* current = pixels_;
    std::uint16_t* other = scratch_;
    if (options_.edge_removal) {
        remove_edges(image, other, jobs);
        std::swap(current, other);
        image.pixels = current;
    }
    if (options_.bilateral) {
        bilateral_filter(image, other, jobs);
        std::swap(current, other);
        image.pixels = current;
    }
    if (options_.weighted()) {
        observation_weights(image, {options_.inverse_z2_weight, options_.angle_weight, simd::kWeightOne},
                            weights_, jobs);
        image.weights = weights_;
    }
    build_tiles(jobs);
}

void DepthStage::build_tiles(Jobs& jobs) {
    constexpr int kTile = DepthTiles::kTile;
    tiles = {};
    tiles.width = (image.width + kTile - 1) / kTile;
    tiles.height = (image.height + kTile - 1) / kTile;
    tiles.ranges = ranges_;
    std::atomic<std::uint32_t> valid{0};
    constexpr int kTileRows = kRowBlock / kTile;
    jobs.run((tiles.height + kTileRows - 1) / kTileRows, [&](int block, int) {
        int count = 0;
        for (int ty = block * kTileRows; ty < std::min(tiles.height, (block + 1) * kTileRows); ++ty)
            count += simd::tile_ranges(image.pixels + image.offset(0, ty * kTile), image.stride,
                                       std::min(kTile, image.height - ty * kTile), image.width,
                                       ranges_ + static_cast<std::ptrdiff_t>(ty) * tiles.width);
        valid.fetch_add(static_cast<std::uint32_t>(count), std::memory_order_relaxed);
    });
    image.valid = valid.load();

    // 0 (no depth) wraps to 65535 in `least - 1`: it never wins the minimum.
    std::uint16_t below = 65535, largest = 0;
    const std::ptrdiff_t count = static_cast<std::ptrdiff_t>(tiles.width) * tiles.height;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        below = std::min(below, static_cast<std::uint16_t>(ranges_[i].least - 1));
        largest = std::max(largest, ranges_[i].largest);
    }
    if (largest > 0) tiles.all = {static_cast<std::uint16_t>(below + 1), largest};
    image.nearest_m = static_cast<float>(tiles.all.least) * image.unit_m;
    image.farthest_m = static_cast<float>(tiles.all.largest) * image.unit_m;
}

}  // namespace burin
