// SPDX-License-Identifier: MIT
#include "depth/depth_image.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/rounding.h"
#include "depth/filters.h"
#include "simd/tsdf.h"

namespace burin {
namespace {

constexpr int kSlack = 64;  // elements past the last row, so that vector loads may overrun

std::size_t bordered(int width, int height) {
    return (static_cast<std::size_t>(width) + 2) * (static_cast<std::size_t>(height) + 2) + kSlack;
}

struct Conversion {
    float min_m, max_m, unit_m;  // unit of the result
    float raw_to_m;              // of the input
    bool raw_is_result;          // u16 input whose unit is kept
};

// One reading to the stored unit; 0 when invalid or out of range.
inline std::uint16_t convert(float metres, const Conversion& c) {
    if (!(metres >= c.min_m && metres <= c.max_m)) return 0;  // NaN fails too
    return static_cast<std::uint16_t>(std::clamp(static_cast<int>(metres / c.unit_m + 0.5f), 1, 65534));
}

inline std::uint16_t convert(std::uint16_t raw, const Conversion& c) {
    if (raw == 0 || raw == 65535) return 0;
    const float metres = static_cast<float>(raw) * c.raw_to_m;
    if (c.raw_is_result) return metres >= c.min_m && metres <= c.max_m ? raw : std::uint16_t{0};
    return convert(metres, c);
}

template <class T>
void convert_rows(View<const T> in, const Camera& camera, const Conversion& c, std::uint16_t* out, int stride,
                  Jobs& jobs) {
    Camera ideal = camera;
    ideal.k1 = ideal.k2 = ideal.p1 = ideal.p2 = ideal.k3 = 0;
    jobs.run(in.height, [&](int y, int) {
        std::uint16_t* to = out + static_cast<std::ptrdiff_t>(y + 1) * stride + 1;
        if (!camera.distorted()) {
            const T* from = in.row(y);
            for (int x = 0; x < in.width; ++x) {
                if constexpr (sizeof(T) == 2)
                    to[x] = convert(from[x], c);
                else
                    to[x] = convert(from[x] * c.raw_to_m, c);
            }
            return;
        }
        // Rectification: where does the ideal ray of this pixel fall in the recorded image? Nearest reading,
        // since depths must not be mixed across an edge.
        for (int x = 0; x < in.width; ++x) {
            const Pixel p =
                project(camera, unproject(ideal, {static_cast<double>(x), static_cast<double>(y)}));
            to[x] = 0;
            if (!(p.u >= -0.5 && p.v >= -0.5 && p.u < in.width - 0.5 && p.v < in.height - 0.5)) continue;
            const T raw = in.at(static_cast<int>(p.u + 0.5), static_cast<int>(p.v + 0.5));
            if constexpr (sizeof(T) == 2)
                to[x] = convert(raw, c);
            else
                to[x] = convert(raw * c.raw_to_m, c);
        }
    });
}

// Observation weight of every pixel in units of 1/kWeightOne.
void weigh(const DepthImage& image, const DepthOptions& options, std::uint16_t* weights, Jobs& jobs) {
    jobs.run(image.height, [&](int y, int) {
        for (int x = 0; x < image.width; ++x) {
            const int i = (y + 1) * image.stride + x + 1;
            weights[i] = 0;
            if (image.pixels[i] == 0) continue;
            const float z = static_cast<float>(image.pixels[i]) * image.unit_m;
            float w = simd::kWeightOne;
            if (options.inverse_z2_weight) w = std::min(w / (z * z), 4.0f * simd::kWeightOne);
            if (options.angle_weight) {
                const Camera& c = image.camera;
                const Vec3f ray = {
                    (static_cast<float>(x) - static_cast<float>(c.cx)) / static_cast<float>(c.fx),
                    (static_cast<float>(y) - static_cast<float>(c.cy)) / static_cast<float>(c.fy), 1.0f};
                const Vec3f n = normal_at(image, x, y);
                // Without a normal (isolated reading) the weight of 84 degrees.
                w *= std::max(0.1f, -dot(n, ray) / norm(ray));
            }
            weights[i] = static_cast<std::uint16_t>(std::max(1, round_to_int(w)));
        }
    });
}

}  // namespace

DepthRange DepthTiles::over(int x0, int y0, int x1, int y1) const {
    x0 = std::max(x0, 0) / kTile;
    y0 = std::max(y0, 0) / kTile;
    x1 = std::min(x1 / kTile, width[0] - 1);
    y1 = std::min(y1 / kTile, height[0] - 1);
    DepthRange range{0, 0};
    if (x1 < x0 || y1 < y0) return range;
    // The level at which the box spans at most 2 x 2 tiles.
    int n = 0;
    while (n + 1 < levels && ((x1 >> n) - (x0 >> n) > 1 || (y1 >> n) - (y0 >> n) > 1)) ++n;
    for (int y = y0 >> n; y <= y1 >> n; ++y)
        for (int x = x0 >> n; x <= x1 >> n; ++x) {
            const DepthRange tile = level[n][static_cast<std::ptrdiff_t>(y) * width[n] + x];
            if (tile.largest == 0) continue;
            range.least = range.largest == 0 ? tile.least : std::min(range.least, tile.least);
            range.largest = std::max(range.largest, tile.largest);
        }
    return range;
}

void DepthStage::place(Arena& arena, const DepthOptions& options) {
    options_ = options;
    const std::size_t n = bordered(options.max_width, options.max_height);
    pixels_ = arena.allocate<std::uint16_t>(n, 64);
    if (options.bilateral || options.edge_removal) scratch_ = arena.allocate<std::uint16_t>(n, 64);
    if (options.weighted()) weights_ = arena.allocate<std::uint16_t>(n, 64);
    std::size_t tiles_in_all = 0;
    int w = (options.max_width + DepthTiles::kTile - 1) / DepthTiles::kTile;
    int h = (options.max_height + DepthTiles::kTile - 1) / DepthTiles::kTile;
    for (int level = 0; level < DepthTiles::kMaxLevels; ++level) {
        tiles_in_all += static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
        w = (w + 1) / 2;
        h = (h + 1) / 2;
    }
    ranges_ = arena.allocate<DepthRange>(tiles_in_all, 64);
}

void DepthStage::prepare(const FrameView& frame, Jobs& jobs) {
    const bool is_u16 = !frame.depth_u16.empty();
    const int width = is_u16 ? frame.depth_u16.width : frame.depth_f32.width;
    const int height = is_u16 ? frame.depth_u16.height : frame.depth_f32.height;
    const float fine_unit_m = options_.max_depth_m / 65534.0f;
    const bool raw_is_result = is_u16 && !options_.bilateral;  // a filter wants finer steps than a sensor's
    Conversion conversion{options_.min_depth_m, options_.max_depth_m,
                          raw_is_result ? static_cast<float>(frame.depth_unit_m) : fine_unit_m,
                          static_cast<float>(frame.depth_unit_m), raw_is_result};

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
    if (is_u16)
        convert_rows(frame.depth_u16, frame.depth_camera, conversion, pixels_, image.stride, jobs);
    else
        convert_rows(frame.depth_f32, frame.depth_camera, conversion, pixels_, image.stride, jobs);

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
        weigh(image, options_, weights_, jobs);
        image.weights = weights_;
    }
    build_tiles(jobs);
}

