// SPDX-License-Identifier: MIT
#include "track/reference_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "depth/filters.h"
#include "map/raycast.h"
#include "track/grey_image.h"

namespace burin {
namespace {

// Rows an item, as TrackPoints has them: some 50 us.
constexpr int kRows = 15;

// Depths of three cells in a row, on a plane, bend by 2 z (slope / f)^2: 3 % are a slope of 86 degrees at the
// 131 cells of focal length that a Kinect's finest grid has, of 76 degrees at the 33 of its coarsest.
constexpr float kMostBend = 0.03f;
// Neighbours of one surface: 5 % are a slope of 81 degrees on the finest grid, of 59 on the coarsest.
constexpr float kMostStep = 0.05f;

// The difference of positions across `cell` along one axis; false when neither neighbour is of its surface.
bool along(const PointGrid& grid, int cell, int step, bool has_before, bool has_after, Vec3f* difference) {
    const float* z = grid.z;
    const float here = z[cell];
    int before = cell - step, after = cell + step;
    has_before = has_before && z[before] > 0;
    has_after = has_after && z[after] > 0;
    const float noise = 4.0f * axial_noise_m(here);
    const bool smooth = has_before && has_after &&
                        std::fabs((z[before] + z[after]) - 2.0f * here) <= kMostBend * here + noise;
    if (!smooth) {
        const float limit = kMostStep * here + noise;
        const float to_before = has_before ? std::fabs(here - z[before]) : limit;
        const float to_after = has_after ? std::fabs(here - z[after]) : limit;
        if (std::min(to_before, to_after) >= limit) return false;
        (to_before < to_after ? after : before) = cell;
    }
    *difference = {grid.x[after] - grid.x[before], grid.y[after] - grid.y[before], z[after] - z[before]};
    return true;
}

}  // namespace

Vec3f grid_normal(const PointGrid& grid, int cell) {
    const int column = cell % grid.width, row = cell / grid.width;
    Vec3f right, down;
    if (!(grid.z[cell] > 0) || !along(grid, cell, 1, column > 0, column < grid.width - 1, &right) ||
        !along(grid, cell, grid.width, row > 0, row < grid.height - 1, &down))
        return {};
    return normalised(cross(down, right));
}

void ReferenceView::place(Arena& arena, int max_width, int max_height) {
    int cells = std::min(max_width * max_height, TrackPoints::kMostPoints);
    for (Level& level : levels_) {
        for (int k = 0; k < 3; ++k) {
            level.point[k] = arena.allocate<float>(static_cast<std::size_t>(cells), 64);
            level.normal[k] = arena.allocate<float>(static_cast<std::size_t>(cells), 64);
        }
        const auto room = static_cast<std::size_t>(cells);
        if (&level != levels_) level.grey = arena.allocate<float>(room, 64);
        if (&level == levels_ + 1) rgb_ = arena.allocate<std::uint8_t>(3 * room, 64);
        cells = std::max(cells / 4, 1);
    }
}

simd::SurfaceGrid ReferenceView::grid(int level) const {
    const Level& from = levels_[std::max(level, finest_)];
    simd::SurfaceGrid out;
    out.width = from.camera.width;
    out.height = from.camera.height;
    out.fx = static_cast<float>(from.camera.fx);
    out.fy = static_cast<float>(from.camera.fy);
    out.cx = static_cast<float>(from.camera.cx);
    out.cy = static_cast<float>(from.camera.cy);
    for (int k = 0; k < 3; ++k) {
        out.point[k] = from.point[k];
        out.normal[k] = from.normal[k];
    }
    return out;
}

int ReferenceView::cells(int level) const {
    const Level& from = levels_[std::max(level, finest_)];
    int count = 0;
    for (int i = 0; i < from.camera.width * from.camera.height; ++i)
        count += from.normal[0][i] == from.normal[0][i];
    return count;
}

void ReferenceView::cast(const Volume& volume, float max_depth_m, Level& to, Jobs& jobs) {
    const Camera& camera = to.camera;
    has_grey_ = to.grey != nullptr && volume.has_colour();
    raycast(volume, camera, T_world_reference_, max_depth_m,
            {to.point[2], nullptr, has_grey_ ? rgb_ : nullptr}, jobs);
    if (has_grey_)
        for (int i = 0; i < camera.width * camera.height; ++i) {
            const std::uint8_t* c = rgb_ + 3 * i;
            const int luma = luma_256(c[0], c[1], c[2]);  // black is "no colour" there
            to.grey[i] = luma > 0 ? static_cast<float>(luma) * (1.0f / 256) : -1.0f;
        }
    const float inverse_fx = static_cast<float>(1 / camera.fx),
                inverse_fy = static_cast<float>(1 / camera.fy);
    const float cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);
    for (int row = 0; row < camera.height; ++row)
        for (int column = 0; column < camera.width; ++column) {
            const int at = row * camera.width + column;
            const float z = to.point[2][at];
            to.point[0][at] = z * ((static_cast<float>(column) - cx) * inverse_fx);
            to.point[1][at] = z * ((static_cast<float>(row) - cy) * inverse_fy);
        }
}

