// SPDX-License-Identifier: MIT
#include "session/camera_tracking.h"

#include <algorithm>
#include <cmath>

namespace burin {
namespace {

// After the camera was found again, or at the start of a map from a file, that many frames must follow one
// another before one is fused: a wrong place does not stay right for long.
constexpr int kSureFrames = 3;
// A map of so many frames has few holes left, even of a sensor that misses half of its pixels.
constexpr int kYoungFrames = 10;
// Keyframes tried for a lost camera, a frame: of five the right one is among them 97 times in 100
// (docs/relocalisation.md).
constexpr int kCandidates = 5;
// So long a motion goes on about as it was, seconds.
constexpr double kCoasting_s = 1.5;
// What a place has to explain to be believed without a prediction.
constexpr double kFoundClose = 0.7, kFoundKnown = 0.5;
// A step of the sweep, cells of the middle level: what a descent comes back from; 60 pixels of VGA to each
// side.
constexpr double kSweepCells = 1.25;
constexpr int kSweepSteps = 6;
// And by colour: the share of points whose brightness the map shows, and the median difference, in units of 2
// levels.
constexpr double kFoundSeen = 0.4, kFoundGrey = 1.3;
// The share of points that agree with the map changes slowly. A frame with less than so much of the usual is
// looked into, and with less than that of it is not fused.
constexpr double kStrange = 0.93, kDoubtful = 0.8;
// The same for the share that the map knows: a camera that turns at 400 degrees a second leaves three
// quarters.
constexpr double kHidden = 0.6;
// How fast "usual" follows: half in 3 frames, so that a slow decline is none, and in 22 of those that are
// strange.
constexpr double kUsual = 1.0 / 4, kUsualStrange = 1.0 / 32;
// Frames in a row that are looked into: the third time it is no jerk of the hand.
constexpr int kTryAgain = 3;
// While two thirds of the bright points find themselves in the keyframe it serves: each new one adds its own
// error.
constexpr double kKeyframeShare = 0.66;

// To tell which of two fits explains a frame better, whatever robust scale each has: the product of the
// spreads of both kinds of residuals, by the share that is explained at all.
double misfit(const PoseFit& fit, const Verdict& verdict) {
    const double colour = fit.measured.seen > 0 ? scale_of(fit.measured.colour_median) : 1;
    return scale_of(fit.measured.median) * colour / std::max(verdict.close_share, 1e-3);
}

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
    prior_.clear();
    frames_ = 0;
    known_ = false;
    sure_ = 0;
    usual_close_share_ = usual_known_share_ = 0;
    strange_frames_ = fused_ = 0;
    last_ = {};
    last_t_ns_ = 0;
}

void CameraTracking::look_for_camera() {
    const Se3 last = last_;
    clear();
    last_ = last;
    fused_ = kYoungFrames;
}

PoseMeasurement& CameraTracking::geometry() {
    if (options_.tracker == Tracker::icp) return icp_;
    return sdf_;
}

bool CameraTracking::young() const { return fused_ < kYoungFrames; }

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
        const int samples = options_.gyro ? frame.imu_count : 0;
        prior_.predict(frame.t_ns, samples > 0 ? frame.imu : nullptr, samples, frame.T_camera_imu);
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
    if (report.state == TrackingState::tracking) fused_ = std::min(fused_ + 1, kYoungFrames);
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
                            std::max(gap_s, 0.0), young());
    if (report->verdict.state == TrackingState::weak && report->verdict.free_directions > 0 &&
        std::isfinite(ahead.translation_sigma_m)) {
        // Where the frame holds nothing, the guess is better than what noise says.
        prior.sigma_m = discount * ahead.translation_sigma_m;
        prior.sigma_rad = discount * ahead.rotation_sigma_rad;
        const Verdict verdict = report->verdict;
        fit = descend(measured, start, prior, options_.descent);
        report->evaluations += fit.evaluations;
        report->verdict = judge(fit, points_.mean_depth_m(), motion_between(predicted, fit.T_world_camera),
                                std::max(gap_s, 0.0), young());
        report->verdict.free_directions = verdict.free_directions;
        report->verdict.weakest_m = verdict.weakest_m;
        if (report->verdict.state == TrackingState::tracking) report->verdict.state = TrackingState::weak;
    }
    const bool odd = strange(report->verdict);
    strange_frames_ = odd ? strange_frames_ + 1 : 0;
    if (report->verdict.state == TrackingState::lost || (odd && strange_frames_ <= kTryAgain))
        fit = rescued(frame, fit, report);
    if (report->verdict.state == TrackingState::tracking && doubtful(report->verdict))
        report->verdict.state = TrackingState::weak;
    return fit;
}

