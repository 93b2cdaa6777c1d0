// SPDX-License-Identifier: MIT
// A calibration file for sensors that know none of theirs: camera.txt as the data sets have it
// (docs/datasets.md), `key value` a line, '#' begins a comment. width height fx fy cx cy k1 k2 p1 p2 k3 of
// depth and everything registered to it, each again as colour_... for a colour camera of its own, depth_scale
// (metres = value / depth_scale), and `T_colour_depth tx ty tz qx qy qz qw`, `T_camera_imu` likewise.
#pragma once

#include "capture/source.h"

namespace burin {

// Into the streams that *info has. Without width and height the numbers are for the stream's own size; with
// them, a stream of another size but the same shape takes them scaled. Errors: io; format (names the file,
// the line and what was expected); *info is then as it was.
Status read_calibration(const char* path, DeviceInfo* info);
// The same from text, which ends in a zero; `name` stands for the file in messages.
Status parse_calibration(const char* text, const char* name, DeviceInfo* info);

}  // namespace burin
