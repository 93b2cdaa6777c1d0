// SPDX-License-Identifier: MIT
// A camera that moved further than a prediction tells, or was lost, is brought back to the map.
#include <algorithm>
#include <cmath>

#include "session/camera_tracking.h"

namespace burin {
namespace {

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
// Where starts that lie so far apart all end at one place, less will do: a map of two seconds shows a frame
// from 0.1 m aside a seventh less well than those it is made of (fr3: 0.71 for 0.82, brightness 1.4), and of
// 600 wrong places that a lost camera was drawn to in a room (up to 0.95 of the usual share) none looked
// better than 1.7.
constexpr double kApart_m = 0.05, kTogether_m = 0.01, kTogether_rad = 0.01;
constexpr double kAgreedClose = 0.8, kAgreedKnown = 0.75, kAgreedGrey = 1.6;

double length(const double (&v)[3]) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

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
bool CameraTracking::looks_like_map(const Se3& T_world_camera, double grey) {
    if (!bright_ || !volume_->has_colour() || !view_map(T_world_camera)) return true;
    const Measured m = rendered_.begin_level(T_world_camera, 1);
    return m.seen >= kFoundSeen * m.bright && m.median <= grey;
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
        // What is left beside a hand holds no jump.
        if (v.free_directions > 0 && report->verdict.state != TrackingState::lost) return;
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

// Where the camera may be: where it was last, and last for sure; where it would have coasted to; and the
// keyframes that look like this frame.
int CameraTracking::starts_of_search(const DepthImage& depth, const FrameView& frame, const Prediction& ahead,
                                     Se3 (&starts)[kStarts]) {
    int count = 0;
    starts[count++] = last_;
    if (norm(last_sure_.t - last_.t) > kTogether_m) starts[count++] = last_sure_;
    const double gap_s = since_last_s(frame);
    if (gap_s > 0 && gap_s < kCoasting_s && std::isfinite(ahead.translation_sigma_m))
        starts[count++] = ahead.best();
    FernMatch matches[kCandidates];
    const int found = ferns_.nearest(ferns_.encode(make_thumbnail(depth, frame)), matches, kCandidates);
    for (int i = 0; i < found; ++i) starts[count++] = matches[i].T_world_camera;
    return count;
}

// All starts, and the pose that explains the frame best, when one does: report->relocalised. `followed`:
// where following led, null for a lost camera.
PoseFit CameraTracking::search(const DepthImage& depth, const FrameView& frame, const Prediction& ahead,
                               const PoseFit* followed, TrackingReport* report) {
    PoseFit best;
    if (points_.level(0).count < kLeastPoints) return best;
    Se3 starts[kStarts];
    const int count = starts_of_search(depth, frame, ahead, starts);
    struct End {
        PoseFit fit;
        Verdict verdict;
        bool tracking = false, likely = false;
    } ends[kStarts];
    const auto take = [&](const End& end) {
        if (report->relocalised && misfit(end.fit, end.verdict) >= misfit(best, report->verdict)) return;
        report->relocalised = true;
        report->verdict = end.verdict;
        best = end.fit;
    };
    const auto attempt = [&](int i, bool by_colour) {
        End end;
        end.fit = settled(drawn_near(starts[i], by_colour, report), by_colour, report);
        const Verdict& v = end.verdict = judge(end.fit, points_.mean_depth_m(), {}, 0);
        end.tracking = v.state == TrackingState::tracking;
        end.likely = end.tracking && v.known_share >= kAgreedKnown &&
                     v.close_share >= kAgreedClose * usual_close_share_;
        if (end.tracking && (!ends[i].tracking || misfit(end.fit, v) < misfit(ends[i].fit, ends[i].verdict)))
            ends[i] = end;
        if (v.state == TrackingState::lost || v.close_share < kFoundClose || fits_less_than_usual(v) ||
            v.known_share < kFoundKnown || !looks_like_map(end.fit.T_world_camera, kFoundGrey))
            return false;
        take(end);
        return true;
    };
    // Colour holds what depth leaves free; from far off it may lead astray, and depth alone does not.
    for (int i = 0; i < count; ++i)
        if (!bright_ || !attempt(i, true)) (void)attempt(i, false);
    if (report->relocalised) return best;
    // None is beyond doubt: one that others found from elsewhere is.
    const auto together = [&](const PoseFit& a, const PoseFit& b) {
        const Twist off = motion_between(a.T_world_camera, b.T_world_camera);
        return length(off.v) < kTogether_m && length(off.w) < kTogether_rad;
    };
    for (int i = 0; i < count && followed; ++i)
        if (ends[i].tracking && norm(starts[i].t - followed->T_world_camera.t) > kApart_m &&
            together(ends[i].fit, *followed))
            take(ends[i]);
    for (int i = 0; i < count; ++i)
        for (int k = 0; k < i; ++k)
            if (ends[i].likely && ends[k].likely && norm(starts[i].t - starts[k].t) > kApart_m &&
                together(ends[i].fit, ends[k].fit) && looks_like_map(ends[i].fit.T_world_camera, kAgreedGrey))
                take(ends[i]);
    return best;
}

// A lost camera.
PoseFit CameraTracking::find_again(const DepthImage& depth, const FrameView& frame, TrackingReport* report) {
    const PoseFit best = search(depth, frame, predict(frame), nullptr, report);
    if (report->relocalised) begin_anew(report->verdict);
    return best;
}

// After a hand was before the lens, or a stretch that nothing held: the frame should fit as the frames before
// did. When it does not, the pose went astray meanwhile; or it did not, then other starts end there too.
PoseFit CameraTracking::looked_for(const DepthImage& depth, const FrameView& frame, const Prediction& ahead,
                                   const PoseFit& followed, TrackingReport* report) {
    TrackingReport other;
    const PoseFit found = search(depth, frame, ahead, &followed, &other);
    report->evaluations += other.evaluations;
    if (!other.relocalised) return followed;
    report->relocalised = true;
    report->verdict = other.verdict;
    begin_anew(other.verdict);
    return found;
}

// What was found is beyond doubt, so the shares there are the usual ones from now on.
void CameraTracking::begin_anew(const Verdict& found) {
    usual_close_share_ = found.close_share;
    usual_known_share_ = found.known_share;
    interrupted_ = false;
    interrupted_frames_ = 0;
    prior_.forget_motion();
    photometric_.clear();
    sure_ = 0;
}

}  // namespace burin
