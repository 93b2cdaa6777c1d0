// SPDX-License-Identifier: MIT
#include "track/sdf_tracker.h"

#include <cmath>
#include <limits>

#include "track/residuals.h"

namespace burin {

void SdfTracker::place(Arena& arena) {
    items_ = arena.allocate<ResidualItem>(kMostItems, 64);
    auto most = static_cast<std::size_t>(TrackPoints::kMostPoints);
    for (CellChunks*& chunks : chunks_) {
        chunks = arena.allocate<CellChunks>(most, 64);
        most /= 4;
    }
}

void SdfTracker::look_at(const Volume& volume, const TrackPoints& points, Jobs& jobs) {
    volume_ = &volume;
    points_ = &points;
    jobs_ = &jobs;
    for (int i = 0; i < TrackPoints::kLevels; ++i)
        for (int k = 0; k < points.level(i).count; ++k) chunks_[i][k].key = 0;
}

Measured SdfTracker::measure(const Se3& T_world_camera, int level) {
    const TrackLevel& points = points_->level(level);
    const int items = items_of(points.count);
    const LatticeFrame frame(*volume_, T_world_camera);
    float R[9];
    for (int i = 0; i < 9; ++i) R[i] = static_cast<float>(T_world_camera.R.m[i]);
    // The field says "at least the truncation" from there on, and its gradient vanishes.
    const simd::TrackRobust robust = huber(scale_, 0.97f * volume_->shape().truncation_m);
    const float close = static_cast<float>(kCloseSigmas / scale_);
    jobs_->run(items, [&](int item, int) {
        ResidualItem& out = items_[item];
        out.clear();
        BatchSampler sampler(*volume_);
        alignas(64) float distance[simd::kSampleBatch], gradient[3][simd::kSampleBatch],
            normalised[simd::kSampleBatch];
        float* gradients[3] = {gradient[0], gradient[1], gradient[2]};
        in_batches(points.count, item, [&](int first, int count) {
            const float *x = points.x + first, *y = points.y + first, *z = points.z + first;
            sampler.sample(frame, x, y, z, static_cast<std::size_t>(count), distance, gradients,
                           chunks_[level] + first);
            std::fill(distance + count, distance + simd::kSampleBatch,
                      std::numeric_limits<float>::quiet_NaN());
            simd::track_sums({x, y, z, points.inverse_sigma + first, distance, gradients}, count, R, robust,
                             out.sums, normalised);
            out.take(normalised, count, close);
            for (int i = 0; i < count; ++i) out.known += !std::isnan(distance[i]);
        });
    });
    return measured_of(items_, items, points.count, scale_);
}

}  // namespace burin
