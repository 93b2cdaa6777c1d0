// SPDX-License-Identifier: MIT
#include "session/camera_tracking.h"

#include <algorithm>
#include <cmath>

namespace burin {
namespace {

// After the camera was found again, or at the start of a map from a file, that many frames must follow one
// another before one is fused: a wrong place does not stay right for long.
constexpr int kSureFrames = 3;
// Keyframes tried for a lost camera, a frame: of five the right one is among them 97 times in 100
// (docs/relocalisation.md).
constexpr int kCandidates = 5;
// What a place has to explain to be believed without a prediction.
constexpr double kFoundClose = 0.7, kFoundKnown = 0.4;
// While two thirds of the bright points find themselves in the keyframe it serves: each new one adds its own
// error.
constexpr double kKeyframeShare = 0.66;

}  // namespace

void CameraTracking::place(Arena& arena, const TrackingOptions& options, const DepthOptions& depth) {
    options_ = options;
    options_.ferns.min_depth_m = depth.min_depth_m;
    // Depth tests beyond what a room shows would tell nothing (ferns.h).
    options_.ferns.max_depth_m = std::min(depth.max_depth_m, 6.0f);
    if (options.tracker == Tracker::none) return;
    points_.place(arena, depth.max_width, depth.max_height, depth.max_depth_m);
    selection_.place(arena);
    sdf_.place(arena);
    icp_.place(arena, depth.max_width, depth.max_height);
    max_depth_m_ = depth.max_depth_m;
    ferns_.place(arena, options_.ferns);
    if (!options.colour) return;
    grey_.place(arena);
    brightness_.place(arena);
    photometric_.place(arena);
}

void CameraTracking::clear() {
    sdf_.forget_scale();
    icp_.forget_scale();
    photometric_.clear();
    prior_.clear();
    frames_ = 0;
    known_ = false;
    sure_ = 0;
    last_ = {};
    last_t_ns_ = 0;
}

void CameraTracking::look_for_camera() {
    const Se3 last = last_;
    clear();
    last_ = last;
}

PoseMeasurement& CameraTracking::geometry() {
    if (options_.tracker == Tracker::icp) return icp_;
    return sdf_;
}

// Depth against the map; where the frame has colour, with brightness against the keyframe.
PoseMeasurement& CameraTracking::measurement() {
    if (!bright_ || !photometric_.has_keyframe()) return geometry();
    joint_.look_at(geometry(), photometric_, options_.colour_weight);
    return joint_;
}

TrackingReport CameraTracking::track(const Volume& volume, const DepthImage& depth, const FrameView& frame,
                                     Jobs& jobs) {
    TrackingReport report;
    points_.build(depth, jobs);
    bright_ = options_.colour && grey_.build(frame, jobs);
    if (bright_) brightness_.build(points_, grey_, frame, jobs);
    if (options_.select) selection_.select(points_, bright_ ? &brightness_ : nullptr, jobs);
    volume_ = &volume;
    jobs_ = &jobs;
    grid_camera_ = points_.level(0).camera;
    sdf_.look_at(volume, points_, jobs);
    if (options_.tracker == Tracker::icp) icp_.look_at(points_, jobs);
    photometric_.look_at(points_, brightness_, jobs);
    ++frames_;
    if (volume.live() == 0) {
        if (points_.level(0).count < kLeastPoints) return report;
        report.T_world_camera = frame.T_world_camera;
        report.state = report.verdict.state = TrackingState::tracking;
        sure_ = kSureFrames;
        prior_.predict(frame.t_ns, frame.imu, frame.imu_count, frame.T_camera_imu);
    } else {
        if (frames_ == 1) last_ = frame.T_world_camera;
        const PoseFit fit = known_ ? follow(frame, &report) : find_again(depth, frame, &report);
        report.state = report.verdict.state;
        report.T_world_camera = fit.T_world_camera;
        report.cost = fit.cost;
        report.scale = fit.scale;
    }
    known_ = report.state != TrackingState::lost;
    if (!known_) {
        sure_ = 0;
        return report;
    }
    keep(depth, frame, report);
    sure_ = report.state == TrackingState::tracking ? sure_ + 1 : std::min(sure_, kSureFrames);
    if (sure_ <= kSureFrames && report.state == TrackingState::tracking) report.state = TrackingState::weak;
    return report;
}

// One frame after another: the better of the predicted starts, down to the pose.
PoseFit CameraTracking::follow(const FrameView& frame, TrackingReport* report) {
    const bool gyro = options_.gyro && frame.imu_count > 0;
    const Prediction ahead = prior_.predict(frame.t_ns, gyro ? frame.imu : nullptr,
                                            gyro ? frame.imu_count : 0, frame.T_camera_imu);
    const Se3& predicted = ahead.has_gyro ? ahead.gyro : ahead.constant_velocity;
    // A quarter of the rays: all of them gave the same ATE for twice the time (docs/tracking.md).
    if (options_.tracker == Tracker::icp)
        icp_.look_from(*volume_, grid_camera_, predicted, max_depth_m_, *jobs_, 1);
    PoseMeasurement& measured = measurement();
    constexpr int kCoarsest = TrackPoints::kLevels - 1;
    const double moving = cost_at(measured.begin_level(predicted, kCoarsest));
    const double still = cost_at(measured.measure(ahead.still, kCoarsest));
    const Se3& start = moving <= still ? predicted : ahead.still;
    MotionPriorTerm prior;
    prior.T_world_camera = predicted;
    // In the currency of correlated readings.
    const double discount = 1 / std::sqrt(kCorrelated);
    // A gyroscope has seen the motion; constant velocity is a guess, which a jerk of the hand makes wrong.
    if (ahead.has_gyro) prior.sigma_rad = discount * ahead.rotation_sigma_rad;
    PoseFit fit = descend(measured, start, prior, options_.descent);
    report->evaluations = fit.evaluations + 2;
    const double gap_s = static_cast<double>(frame.t_ns - last_t_ns_) * 1e-9;
    report->verdict = judge(fit, points_.mean_depth_m(), motion_between(predicted, fit.T_world_camera),
                            std::max(gap_s, 0.0));
    if (report->verdict.state == TrackingState::weak && report->verdict.free_directions > 0 &&
        std::isfinite(ahead.translation_sigma_m)) {
        // Where the frame holds nothing, the guess is better than what noise says.
        prior.sigma_m = discount * ahead.translation_sigma_m;
        prior.sigma_rad = discount * ahead.rotation_sigma_rad;
        const Verdict verdict = report->verdict;
        fit = descend(measured, start, prior, options_.descent);
        report->evaluations += fit.evaluations;
        report->verdict = judge(fit, points_.mean_depth_m(), motion_between(predicted, fit.T_world_camera),
                                std::max(gap_s, 0.0));
        report->verdict.free_directions = verdict.free_directions;
        report->verdict.weakest_m = verdict.weakest_m;
        if (report->verdict.state == TrackingState::tracking) report->verdict.state = TrackingState::weak;
    }
    return report->verdict.state == TrackingState::lost ? rescued(frame, fit, report) : fit;
}

// A start that is off by more than the field's band tells, brought near by ICP against what the map looks
// like from there: from 100 mm and 7 degrees, with a sixteenth of the rays.
Se3 CameraTracking::drawn_near(const Se3& start, TrackingReport* report) {
    if (options_.tracker != Tracker::icp) icp_.look_at(points_, *jobs_);
    icp_.look_from(*volume_, grid_camera_, start, max_depth_m_, *jobs_, 2);
    DescentOptions coarse;
    coarse.finest = 1;
    const PoseFit fit = descend(icp_, start, {}, coarse);
    report->evaluations += fit.evaluations;
    return fit.T_world_camera;
}

// The camera moved further than a prediction tells: once more from the last pose, by way of ICP, by depth
// alone.
PoseFit CameraTracking::rescued(const FrameView& frame, const PoseFit& failed, TrackingReport* report) {
    if (points_.level(0).count < kLeastPoints) return failed;
    const PoseFit fit = descend(sdf_, drawn_near(last_, report), {}, options_.descent);
    report->evaluations += fit.evaluations;
    const double gap_s = std::max(static_cast<double>(frame.t_ns - last_t_ns_) * 1e-9, 0.0);
    // What one frame apart a hand can do, from the last pose instead of the prediction.
    const Verdict v =
        judge(fit, points_.mean_depth_m(), motion_between(last_, fit.T_world_camera), 3 * gap_s);
    if (v.state != TrackingState::tracking || v.close_share < kFoundClose || v.known_share < kFoundKnown)
        return failed;
    report->verdict = v;
    return fit;
}

// A lost camera: from where it was last, and from the keyframes that look like this frame, by depth alone.
PoseFit CameraTracking::find_again(const DepthImage& depth, const FrameView& frame, TrackingReport* report) {
    PoseFit best;
    if (points_.level(0).count < kLeastPoints) return best;
    Se3 starts[1 + kCandidates];
    FernMatch matches[kCandidates];
    int count = 0;
    starts[count++] = last_;
    const int found = ferns_.nearest(ferns_.encode(make_thumbnail(depth, frame)), matches, kCandidates);
    for (int i = 0; i < found; ++i) starts[count++] = matches[i].T_world_camera;
    for (int i = 0; i < count; ++i) {
        const PoseFit fit = descend(sdf_, drawn_near(starts[i], report), {}, options_.descent);
        report->evaluations += fit.evaluations;
        Verdict v = judge(fit, points_.mean_depth_m(), {}, 0);
        if (v.state == TrackingState::lost || v.close_share < kFoundClose || v.known_share < kFoundKnown)
            continue;
        if (report->relocalised && fit.cost >= best.cost) continue;
        report->relocalised = true;
        report->verdict = v;
        best = fit;
    }
    if (report->relocalised) {
        prior_.forget_motion();
        photometric_.clear();
    }
    return best;
}

// What later frames start from.
void CameraTracking::keep(const DepthImage& depth, const FrameView& frame, const TrackingReport& report) {
    last_ = report.T_world_camera;
    last_t_ns_ = frame.t_ns;
    prior_.observe(frame.t_ns, last_);
    if (report.state != TrackingState::tracking) return;
    if (bright_ && (!photometric_.has_keyframe() || report.verdict.keyframe_share < kKeyframeShare))
        photometric_.set_keyframe(points_, brightness_, last_);
    if (sure_ >= kSureFrames)
        ferns_.harvest(ferns_.encode(make_thumbnail(depth, frame)), last_, frames_, frame.t_ns);
}

}  // namespace burin
