// SPDX-License-Identifier: MIT
// A camera that moved further than a prediction tells, or was lost, is brought back to the map.
#include <algorithm>
#include <cmath>

#include "session/camera_tracking.h"

namespace burin {
namespace {

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

// To tell which of two fits explains a frame better, whatever robust scale each has: the product of the
// spreads of both kinds of residuals, by the share that is explained at all.
double misfit(const PoseFit& fit, const Verdict& verdict) {
    const double colour = fit.measured.seen > 0 ? scale_of(fit.measured.colour_median) : 1;
    return scale_of(fit.measured.median) * colour / std::max(verdict.close_share, 1e-3);
}

// The finest level of a view of the map is not cast.
DescentOptions coarse(DescentOptions options) {
    options.finest = 1;
    return options;
}

}  // namespace

// A start that is off by more than the field's band tells, brought near by ICP and colour against what the
// map looks like from there, with a quarter of the rays. Twice: the second view is from nearby.
Se3 CameraTracking::drawn_near(const Se3& start, bool by_colour, TrackingReport* report) {
    if (!icp_ready_) icp_.look_at(points_, *jobs_);  // once a frame, whatever the number of starts
    icp_ready_ = true;
    Se3 near = start;
    for (int turn = 0; turn < 2; ++turn) {
        const bool colour = view_map(near) && by_colour;
        JointMeasurement both;
        both.look_at(icp_, rendered_, options_.colour_weight);
        near = fitted(colour ? static_cast<PoseMeasurement&>(both) : icp_, near, {}, coarse(options_.descent),
                      report)
                   .T_world_camera;
        if (turn == 0 && colour) near = swept(near, report);
    }
    return near;
}

// The map as it looks from there, with a quarter of the rays, for ICP; and for the brightness, when there is
// colour to compare.
bool CameraTracking::view_map(const Se3& T_world_camera) {
    icp_.look_from(*volume_, grid_camera_, T_world_camera, max_depth_m_, *jobs_, 1);
    if (!has_view_colour()) return false;
    rendered_.set_keyframe(icp_.reference());
    return true;
}

bool CameraTracking::has_view_colour() const { return bright_ && icp_.reference().has_grey(); }

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
    if (!by_colour || !has_view_colour()) return fitted(sdf_, near, {}, options_.descent, report);
    JointMeasurement both;
    both.look_at(sdf_, rendered_, options_.colour_weight);
    return fitted(both, near, {}, coarse(options_.descent), report);
}

// Geometry alone takes one wall for another: the map seen from there must also look like the frame.
bool CameraTracking::looks_like_map(const Se3& T_world_camera) {
    if (!bright_ || !volume_->has_colour() || !view_map(T_world_camera)) return true;
    const Measured m = rendered_.begin_level(T_world_camera, 1);
    return m.seen >= kFoundSeen * m.bright && m.median <= kFoundGrey;
}

// The camera moved further than a prediction tells: once more from the last pose, by way of ICP, and by way
// of colour alone, which tells motions along a wall.
PoseFit CameraTracking::rescued(const FrameView& frame, const PoseFit& failed, TrackingReport* report) {
    if (points_.level(0).count < kLeastPoints) return failed;
    PoseFit best = failed;
    const auto attempt = [&](const Se3& start) {
        const PoseFit fit = fitted(measurement(), start, {}, options_.descent, report);
        // What a hand can do, from the last pose instead of the prediction.
        const Verdict v = judge(fit, points_.mean_depth_m(), motion_between(last_, fit.T_world_camera),
                                3 * since_last_s(frame));
        if (v.state == TrackingState::lost) return;
        if (report->verdict.state != TrackingState::lost && misfit(fit, v) >= misfit(best, report->verdict))
            return;
        report->verdict = v;
        best = fit;
    };
    attempt(drawn_near(last_, true, report));
    if (bright_ && photometric_.has_keyframe())
        attempt(fitted(photometric_, last_, {}, coarse(options_.descent), report).T_world_camera);
    return best;
}

// A lost camera: from where it was last, from where it would have coasted to, and from the keyframes that
// look like this frame.
PoseFit CameraTracking::find_again(const DepthImage& depth, const FrameView& frame, TrackingReport* report) {
    PoseFit best;
    if (points_.level(0).count < kLeastPoints) return best;
    Se3 starts[2 + kCandidates];
    FernMatch matches[kCandidates];
    int count = 0;
    starts[count++] = last_;
    const Prediction ahead = predict(frame);
    const double gap_s = since_last_s(frame);
    if (gap_s > 0 && gap_s < kCoasting_s && std::isfinite(ahead.translation_sigma_m))
        starts[count++] = ahead.best();
    const int found = ferns_.nearest(ferns_.encode(make_thumbnail(depth, frame)), matches, kCandidates);
    for (int i = 0; i < found; ++i) starts[count++] = matches[i].T_world_camera;
    const auto attempt = [&](const Se3& start, bool by_colour) {
        const PoseFit fit = settled(drawn_near(start, by_colour, report), by_colour, report);
        const Verdict v = judge(fit, points_.mean_depth_m(), {}, 0);
        if (v.state == TrackingState::lost || v.close_share < kFoundClose || fits_less_than_usual(v) ||
            v.known_share < kFoundKnown || !looks_like_map(fit.T_world_camera))
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

}  // namespace burin
