// SPDX-License-Identifier: MIT
// imu.txt: the samples of an inertial unit beside the frames of a data set in the TUM layout. The parse
// function is pure; `name` stands for the file in messages.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/imu.h"
#include "core/status.h"

namespace burin {

// `t gx gy gz ax ay az` a line: seconds on the clock of the frames, rad/s, m/s^2, see ImuSample; '#' begins a
// comment. Strict: seven finite numbers, stamps that rise from line to line, at least one sample, and nothing
// above what any IMU measures, since that is another unit.
Result<std::vector<ImuSample>> parse_imu_text(std::string_view text, const std::string& name);
Result<std::vector<ImuSample>> read_imu(const std::string& path);
// The lines alone, nine decimals.
std::string format_imu(const std::vector<ImuSample>& samples);

// What Frame::imu holds for the frame at t_ns. previous_ns: stamp of the frame before, null for the first.
std::vector<ImuSample> imu_of_frame(const std::vector<ImuSample>& samples, const std::int64_t* previous_ns,
                                    std::int64_t t_ns);

}  // namespace burin
