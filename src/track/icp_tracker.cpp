// SPDX-License-Identifier: MIT
#include "track/icp_tracker.h"

#include <algorithm>

#include "track/residuals.h"

namespace burin {
namespace {

// Finest first. Distance: at the finest, four standard deviations of a structured-light reading at 4 m (0.026
// m, axial_noise_m), which is the 0.1 m of KinectFusion and PCL as well; coarser, what a start may be off,
// times the slant of the view. Angle: PCL's 20 to 30 degrees belong to normals of filtered full-size depth;
// between cells of 30 mm at 2 m the noise of readings alone turns a normal by 10 degrees, and a wrong start
// turns it too. With 0.3 m and 60 degrees 13 of 14 starts come back from 150 mm and 10 degrees, with 0.1 m
// and 45 degrees 7; the ATE is the same (docs/tracking.md).
constexpr IcpGates kGates[TrackPoints::kLevels] = {{0.1f, 0.7f}, {0.2f, 0.5f}, {0.3f, 0.5f}};

// No depth sensor of the supported kinds sees nearer.
constexpr float kNearest_m = 0.05f;

}  // namespace

void IcpTracker::place(Arena& arena, int max_width, int max_height) {
    reference_.place(arena, max_width, max_height);
    int most = std::min(max_width * max_height, TrackPoints::kMostPoints);
    for (auto& level : normals_) {
        for (float*& axis : level) axis = arena.allocate<float>(static_cast<std::size_t>(most) + 16, 64);
        most = std::max(most / 4, 1);
    }
    items_ = arena.allocate<ResidualItem>(kMostItems, 64);
}

void IcpTracker::look_at(const TrackPoints& points, Jobs& jobs) {
    points_ = &points;
    jobs_ = &jobs;
    for (int i = 0; i < TrackPoints::kLevels; ++i) {
        const TrackLevel& level = points.level(i);
        const PointGrid grid = grid_of(level);
        jobs.run(items_of(level.count), [&](int item, int) {
            in_batches(level.count, item, [&](int first, int count) {
                for (int k = first; k < first + count; ++k) {
                    const Vec3f n = grid_normal(grid, level.cell[k]);
                    for (int axis = 0; axis < 3; ++axis) normals_[i][axis][k] = n[axis];
                }
            });
        });
    }
}

Measured IcpTracker::measure(const Se3& T_world_camera, int level) {
    const TrackLevel& points = points_->level(level);
    const simd::SurfaceGrid grid = reference_.grid(level);
    const int items = items_of(points.count);
    const Se3 T_reference_camera = reference_.T_world_reference().inverse() * T_world_camera;
    simd::Association by;
    for (int i = 0; i < 9; ++i) by.R[i] = static_cast<float>(T_reference_camera.R.m[i]);
    for (int k = 0; k < 3; ++k) by.t[k] = static_cast<float>(T_reference_camera.t[k]);
    by.most_m = kGates[level].most_m;
    by.least_cos = kGates[level].least_cos;
    by.nearest_m = kNearest_m;
    const simd::TrackRobust robust = huber(scale_, by.most_m);
    const float close = static_cast<float>(kCloseSigmas / scale_);
    float* const* normals = normals_[level];
    jobs_->run(items, [&](int item, int) {
        ResidualItem& out = items_[item];
        out.clear();
        alignas(64) float distance[simd::kSampleBatch], gradient[3][simd::kSampleBatch],
            normalised[simd::kSampleBatch];
        float* const gradients[3] = {gradient[0], gradient[1], gradient[2]};
        in_batches(points.count, item, [&](int first, int count) {
            const float *x = points.x + first, *y = points.y + first, *z = points.z + first;
            simd::associate(grid, by, {x, y, z, normals[0] + first, normals[1] + first, normals[2] + first},
                            count, distance, gradients);
            simd::track_sums({x, y, z, points.inverse_sigma + first, distance, gradients}, count, by.R,
                             robust, out.sums, normalised);
            out.take(normalised, count, close);
            for (int i = 0; i < count; ++i) out.known += normalised[i] >= 0;
        });
    });
    return measured_of(items_, items, points.count, scale_);
}

}  // namespace burin
