// SPDX-License-Identifier: MIT
#include "session/camera_tracking.h"

#include <algorithm>
#include <cmath>

#include "core/time.h"

namespace burin {
namespace {

// After the camera was found again, or at the start of a map from a file, that many frames must follow one
// another before one is fused: a wrong place does not stay right for long.
constexpr int kSureFrames = 3;
// A map of so many frames has few holes left, even of a sensor that misses half of its pixels.
constexpr int kYoungFrames = 10;
// The share of points that agree with the map changes slowly. A frame with less than so much of the usual is
// not fused; with less than kStrange of it, it is looked into.
constexpr double kDoubtful = 0.8;
constexpr double kOutliers = 4, kFewOutliers = 0.02, kOutOfSight = 0.8;
// How fast "usual" follows: half in 3 frames, so that a slow decline is none, and in 22 of those that are
// strange.
constexpr double kUsual = 1.0 / 4, kUsualStrange = 1.0 / 32;
// Frames in a row that are looked into: the third time it is no jerk of the hand.
constexpr int kTryAgain = 3;
// Further than this from the prediction, wallpaper may have drawn the pose to its next repetition.
constexpr double kFar_m = 0.04, kFar_rad = 0.07;
// After an interruption the frames that do not fit are searched for at once, some times, then three times a
// second. So long the share that was usual is kept for measure, seconds; if none of it comes back the scene
// has changed.
constexpr int kSearches = 3, kSearchEvery = 10;
// Both, since some recordings have the numbers of frames for stamps.
constexpr double kPatience_s = 3;
constexpr int kPatienceFrames = 90;
// A frame whose least held motion is held so much worse than usual may go on sliding (one plane of an office:
// 5 to 8 mm for 1.2 of the whole view).
constexpr double kFirm = 2;
// Weak frames in a row that are an interruption: the prediction is good for fewer.
constexpr int kInterrupted = 3;
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
    rendered_.place(arena);
}

void CameraTracking::clear() {
    sdf_.forget_scale();
    icp_.forget_scale();
    photometric_.clear();
    rendered_.clear();
    prior_.clear();
    frames_ = 0;
    known_ = false;
    sure_ = 0;
    usual_close_share_ = usual_known_share_ = usual_weakest_m_ = 0;
    strange_frames_ = fused_ = 0;
    last_ = last_sure_ = {};
    last_t_ns_ = 0;
    interrupted_ = was_hidden_ = false;
    interrupted_frames_ = searches_ = 0;
}

void CameraTracking::look_for_camera() {
    const Se3 last = last_;
    clear();
    last_ = last_sure_ = last;
    fused_ = kYoungFrames;
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
    icp_ready_ = options_.tracker == Tracker::icp;
    if (icp_ready_) icp_.look_at(points_, jobs);
    photometric_.look_at(points_, brightness_, jobs);
    rendered_.look_at(points_, brightness_, jobs);
    ++frames_;
    if (volume.live() == 0) {
        if (points_.level(0).count < kLeastPoints) return report;
        report.T_world_camera = frame.T_world_camera;
        report.state = report.verdict.state = TrackingState::tracking;
        sure_ = kSureFrames;
        (void)predict(frame);  // takes the samples in
    } else {
        if (frames_ == 1) last_ = last_sure_ = frame.T_world_camera;
        const PoseFit fit = known_ ? follow(depth, frame, &report) : find_again(depth, frame, &report);
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
    if (report.state == TrackingState::tracking) fused_ = std::min(fused_ + 1, kYoungFrames);
    return report;
}

Prediction CameraTracking::predict(const FrameView& frame) {
    const bool gyro = options_.gyro && frame.imu_count > 0;
    return prior_.predict(frame.t_ns, gyro ? frame.imu : nullptr, gyro ? frame.imu_count : 0,
                          frame.T_camera_imu);
}

double CameraTracking::since_last_s(const FrameView& frame) const {
    return std::max(seconds_between(last_t_ns_, frame.t_ns), 0.0);
}

PoseFit CameraTracking::fitted(PoseMeasurement& measured, const Se3& start, const MotionPriorTerm& prior,
                               const DescentOptions& options, TrackingReport* report) {
    const PoseFit fit = descend(measured, start, prior, options);
    report->evaluations += fit.evaluations;
    return fit;
}

// One frame after another: the better of the predicted starts, down to the pose.
PoseFit CameraTracking::follow(const DepthImage& depth, const FrameView& frame, TrackingReport* report) {
    const Prediction ahead = predict(frame);
    const Se3& predicted = ahead.best();
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
    report->evaluations += 2;
    const auto fit_and_judge = [&] {
        const PoseFit fit = fitted(measured, start, prior, options_.descent, report);
        report->verdict = judge(fit, points_.mean_depth_m(), motion_between(predicted, fit.T_world_camera),
                                since_last_s(frame), fused_ < kYoungFrames);
        return fit;
    };
    PoseFit fit = fit_and_judge();
    if (report->verdict.state == TrackingState::weak && report->verdict.free_directions > 0 &&
        std::isfinite(ahead.translation_sigma_m)) {
        // Where the frame holds nothing, the guess is better than what noise says.
        prior.sigma_m = discount * ahead.translation_sigma_m;
        prior.sigma_rad = discount * ahead.rotation_sigma_rad;
        const Verdict unaided = report->verdict;
        fit = fit_and_judge();
        report->verdict.free_directions = unaided.free_directions;
        report->verdict.weakest_m = unaided.weakest_m;
        if (report->verdict.state == TrackingState::tracking) report->verdict.state = TrackingState::weak;
    }
    const bool odd = strange(report->verdict) || sudden(report->verdict);
    strange_frames_ = odd ? strange_frames_ + 1 : 0;
    const bool far = report->verdict.jump_m > kFar_m || report->verdict.jump_rad > kFar_rad;
    if (report->verdict.state == TrackingState::lost || far || (odd && strange_frames_ <= kTryAgain))
        fit = rescued(frame, fit, report);
    if (!strange(report->verdict) && !sudden(report->verdict))
        strange_frames_ = 0;  // a camera that moves fast needs it every time
    watch_interruption(frame, report->verdict);
    if (interrupted_ && !was_hidden_ && strange(report->verdict)) {
        if (searches_ < kSearches || searches_ % kSearchEvery == 0)
            fit = looked_for(depth, frame, ahead, fit, report);
        ++searches_;
        interrupted_ = !report->relocalised;
    }
    if (interrupted_ && report->verdict.state == TrackingState::tracking)
        report->verdict.state = TrackingState::weak;
    if (report->verdict.state == TrackingState::tracking && doubtful(report->verdict))
        report->verdict.state = TrackingState::weak;
    return fit;
}

// Begins with what hides the scene or leaves a motion free for some frames; ends with a frame that fits and
// is held as those before were, or when frames that are held at all have been without for long enough.
void CameraTracking::watch_interruption(const FrameView& frame, const Verdict& verdict) {
    const bool hides = hidden(verdict), unheld = verdict.state != TrackingState::tracking;
    interrupted_frames_ = hides || unheld ? interrupted_frames_ + 1 : 0;
    if (!interrupted_ && (hides || interrupted_frames_ >= kInterrupted)) {
        interrupted_ = true;
        searches_ = 0;
    }
    if (was_hidden_ && !hides) searches_ = 0;
    was_hidden_ = hides;
    if (!interrupted_) return;
    ++held_frames_;
    if (hides || unheld) {
        interrupted_t_ns_ = frame.t_ns;
        held_frames_ = 0;
    }
    const bool firm = verdict.weakest_m <= kFirm * usual_weakest_m_;
    if ((!unheld && firm && !strange(verdict)) ||
        (held_frames_ >= kPatienceFrames && seconds_between(interrupted_t_ns_, frame.t_ns) > kPatience_s)) {
        interrupted_ = false;
        sure_ = 0;
    }
}

// Worth a second look, though it may be right: four times as many points as usual disagree, or of what was
// known a fifth went out of sight at once. (Drawn to the next repetition of a pattern: 3 to 7 % for 0.3 %, a
// third.)
bool CameraTracking::sudden(const Verdict& verdict) const {
    return 1 - verdict.close_share > std::max(kOutliers * (1 - usual_close_share_), kFewOutliers) ||
           verdict.known_share < kOutOfSight * usual_known_share_;
}

// Less of the frame agrees with the map than did in the frames before.
bool CameraTracking::strange(const Verdict& verdict) const {
    return fits_less_than_usual(verdict) || doubtful(verdict);
}

// Too much less to be fused; or much of what was known is out of sight at once, behind a hand or a passer-by.
bool CameraTracking::doubtful(const Verdict& verdict) const {
    return verdict.close_share < kDoubtful * usual_close_share_ || hidden(verdict);
}

// What later frames start from.
void CameraTracking::keep(const DepthImage& depth, const FrameView& frame, const TrackingReport& report) {
    last_ = report.T_world_camera;
    last_t_ns_ = frame.t_ns;
    prior_.observe(frame.t_ns, last_);
    const Verdict& v = report.verdict;
    if (v.known_share > 0 && !interrupted_) {
        const double rate = usual_close_share_ == 0 ? 1 : strange(v) ? kUsualStrange : kUsual;
        usual_close_share_ += rate * (v.close_share - usual_close_share_);
        usual_known_share_ += rate * (v.known_share - usual_known_share_);
    }
    if (report.state != TrackingState::tracking) return;
    last_sure_ = last_;
    if (v.weakest_m > 0)
        usual_weakest_m_ += (usual_weakest_m_ == 0 ? 1 : kUsual) * (v.weakest_m - usual_weakest_m_);
    // Not yet of a camera that was just found: it still settles, and a keyframe would hold it where it is.
    if (sure_ < kSureFrames) return;
    if (bright_ && (!photometric_.has_keyframe() || report.verdict.keyframe_share < kKeyframeShare))
        photometric_.set_keyframe(points_, brightness_, last_);
    ferns_.harvest(ferns_.encode(make_thumbnail(depth, frame)), last_, frames_, frame.t_ns);
}

}  // namespace burin