// As TrackPoints makes its coarser levels: the mean of at least two of four cells, all on one surface.
void ReferenceView::merge(const Level& from, Level& to) {
    for (int row = 0; row < to.camera.height; ++row)
        for (int column = 0; column < to.camera.width; ++column) {
            float sum[3] = {}, least = 1e30f, most = 0, grey = 0;
            int count = 0, bright = 0;
            for (int i = 0; i < 4; ++i) {
                const int at = (2 * row + i / 2) * from.camera.width + 2 * column + i % 2;
                const float z = from.point[2][at];
                if (z == 0) continue;
                ++count;
                least = std::min(least, z);
                most = std::max(most, z);
                for (int k = 0; k < 3; ++k) sum[k] += from.point[k][at];
                if (from.grey == nullptr || from.grey[at] < 0) continue;
                ++bright;
                grey += from.grey[at];
            }
            const float inverse = count > 0 ? 1.0f / static_cast<float>(count) : 0.0f;
            const float z = sum[2] * inverse;
            // A cell's diagonal is two steps.
            const bool one_surface = count >= 2 && most - least < 2 * kMostStep * z + 4.0f * axial_noise_m(z);
            for (int k = 0; k < 3; ++k)
                to.point[k][row * to.camera.width + column] = one_surface ? sum[k] * inverse : 0.0f;
            to.grey[row * to.camera.width + column] = bright > 0 ? grey / static_cast<float>(bright) : -1.0f;
        }
}

void ReferenceView::add_normals(Level& level, Jobs& jobs) {
    const int width = level.camera.width, height = level.camera.height;
    const PointGrid grid{width, height, level.point[0], level.point[1], level.point[2]};
    jobs.run((height + kRows - 1) / kRows, [&](int item, int) {
        const int end = std::min(height, (item + 1) * kRows);
        for (int at = item * kRows * width; at < end * width; ++at) {
            const Vec3f n = grid_normal(grid, at);
            const bool there = n.x != 0 || n.y != 0 || n.z != 0;
            for (int k = 0; k < 3; ++k)
                level.normal[k][at] = there ? n[k] : std::numeric_limits<float>::quiet_NaN();
        }
    });
}

void ReferenceView::look_from(const Volume& volume, const Camera& camera, const Se3& T_world_reference,
                              float max_depth_m, int finest, Jobs& jobs) {
    T_world_reference_ = T_world_reference;
    finest_ = finest;
    has_grey_ = false;
    for (int i = finest; i < TrackPoints::kLevels; ++i) {
        Level& level = levels_[i];
        level.camera = at_level(camera, i);
        // A cast of its own at each level costs a third more and gains nothing (docs/tracking.md).
        if (i == finest)
            cast(volume, max_depth_m, level, jobs);
        else
            merge(levels_[i - 1], level);
        add_normals(level, jobs);
    }
}

void ReferenceView::look_at_frame(const TrackPoints& points, const Se3& T_world_reference, Jobs& jobs) {
    T_world_reference_ = T_world_reference;
    finest_ = 0;
    has_grey_ = false;
    for (int i = 0; i < TrackPoints::kLevels; ++i) {
        const TrackLevel& from = points.level(i);
        Level& to = levels_[i];
        to.camera = from.camera;
        const int cells = from.width * from.height;
        std::copy_n(from.grid_x, cells, to.point[0]);
        std::copy_n(from.grid_y, cells, to.point[1]);
        std::copy_n(from.grid_z, cells, to.point[2]);
        add_normals(to, jobs);
    }
}

}  // namespace burin
