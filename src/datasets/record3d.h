// SPDX-License-Identifier: MIT
// Inside of the room: the metadata of a Record3D file. Pure; `name` stands for the file in messages.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/camera.h"
#include "core/se3.h"

namespace burin {

struct Record3dMetadata {
    Camera colour;                          // of the first frame
    int depth_width = 0, depth_height = 0;  // 0: not said, older files
    double fps = 0;                         // 0: not said
    std::vector<Se3> T_world_camera;        // of each frame, Burin's axes; may be shorter than the frames
    std::vector<Camera> colour_of_frame;    // likewise; empty in older files
    std::vector<std::int64_t> t_ns;         // likewise; rises
};
Result<Record3dMetadata> parse_record3d_metadata(std::string_view text, const std::string& name);

}  // namespace burin
