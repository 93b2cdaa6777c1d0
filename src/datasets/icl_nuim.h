// SPDX-License-Identifier: MIT
// Inside of the room: the pose conventions of ICL-NUIM, pure functions for tests and fuzzers.
#pragma once

#include <string>
#include <string_view>

#include "core/se3.h"

namespace burin {

// ICL-NUIM's image y axis points up (its K has fy = -480) and so do the camera's and the world's. With
// F = diag(1, -1, 1) on both sides the same poses hold for OpenCV axes and fy = +480: T = F T_icl F.
Se3 opencv_from_icl(const Se3& T_world_camera_icl);

// scene_00_%04d.txt of the POV-Ray files: lines `cam_pos = [x, y, z]';`, cam_dir and cam_up of that form;
// metres. z = cam_dir, x = cam_up x z, y = z x x, each normalised. Returns the pose with OpenCV axes.
Result<Se3> parse_povray_camera(std::string_view text, const std::string& name);

}  // namespace burin
