// SPDX-License-Identifier: MIT
#include "track/verdict.h"

#include <cmath>

namespace burin {
namespace {

// Of points in observed space. Right poses reach 0.8 and more on every sequence tried; wrong ones stay below
// a half.
constexpr double kCloseTracking = 0.5, kCloseWeak = 0.3;
// Of all points: less known surroundings than that are no hold.
constexpr double kKnownTracking = 0.25, kKnownWeak = 0.1;
// Points in a map of a few frames: half the pixels missing leave 4 % of 10,000 points their eight voxels.
constexpr int kLeastYoungPoints = 100;
// A motion held no better than this, metres, is free: a fifth of what is allowed to go wrong in a weak
// stretch.
constexpr double kFreeSigma_m = 0.006;
// Nor is one whose hold is this small beside that of the best held one: gradients of field and image have
// some per cent of noise, whose squares add up to information that is none. Measured in 160 x 120 scenes:
// bare walls and pairs of walls 0.001 to 0.031 along what they leave free, a room at least 0.07.
constexpr double kGradientNoise = 0.05;
// Hand-held cameras stay below 20 m/s^2 and 40 rad/s^2 beyond what was predicted.
constexpr double kJump_m = 0.1, kJump_m_s = 1.0, kJump_rad = 0.15, kJump_rad_s = 2.0;

double length(const double (&v)[3]) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

}  // namespace

Verdict judge(const PoseFit& fit, double reach_m, const Twist& jump, double gap_s, bool young) {
    Verdict v;
    const Measured& m = fit.measured;
    v.close_share = m.known > 0 ? m.close / m.known : 0;
    v.known_share = m.depth_points > 0 ? m.known / m.depth_points : 0;
    v.keyframe_share = m.bright > 0 ? m.seen / m.bright : 0;
    v.jump_m = length(jump.v);
    v.jump_rad = length(jump.w);
    const bool sparse = young && v.known_share < kKnownTracking;
    const Spectrum spectrum = spectrum_of(m.system, reach_m > 0 ? reach_m : 1);
    for (const double value : spectrum.values) {
        const double sigma = value > 0 ? std::sqrt(kCorrelated / value) : 1e3;
        const bool noise = !(value >= kGradientNoise * kGradientNoise * spectrum.values[5]);
        if (sigma > kFreeSigma_m || (noise && !sparse)) ++v.free_directions;
        if (sigma > v.weakest_m) v.weakest_m = sigma;
    }
    // NaN passes none of these.
    const bool near =
        v.jump_m <= kJump_m + kJump_m_s * gap_s && v.jump_rad <= kJump_rad + kJump_rad_s * gap_s;
    const bool explained = m.known >= (sparse ? kLeastYoungPoints : kLeastPoints) &&
                           v.close_share >= kCloseWeak && (sparse || v.known_share >= kKnownWeak);
    const bool known = sparse || v.known_share >= kKnownTracking;
    if (!near || !explained)
        v.state = TrackingState::lost;
    else if (v.close_share < kCloseTracking || !known || v.free_directions > 0)
        v.state = TrackingState::weak;
    else
        v.state = TrackingState::tracking;
    return v;
}

}  // namespace burin