// Less of the frame agrees with the map than did in the frames before.
bool CameraTracking::strange(const Verdict& verdict) const {
    return verdict.close_share < kStrange * usual_close_share_ || doubtful(verdict);
}

// Too much less to be fused; or much of what was known is out of sight at once, behind a hand or a passer-by.
bool CameraTracking::doubtful(const Verdict& verdict) const {
    return verdict.close_share < kDoubtful * usual_close_share_ ||
           verdict.known_share < kHidden * usual_known_share_;
}

// A start that is off by more than the field's band tells, brought near by ICP and colour against what the
// map looks like from there, with a quarter of the rays. Twice: the second view is from nearby.
Se3 CameraTracking::drawn_near(const Se3& start, bool by_colour, TrackingReport* report) {
    if (options_.tracker != Tracker::icp) icp_.look_at(points_, *jobs_);
    DescentOptions coarse;
    coarse.finest = 1;
    Se3 near = start;
    for (int turn = 0; turn < 2; ++turn) {
        icp_.look_from(*volume_, grid_camera_, near, max_depth_m_, *jobs_, 1);
        const bool colour = by_colour && has_view_colour();
        JointMeasurement both;
        if (colour) {
            rendered_.set_keyframe(icp_.reference());
            rendered_.look_at(points_, brightness_, *jobs_);
            both.look_at(icp_, rendered_, options_.colour_weight);
        }
        const PoseFit fit = descend(colour ? static_cast<PoseMeasurement&>(both) : icp_, near, {}, coarse);
        report->evaluations += fit.evaluations;
        near = fit.T_world_camera;
        if (turn == 0 && colour) near = swept(near, report);
    }
    return near;
}

// Along the two motions that depth holds least, over some 60 pixels to each side, the place that looks most
// like the frame: patterns repeat, and a descent stops at the nearest repetition.
Se3 CameraTracking::swept(const Se3& near, TrackingReport* report) {
    const Measured shape = icp_.measure(near, 1);
    const double reach = points_.mean_depth_m();
    const Spectrum spectrum = spectrum_of(shape.system, reach);
    const double step = kSweepCells * reach / points_.level(1).camera.fx;
    Se3 best = near;
    double least = 0;
    rendered_.begin_level(near, 1);
    for (int a = -kSweepSteps; a <= kSweepSteps; ++a)
        for (int b = -kSweepSteps; b <= kSweepSteps; ++b) {
            Twist xi;
            for (int k = 0; k < 3; ++k) {
                xi.v[k] = step * (a * spectrum.vectors[0][k] + b * spectrum.vectors[1][k]);
                xi.w[k] = step * (a * spectrum.vectors[0][3 + k] + b * spectrum.vectors[1][3 + k]) / reach;
            }
            const Se3 T = moved(near, xi);
            const double cost = cost_at(rendered_.measure(T, 1));
            ++report->evaluations;
            if ((a == -kSweepSteps && b == -kSweepSteps) || cost < least) {
                least = cost;
                best = T;
            }
        }
    return best;
}

// From nearby into the field; where there is colour held along walls by the map's own, without its finest
// level, which the view of the map does not have.
PoseFit CameraTracking::settled(const Se3& near, bool by_colour, TrackingReport* report) {
    if (!by_colour || !has_view_colour()) {
        const PoseFit fit = descend(sdf_, near, {}, options_.descent);
        report->evaluations += fit.evaluations;
        return fit;
    }
    JointMeasurement both;
    both.look_at(sdf_, rendered_, options_.colour_weight);
    DescentOptions coarse = options_.descent;
    coarse.finest = 1;
    const PoseFit fit = descend(both, near, {}, coarse);
    report->evaluations += fit.evaluations;
    return fit;
}

bool CameraTracking::has_view_colour() const { return bright_ && icp_.reference().has_grey(); }

// Geometry alone takes one wall for another: the map seen from there must also look like the frame.
bool CameraTracking::looks_like_map(const Se3& T_world_camera) {
    if (!bright_ || !volume_->has_colour()) return true;
    icp_.look_from(*volume_, grid_camera_, T_world_camera, max_depth_m_, *jobs_, 1);
    if (!has_view_colour()) return true;
    rendered_.set_keyframe(icp_.reference());
    rendered_.look_at(points_, brightness_, *jobs_);
    const Measured m = rendered_.begin_level(T_world_camera, 1);
    return m.seen >= kFoundSeen * m.bright && m.median <= kFoundGrey;
}

