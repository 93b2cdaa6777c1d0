// SPDX-License-Identifier: MIT
#include "session/camera_tracking.h"

namespace burin {

void CameraTracking::place(Arena& arena, const TrackingOptions& options, const DepthOptions& depth) {
    options_ = options;
    if (options.tracker == Tracker::none) return;
    points_.place(arena, depth.max_width, depth.max_height);
    if (options.tracker == Tracker::sdf) sdf_.place(arena);
    if (options.tracker == Tracker::icp) icp_.place(arena, depth.max_width, depth.max_height);
    max_depth_m_ = depth.max_depth_m;
}

TrackingReport CameraTracking::track(const Volume& volume, const DepthImage& depth, const FrameView& frame,
                                     Jobs& jobs) {
    TrackingReport report;
    points_.build(depth, jobs);
    if (frames_ == 0) {
        last_ = before_ = frame.T_world_camera;
        report.T_world_camera = last_;
        report.state = TrackingState::tracking;
        ++frames_;
        return report;
    }
    const Se3 moving = orthonormal(last_ * (before_.inverse() * last_));
    PoseMeasurement* measurement = &sdf_;
    if (options_.tracker == Tracker::icp) {
        icp_.look_at(points_, jobs);
        // A quarter of the rays: the same ATE (docs/tracking.md).
        icp_.look_from(volume, points_.level(0).camera, moving, max_depth_m_, jobs, 1);
        measurement = &icp_;
    } else {
        sdf_.look_at(volume, points_, jobs);
    }
    const double still_cost = cost_at(measurement->measure(last_, TrackPoints::kLevels - 1, 1));
    const double moving_cost = cost_at(measurement->measure(moving, TrackPoints::kLevels - 1, 1));
    const PoseFit found = descend(*measurement, moving_cost < still_cost ? moving : last_, {}, {});
    report.T_world_camera = found.T_world_camera;
    report.evaluations = found.evaluations + 2;
    report.inlier_share = found.system.points > 0 ? found.system.inliers / found.system.points : 0;
    report.cost = found.cost;
    report.scale = found.scale;
    report.state = TrackingState::tracking;
    before_ = last_;
    last_ = found.T_world_camera;
    ++frames_;
    return report;
}

}  // namespace burin
