// SPDX-License-Identifier: MIT
// Whether a pose is to be believed: what it explains, what holds it, and whether a hand can move like that.
#pragma once

#include "track/descent.h"

namespace burin {

enum class TrackingState : std::uint8_t {
    tracking,  // sure enough to be fused
    weak,      // a pose, but some motions are held by the prediction alone, or it explains too little
    lost,      // no pose
};

struct Verdict {
    TrackingState state = TrackingState::lost;
    double close_share = 0;  // of the points in observed space, those that agree with the surface there
    double known_share = 0;  // of all points, those in observed space
    double weakest_m = 0;    // standard deviation of the motion that is held least, as arc at the mean depth
    double keyframe_share = 0;        // of the points with brightness, those that the keyframe shows
    int free_directions = 0;          // motions held worse than kFreeSigma
    double jump_m = 0, jump_rad = 0;  // from the prediction
};

// Fewer points than this measure nothing to rely on: a fortieth of a full image.
inline constexpr int kLeastPoints = 500;

// Standard deviations of the six motions follow from A when residuals are independent. They are not: a
// sensor's errors are alike over some ten blocks of readings in each direction (a ripple of disparity steps),
// which leaves a hundredth of the information.
inline constexpr double kCorrelated = 100;

// reach: mean depth of the points, metres. jump from the prediction over gap_s seconds since the last pose.
// young: the map is of a few frames, with holes wherever readings were missing; few points then find their
// eight voxels, and as long as those agree the next frames have to fill it.
Verdict judge(const PoseFit& fit, double reach_m, const Twist& jump, double gap_s, bool young = false);

}  // namespace burin
