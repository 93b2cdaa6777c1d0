// SPDX-License-Identifier: MIT
#include "track/joint.h"

#include <algorithm>

namespace burin {

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
    weight_ = base_weight_ * std::clamp(0.5 / (scale_ * scale_), 0.5, 4.0);
    return sum();
}

Measured JointMeasurement::measure(const Se3& T_world_camera, int level) {
    last_geometry_ = geometry_->measure(T_world_camera, level);
    last_colour_ = colour_->measure(T_world_camera, level);
    return sum();
}

}  // namespace burin
