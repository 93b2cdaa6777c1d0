// SPDX-License-Identifier: MIT
#include "track/grey_image.h"

#include <algorithm>
#include <cmath>

namespace burin {
namespace {

constexpr int kRowsPerItem = 15;  // rows of blocks: some 50 us

// Sum of the luma of `count` pixels from (x, y) on, in units of 1/256.
template <int kBytes, bool kSwapped>
int colour_luma(const FrameView& f, int x, int y, int count) {
    const std::uint8_t* p = f.colour.row(y) + kBytes * x;
    int sum = 0;
    for (int i = 0; i < count; ++i, p += kBytes)
        sum += luma_256(p[kSwapped ? 2 : 0], p[1], p[kSwapped ? 0 : 2]);
    return sum;
}
int grey_luma(const FrameView& f, int x, int y, int count) {
    const std::uint8_t* p = f.colour.row(y) + x;
    int sum = 0;
    for (int i = 0; i < count; ++i) sum += p[i];
    return 256 * sum;
}
int yuyv_luma(const FrameView& f, int x, int y, int count) {
    const std::uint8_t* p = f.colour.row(y) + 2 * x;
    int sum = 0;
    for (int i = 0; i < count; ++i) sum += std::clamp(298 * (p[2 * i] - 16), 0, 65280);  // 255 / 219
    return sum;
}

using Luma = int (*)(const FrameView& f, int x, int y, int count);
constexpr Luma kLuma[] = {  // by PixelFormat
    colour_luma<3, false>,
    colour_luma<3, true>,
    colour_luma<4, false>,
    colour_luma<4, true>,
    grey_luma,
    yuyv_luma,
    grey_luma,
    grey_luma};

}  // namespace

void GreyImage::place(Arena& arena) { blocks_ = arena.allocate<float>(TrackPoints::kMostPoints, 64); }

bool GreyImage::build(const FrameView& frame, Jobs& jobs) {
    if (frame.colour.empty()) return false;
    side_ = TrackPoints::block_side(frame.colour_camera.width, frame.colour_camera.height);
    width_ = frame.colour_camera.width / side_;
    height_ = frame.colour_camera.height / side_;
    const Luma luma = kLuma[static_cast<int>(frame.colour_format)];
    const float scale = 1.0f / (256.0f * static_cast<float>(side_ * side_));
    jobs.run((height_ + kRowsPerItem - 1) / kRowsPerItem, [&](int item, int) {
        for (int row = item * kRowsPerItem; row < std::min(height_, (item + 1) * kRowsPerItem); ++row)
            for (int column = 0; column < width_; ++column) {
                std::int64_t sum = 0;
                for (int v = 0; v < side_; ++v) sum += luma(frame, column * side_, row * side_ + v, side_);
                blocks_[row * width_ + column] = static_cast<float>(sum) * scale;
            }
    });
    return true;
}

float GreyImage::at(double u, double v) const {
    // Block centres lie at side * i + (side - 1) / 2.
    double x = (u + 0.5) / side_ - 0.5, y = (v + 0.5) / side_ - 0.5;
    // Rounding must not take away the outermost centres, which registered depth falls on.
    constexpr double kRounding = 1e-3;
    if (!(x >= -kRounding && y >= -kRounding && x <= width_ - 1 + kRounding && y <= height_ - 1 + kRounding))
        return -1;
    x = std::clamp(x, 0.0, width_ - 1.0);
    y = std::clamp(y, 0.0, height_ - 1.0);
    const int i = std::min(static_cast<int>(x), width_ - 2), j = std::min(static_cast<int>(y), height_ - 2);
    if (i < 0 || j < 0) return -1;  // an image of one row or column
    const float fx = static_cast<float>(x - i), fy = static_cast<float>(y - j);
    const float* p = blocks_ + j * width_ + i;
    const float above = p[0] + fx * (p[1] - p[0]), below = p[width_] + fx * (p[width_ + 1] - p[width_]);
    return above + fy * (below - above);
}

void PointBrightness::place(Arena& arena) {
    int most = TrackPoints::kMostPoints;
    for (float*& grid : grids_) {
        grid = arena.allocate<float>(static_cast<std::size_t>(most), 64);
        most /= 4;
    }
}

void PointBrightness::build(const TrackPoints& points, const GreyImage& grey, const FrameView& frame,
                            Jobs& jobs) {
    const TrackLevel& finest = points.level(0);
    const Se3& T = frame.T_colour_depth;
    jobs.run((finest.height + kRowsPerItem - 1) / kRowsPerItem, [&](int item, int) {
        const int begin = item * kRowsPerItem * finest.width,
                  end = std::min(finest.height, (item + 1) * kRowsPerItem) * finest.width;
        for (int i = begin; i < end; ++i) {
            grids_[0][i] = -1;
            if (finest.grid_z[i] == 0) continue;
            const Vec3d p = T * to_double(Vec3f{finest.grid_x[i], finest.grid_y[i], finest.grid_z[i]});
            if (!(p.z > 0)) continue;
            const Pixel pixel = project(frame.colour_camera, p);
            grids_[0][i] = grey.at(pixel.u, pixel.v);
        }
    });
    for (int k = 1; k < TrackPoints::kLevels; ++k) {
        const TrackLevel& to = points.level(k);
        const int from_width = points.level(k - 1).width;
        const float* from_z = points.level(k - 1).grid_z;
        for (int i = 0; i < to.width * to.height; ++i) {
            const int first = 2 * (i / to.width) * from_width + 2 * (i % to.width);
            float sum = 0;
            int count = 0;
            bool whole = to.grid_z[i] != 0;
            for (const int from : {first, first + 1, first + from_width, first + from_width + 1}) {
                if (from_z[from] == 0) continue;
                // Seen in part, the mean would be that of another place than the point.
                if (grids_[k - 1][from] < 0) whole = false;
                sum += grids_[k - 1][from];
                ++count;
            }
            grids_[k][i] = whole && count > 0 ? sum / static_cast<float>(count) : -1.0f;
        }
    }
}

}  // namespace burin
