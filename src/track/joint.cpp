// SPDX-License-Identifier: MIT
#include "track/joint.h"

#include <algorithm>

namespace burin {
namespace {

// Where depth fits the map to far below the noise of one reading, colour agrees with it and holds what depth
// leaves free; where it fits badly, as in TUM's fr1 whose colour is 15 ms off its depth, colour pulls away.
// In units of the robust scale squared: rendered rooms have 0.04 to 0.1 and want four times, TUM's 0.4 to 2
// and want no more than once.
constexpr double kTrust = 0.5, kLeastTrust = 0.5, kMostTrust = 4;

}  // namespace

Measured JointMeasurement::sum() const {
    Measured all = last_geometry_;
    NormalEquations colour = last_colour_.system;
    colour.scale_by(weight_);
    all.system += colour;
    all.considered += weight_ * last_colour_.considered;
    all.bright = last_colour_.bright;
    all.seen = last_colour_.seen;
    all.colour_median = last_colour_.median;
    return all;
}

Measured JointMeasurement::begin_level(const Se3& T_world_camera, int level) {
    last_geometry_ = geometry_->begin_level(T_world_camera, level);
    last_colour_ = colour_->begin_level(T_world_camera, level);
    scale_ = geometry_->scale();
    weight_ = base_weight_ * std::clamp(kTrust / (scale_ * scale_), kLeastTrust, kMostTrust);
    return sum();
}

Measured JointMeasurement::measure(const Se3& T_world_camera, int level) {
    last_geometry_ = geometry_->measure(T_world_camera, level);
    last_colour_ = colour_->measure(T_world_camera, level);
    return sum();
}

}  // namespace burin