void DepthStage::build_tiles(Jobs& jobs) {
    constexpr int kTile = DepthTiles::kTile;
    tiles = {};
    tiles.width[0] = (image.width + kTile - 1) / kTile;
    tiles.height[0] = (image.height + kTile - 1) / kTile;
    tiles.level[0] = ranges_;
    std::atomic<std::uint32_t> valid{0};
    jobs.run(tiles.height[0], [&](int ty, int) {
        std::uint32_t count = 0;
        for (int tx = 0; tx < tiles.width[0]; ++tx) {
            // 0 (no depth) wraps to 65535 in `least - 1`: it never wins the minimum.
            std::uint16_t least = 65535, largest = 0;
            for (int y = ty * kTile; y < std::min((ty + 1) * kTile, image.height); ++y)
                for (int x = tx * kTile; x < std::min((tx + 1) * kTile, image.width); ++x) {
                    const std::uint16_t d = image.at(x, y);
                    least = std::min(least, static_cast<std::uint16_t>(d - 1));
                    largest = std::max(largest, d);
                    count += d != 0;
                }
            ranges_[static_cast<std::ptrdiff_t>(ty) * tiles.width[0] + tx] = {
                largest == 0 ? std::uint16_t{0} : static_cast<std::uint16_t>(least + 1), largest};
        }
        valid.fetch_add(count, std::memory_order_relaxed);
    });
    image.valid = valid.load();

    DepthRange* next = ranges_ + static_cast<std::ptrdiff_t>(tiles.width[0]) * tiles.height[0];
    int n = 0;
    for (; n + 1 < DepthTiles::kMaxLevels && (tiles.width[n] > 1 || tiles.height[n] > 1); ++n) {
        const int w = tiles.width[n], h = tiles.height[n];
        tiles.width[n + 1] = (w + 1) / 2;
        tiles.height[n + 1] = (h + 1) / 2;
        tiles.level[n + 1] = next;
        for (int y = 0; y < tiles.height[n + 1]; ++y)
            for (int x = 0; x < tiles.width[n + 1]; ++x) {
                DepthRange range{0, 0};
                for (int k = 0; k < 4; ++k) {
                    const int sx = 2 * x + (k & 1), sy = 2 * y + (k >> 1);
                    if (sx >= w || sy >= h) continue;
                    const DepthRange r = tiles.level[n][static_cast<std::ptrdiff_t>(sy) * w + sx];
                    if (r.largest == 0) continue;
                    range.least = range.largest == 0 ? r.least : std::min(range.least, r.least);
                    range.largest = std::max(range.largest, r.largest);
                }
                *next++ = range;
            }
    }
    tiles.levels = n + 1;
    const DepthRange all = tiles.level[n][0];
    image.nearest_m = static_cast<float>(all.least) * image.unit_m;
    image.farthest_m = static_cast<float>(all.largest) * image.unit_m;
}

}  // namespace burin
