// SPDX-License-Identifier: MIT
#include "track/track_points.h"

#include <algorithm>
#include <cmath>

#include "depth/filters.h"

namespace burin {
namespace {

// Readings of one surface in a block of up to a few pixels spread no further: a slope of 80 degrees seen at
// 525 pixels of focal length changes 3.3 % over three pixels; and four standard deviations of noise.
float spread_limit_m(float z) { return 0.035f * z + 4.0f * axial_noise_m(z); }

}  // namespace

int TrackPoints::block_side(int width, int height) {
    int side = 1;
    while ((width / side) * (height / side) > kMostPoints) ++side;
    return side;
}

void TrackPoints::place(Arena& arena, int max_width, int max_height, float max_depth_m) {
    farthest_m_ = max_depth_m - 4.0f * axial_noise_m(max_depth_m);
    // A smaller image may have more blocks than the largest one, never more than kMostPoints.
    int most = std::min(max_width * max_height, kMostPoints);
    for (TrackLevel& level : levels_) {
        const auto room = static_cast<std::size_t>(most) + 16;
        for (float** array : {&level.grid_x, &level.grid_y, &level.grid_z, &level.x, &level.y, &level.z,
                              &level.inverse_sigma})
            *array = arena.allocate<float>(room, 64);
        level.cell = arena.allocate<int>(room, 64);
        most = std::max(most / 4, 1);
    }
}

void TrackPoints::average_blocks(const DepthImage& depth, int side, int row) {
    TrackLevel& to = levels_[0];
    const Camera& c = depth.camera;
    const float inverse_fx = static_cast<float>(1 / c.fx), inverse_fy = static_cast<float>(1 / c.fy);
    const float cx = static_cast<float>(c.cx), cy = static_cast<float>(c.cy);
    for (int column = 0; column < to.width; ++column) {
        int count = 0, sum = 0, sum_u = 0, sum_v = 0, least = 65535, most = 0;
        for (int v = 0; v < side; ++v) {
            const std::uint16_t* pixels = depth.pixels + depth.offset(column * side, row * side + v);
            for (int u = 0; u < side; ++u) {
                const int value = pixels[u];
                if (value == 0) continue;
                ++count;
                sum += value;
                sum_u += u;
                sum_v += v;
                least = std::min(least, value);
                most = std::max(most, value);
            }
        }
        const int at = row * to.width + column;
        to.grid_x[at] = to.grid_y[at] = to.grid_z[at] = 0;
        if (4 * count < side * side) continue;
        const float inverse = 1.0f / static_cast<float>(count);
        const float z = static_cast<float>(sum) * inverse * depth.unit_m;
        if (z > farthest_m_) continue;
        if (static_cast<float>(most - least) * depth.unit_m > spread_limit_m(z)) continue;
        const float u = static_cast<float>(column * side) + static_cast<float>(sum_u) * inverse;
        const float v = static_cast<float>(row * side) + static_cast<float>(sum_v) * inverse;
        to.grid_x[at] = z * ((u - cx) * inverse_fx);
        to.grid_y[at] = z * ((v - cy) * inverse_fy);
        to.grid_z[at] = z;
    }
}

void TrackPoints::merge_blocks(const TrackLevel& from, TrackLevel& to, int row) {
    for (int column = 0; column < to.width; ++column) {
        float x = 0, y = 0, z = 0, least = 1e30f, most = 0;
        int count = 0;
        for (int i = 0; i < 4; ++i) {
            const int at = (2 * row + i / 2) * from.width + 2 * column + i % 2;
            const float depth = from.grid_z[at];
            if (depth == 0) continue;
            ++count;
            x += from.grid_x[at];
            y += from.grid_y[at];
            z += depth;
            least = std::min(least, depth);
            most = std::max(most, depth);
        }
        const int at = row * to.width + column;
        to.grid_x[at] = to.grid_y[at] = to.grid_z[at] = 0;
        if (count < 2) continue;
        const float inverse = 1.0f / static_cast<float>(count);
        // Twice the slope over twice the pixels.
        if (most - least > 2 * spread_limit_m(z * inverse)) continue;
        to.grid_x[at] = x * inverse;
        to.grid_y[at] = y * inverse;
        to.grid_z[at] = z * inverse;
    }
}

void TrackPoints::list(TrackLevel& level) {
    level.count = 0;
    for (int i = 0; i < level.width * level.height; ++i) {
        const float z = level.grid_z[i];
        if (z == 0) continue;
        const int k = level.count++;
        level.x[k] = level.grid_x[i];
        level.y[k] = level.grid_y[i];
        level.z[k] = z;
        level.inverse_sigma[k] = 1.0f / axial_noise_m(z);
        level.cell[k] = i;
    }
}

void TrackPoints::build(const DepthImage& depth, Jobs& jobs) {
    const int side = block_side(depth.width, depth.height);
    for (int i = 0; i < kLevels; ++i) {
        TrackLevel& level = levels_[i];
        const int scale = side << i;
        level.width = depth.width / scale;
        level.height = depth.height / scale;
        level.camera = depth.camera;
        level.camera.width = level.width;
        level.camera.height = level.height;
        level.camera.fx /= scale;
        level.camera.fy /= scale;
        level.camera.cx = (level.camera.cx + 0.5) / scale - 0.5;
        level.camera.cy = (level.camera.cy + 0.5) / scale - 0.5;
    }
    // Fifteen rows of blocks an item: some 50 us.
    constexpr int kRows = 15;
    jobs.run((levels_[0].height + kRows - 1) / kRows, [&](int item, int) {
        const int end = std::min(levels_[0].height, (item + 1) * kRows);
        for (int row = item * kRows; row < end; ++row) average_blocks(depth, side, row);
    });
    for (int i = 1; i < kLevels; ++i)
        for (int row = 0; row < levels_[i].height; ++row) merge_blocks(levels_[i - 1], levels_[i], row);
    for (TrackLevel& level : levels_) list(level);
    double sum = 0;
    for (int i = 0; i < levels_[0].count; ++i) sum += static_cast<double>(levels_[0].z[i]);
    mean_depth_m_ = levels_[0].count > 0 ? sum / levels_[0].count : 0;
}

}  // namespace burin
