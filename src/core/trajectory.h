// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "core/se3.h"

namespace burin {

struct StampedPose {
    std::int64_t t_ns = 0;
    Se3 T_world_camera;
};
using Trajectory = std::vector<StampedPose>;  // ascending in t_ns

}  // namespace burin
