// SPDX-License-Identifier: MIT
// Intrinsics in the forms the data sets use. The parse functions are pure; `name` stands for the file in
// messages.
#pragma once

#include <string>
#include <string_view>

#include "core/camera.h"
#include "core/se3.h"

namespace burin {

struct CameraFile {
    Camera depth;            // width and height are 0 when the file does not say them
    Camera colour;           // the same as depth unless the file says otherwise
    double depth_scale = 0;  // metres = value / depth_scale; 0 when the file does not say it
    Se3 T_colour_depth;
    Se3 T_camera_imu;  // maps IMU coordinates to those of the depth camera
};

// Burin's camera.txt: `key value` a line, '#' begins a comment. Needed: fx fy cx cy. Optional: width height
// depth_scale k1 k2 p1 p2 k3 (of depth and colour), each of them but depth_scale again as colour_fx ... for a
// colour camera of its own, `T_colour_depth tx ty tz qx qy qz qw` and `T_camera_imu` likewise. An unknown or
// repeated key is an error. `allow_flipped_fy` takes a negative fy (ICL-NUIM's image y axis) and keeps its
// sign in depth.fy.
Result<CameraFile> parse_camera_text(std::string_view text, const std::string& name,
                                     bool allow_flipped_fy = false);
Result<CameraFile> read_camera_text(const std::string& path, bool allow_flipped_fy = false);

// SUN3D and 3DMatch camera-intrinsics.txt: a row-major 3x3 matrix.
Result<CameraFile> parse_intrinsic_matrix(std::string_view text, const std::string& name);
Result<CameraFile> read_intrinsic_matrix(const std::string& path);

// Replica as rendered for NICE-SLAM: {"camera": {"w", "h", "fx", "fy", "cx", "cy", "scale"}}.
Result<CameraFile> parse_cam_params_json(std::string_view text, const std::string& name);
Result<CameraFile> read_cam_params_json(const std::string& path);

// Open3D's PinholeCameraIntrinsic: {"width", "height", "intrinsic_matrix": [9, column-major]}, with the
// "depth_scale" its RealSense recorder adds.
Result<CameraFile> parse_open3d_intrinsic_json(std::string_view text, const std::string& name);
Result<CameraFile> read_open3d_intrinsic_json(const std::string& path);

}  // namespace burin