// The camera moved further than a prediction tells: once more from the last pose, by way of ICP, and by way
// of colour alone, which tells motions along a wall.
PoseFit CameraTracking::rescued(const FrameView& frame, const PoseFit& failed, TrackingReport* report) {
    if (points_.level(0).count < kLeastPoints) return failed;
    PoseFit best = failed;
    const auto attempt = [&](const Se3& start) {
        const PoseFit fit = descend(measurement(), start, {}, options_.descent);
        report->evaluations += fit.evaluations;
        const double gap_s = std::max(static_cast<double>(frame.t_ns - last_t_ns_) * 1e-9, 0.0);
        // What a hand can do, from the last pose instead of the prediction.
        const Verdict v =
            judge(fit, points_.mean_depth_m(), motion_between(last_, fit.T_world_camera), 3 * gap_s);
        if (v.state == TrackingState::lost) return;
        if (report->verdict.state != TrackingState::lost && misfit(fit, v) >= misfit(best, report->verdict))
            return;
        report->verdict = v;
        best = fit;
    };
    attempt(drawn_near(last_, true, report));
    if (bright_ && photometric_.has_keyframe()) {
        DescentOptions coarse;
        coarse.finest = 1;
        const PoseFit by_colour = descend(photometric_, last_, {}, coarse);
        report->evaluations += by_colour.evaluations;
        attempt(by_colour.T_world_camera);
    }
    return best;
}

// A lost camera: from where it was last, and from the keyframes that look like this frame, by depth alone.
PoseFit CameraTracking::find_again(const DepthImage& depth, const FrameView& frame, TrackingReport* report) {
    PoseFit best;
    if (points_.level(0).count < kLeastPoints) return best;
    Se3 starts[2 + kCandidates];
    FernMatch matches[kCandidates];
    int count = 0;
    starts[count++] = last_;
    const double gap_s = static_cast<double>(frame.t_ns - last_t_ns_) * 1e-9;
    const bool gyro = options_.gyro && frame.imu_count > 0;
    const Prediction ahead = prior_.predict(frame.t_ns, gyro ? frame.imu : nullptr,
                                            gyro ? frame.imu_count : 0, frame.T_camera_imu);
    if (gap_s > 0 && gap_s < kCoasting_s && std::isfinite(ahead.translation_sigma_m))
        starts[count++] = ahead.has_gyro ? ahead.gyro : ahead.constant_velocity;
    const int found = ferns_.nearest(ferns_.encode(make_thumbnail(depth, frame)), matches, kCandidates);
    for (int i = 0; i < found; ++i) starts[count++] = matches[i].T_world_camera;
    const auto attempt = [&](const Se3& start, bool by_colour) {
        const PoseFit fit = settled(drawn_near(start, by_colour, report), by_colour, report);
        const Verdict v = judge(fit, points_.mean_depth_m(), {}, 0);
        if (v.state == TrackingState::lost || v.close_share < kFoundClose ||
            v.close_share < kStrange * usual_close_share_ || v.known_share < kFoundKnown ||
            !looks_like_map(fit.T_world_camera))
            return false;
        if (report->relocalised && misfit(fit, v) >= misfit(best, report->verdict)) return true;
        report->relocalised = true;
        report->verdict = v;
        best = fit;
        return true;
    };
    // Colour holds what depth leaves free; from far off it may lead astray, and depth alone does not.
    for (int i = 0; i < count; ++i)
        if (!bright_ || !attempt(starts[i], true)) (void)attempt(starts[i], false);
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
    const Verdict& v = report.verdict;
    if (v.known_share > 0) {
        const double rate = usual_close_share_ == 0 ? 1 : strange(v) ? kUsualStrange : kUsual;
        usual_close_share_ += rate * (v.close_share - usual_close_share_);
        usual_known_share_ += rate * (v.known_share - usual_known_share_);
    }
    if (report.state != TrackingState::tracking) return;
    if (bright_ && (!photometric_.has_keyframe() || report.verdict.keyframe_share < kKeyframeShare))
        photometric_.set_keyframe(points_, brightness_, last_);
    if (sure_ >= kSureFrames)
        ferns_.harvest(ferns_.encode(make_thumbnail(depth, frame)), last_, frames_, frame.t_ns);
}

}  // namespace burin
