// SPDX-License-Identifier: MIT
#include "session/camera_tracking.h"

namespace burin {

void CameraTracking::place(Arena& arena, const TrackingOptions& options, const DepthOptions& depth) {
    options_ = options;
    if (options.tracker == Tracker::none) return;
    points_.place(arena, depth.max_width, depth.max_height);
    sdf_.place(arena);
    if (!options.colour) return;
    grey_.place(arena);
    brightness_.place(arena);
    photometric_.place(arena);
}

void CameraTracking::clear() {
    frames_ = 0;
    photometric_.clear();
}

TrackingReport CameraTracking::track(const Volume& volume, const DepthImage& depth, const FrameView& frame,
                                     Jobs& jobs) {
    TrackingReport report;
    points_.build(depth, jobs);
    const bool colour = options_.colour && grey_.build(frame, jobs);
    if (colour) brightness_.build(points_, grey_, frame, jobs);
    if (frames_ == 0) {
        last_ = before_ = frame.T_world_camera;
        report.T_world_camera = last_;
        report.state = TrackingState::tracking;
        if (colour) photometric_.set_keyframe(points_, brightness_, last_);
        ++frames_;
        return report;
    }
    sdf_.look_at(volume, points_, jobs);
    photometric_.look_at(points_, brightness_, jobs);
    JointMeasurement joint(sdf_, photometric_, options_.colour_weight);
    PoseMeasurement& measurement =
        colour && photometric_.has_keyframe() ? static_cast<PoseMeasurement&>(joint) : sdf_;
    const Se3 moving = normalised(last_ * (before_.inverse() * last_));
    const double still_cost = cost_at(measurement.begin_level(last_, TrackPoints::kLevels - 1));
    const double moving_cost = cost_at(measurement.measure(moving, TrackPoints::kLevels - 1));
    const PoseFit found = descend(measurement, moving_cost < still_cost ? moving : last_,
                                 {moving, options_.prior_m, options_.prior_rad}, options_.descent);
    report.T_world_camera = found.T_world_camera;
    report.evaluations = found.evaluations + 2;
    report.inlier_share = found.system.points > 0 ? found.system.inliers / found.system.points : 0;
    report.cost = found.cost;
    report.scale = found.scale;
    report.state = TrackingState::tracking;
    before_ = last_;
    last_ = found.T_world_camera;
    ++frames_;
    if (!colour) return report;
    const Measured& seen = joint.colour();
    const Twist since = motion_between(photometric_.T_world_keyframe(), last_);
    report.colour_share = seen.considered > 0 ? seen.system.points / seen.considered : 0;
    // While two thirds of the points find themselves in the keyframe it serves: a new one carries the error
    // of its pose.
    if (report.colour_share < 0.66) photometric_.set_keyframe(points_, brightness_, last_);
    (void)since;
    return report;
}

}  // namespace burin
