// SPDX-License-Identifier: MIT
// A camera that moves smoothly through given poses: what an IMU on it would feel is the derivative of this.
#pragma once

#include <array>
#include <vector>

#include "core/status.h"
#include "core/trajectory.h"

namespace burin {

// Natural cubic splines through the positions and through the unit quaternions (signs chosen so that
// neighbours agree), the latter normalised after the evaluation. All of it is twice continuously
// differentiable, passes through every pose, and is differentiated exactly; no trigonometry is needed. Beyond
// either end it goes on straight.
class SmoothPath {
  public:
    struct State {
        Se3 T_world_camera;
        Vec3d velocity_m_s, acceleration_m_s2;  // of the camera's origin, world axes
        Vec3d turn_rad_s, turn_rad_s2;          // angular velocity and acceleration, camera axes
    };

    // Error (invalid_argument): no pose, stamps that do not rise, or a turn of more than 2 radians between
    // two neighbours, for which no smooth way between can be told.
    static Result<SmoothPath> through(const Trajectory& trajectory);
    State at(std::int64_t t_ns) const;

  private:
    using Channels = std::array<double, 7>;  // position, quaternion x y z w
    std::vector<std::int64_t> t_ns_;
    std::vector<Channels> value_, second_;  // second: the second derivative at the pose, 1/s^2
};

}  // namespace burin
