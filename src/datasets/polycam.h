// SPDX-License-Identifier: MIT
// Inside of the room: the camera files of Polycam's raw export. Pure; `name` stands for the file in messages.
#pragma once

#include <string>
#include <string_view>

#include "core/camera.h"
#include "core/se3.h"

namespace burin {

struct PolycamCamera {
    Camera colour;
    Se3 T_world_camera;  // Burin's axes
};
// {"fx", "fy", "cx", "cy", "width", "height", "t_00" .. "t_23"}: row-major camera to world, ARKit's axes.
Result<PolycamCamera> parse_polycam_camera(std::string_view text, const std::string& name);

}  // namespace burin
