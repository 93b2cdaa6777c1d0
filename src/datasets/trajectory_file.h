// SPDX-License-Identifier: MIT
// Trajectories in the text forms the data sets use. The parse functions are pure: text in, poses out, `name`
// stands for the file in messages. Every error is one line "name:line: value, what was expected". All poses
// are T_world_camera, metres.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/trajectory.h"

namespace burin {

// TUM: `t tx ty tz qx qy qz qw` a line, seconds, '#' begins a comment. Strict: eight finite numbers,
// quaternion norm within 5 % of 1, stamps that rise from line to line. At least one pose.
Result<Trajectory> parse_tum_trajectory(std::string_view text, const std::string& name);
Result<Trajectory> read_tum_trajectory(const std::string& path);
// Nine decimals, metres and seconds, one header comment. Atomic, see write_file_atomically.
std::string format_tum_trajectory(const Trajectory& trajectory);
Status write_tum_trajectory(const std::string& path, const Trajectory& trajectory);

// Replica as rendered for NICE-SLAM: 16 numbers a line, row-major 4x4, one line a frame. Throughout these
// files a matrix of nothing but -inf (ScanNet's mark of a lost camera) stands for "no pose"; NaN is an error.
struct MaybePose {
    bool known = false;
    Se3 T_world_camera;
};
Result<std::vector<MaybePose>> parse_matrix_lines(std::string_view text, const std::string& name);
Result<std::vector<MaybePose>> read_matrix_lines(const std::string& path);

// One 4x4 pose in a file of its own (7-Scenes, SUN3D): 16 numbers, free line breaks.
Result<MaybePose> parse_pose_file(std::string_view text, const std::string& name);
Result<MaybePose> read_pose_file(const std::string& path);

// Redwood and Open3D .log: blocks of a line of three integers and a 4x4 matrix in four lines (Choi, Zhou,
// Koltun, CVPR 2015, data format). The first integer is the frame's index and rises from block to block.
struct LogPose {
    std::array<int, 3> ids{};
    Se3 T_world_camera;
};
Result<std::vector<LogPose>> parse_log_trajectory(std::string_view text, const std::string& name);
Result<std::vector<LogPose>> read_log_trajectory(const std::string& path);

// Position linear, rotation along the shorter great arc (slerp); s = 0 gives a, s = 1 gives b.
Se3 interpolate(const Se3& a, const Se3& b, double s);

// A hand moves with accelerations of some 5 m/s^2; between poses dt apart a straight line is then off by up
// to a dt^2 / 8 = 6 mm at 100 ms, which is about the noise of the depth. Longer gaps get no pose.
inline constexpr std::int64_t kMaxPoseGapNs = 100'000'000;
// Stamps this close are the same instant: text files carry three to six decimals, and a hand moves under 1 mm
// in it.
inline constexpr std::int64_t kSameInstantNs = 1'000'000;

// The pose at t_ns: interpolated between the neighbours when they are at most kMaxPoseGapNs apart, else a
// pose within kSameInstantNs; not known otherwise, in particular before the first and after the last.
MaybePose pose_at(const Trajectory& trajectory, std::int64_t t_ns);

}  // namespace burin
