// SPDX-License-Identifier: MIT
// Inside of the room: the text files of Stray Scanner. Pure functions; `name` stands for the file in
// messages.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/imu.h"
#include "core/se3.h"
#include "core/status.h"

namespace burin {

struct StrayPose {
    std::int64_t t_ns = 0, frame = 0;
    Se3 T_world_camera;  // Burin's axes, see stray.cpp
};
// `timestamp, frame, x, y, z, qx, qy, qz, qw` a line below one such heading; further columns are passed over.
// Stamps and frame numbers rise. At least one pose.
Result<std::vector<StrayPose>> parse_stray_odometry(std::string_view text, const std::string& name);

struct StrayImu {
    std::vector<ImuSample> samples;  // specific force; empty when it cannot be told, see note
    std::string note;                // a line ended by '\n', or empty
};
// `timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z` likewise.
Result<StrayImu> parse_stray_imu(std::string_view text, const std::string& name);

// Row by row, commas between: fx 0 cx / 0 fy cy / 0 0 1.
struct StrayMatrix {
    double fx = 0, fy = 0, cx = 0, cy = 0;
};
Result<StrayMatrix> parse_stray_matrix(std::string_view text, const std::string& name);

}  // namespace burin
