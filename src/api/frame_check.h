// SPDX-License-Identifier: MIT
#pragma once

#include "burin/burin.h"
#include "capture/frame.h"
#include "core/status.h"

namespace burin {

// Checks everything about a frame that can be checked without reading pixels, and translates it.
Status checked_frame(const burin_frame& frame, const burin_config& config, FrameView* out);

Status checked_camera(const burin_camera& camera, const char* what, Camera* out);
Status checked_pose(const burin_pose& pose, const char* what, Se3* out);
// The same for a camera in the world: also within reach of the chunk keys.
Status checked_world_pose(const burin_pose& pose, const burin_config& config, Se3* out);

}  // namespace burin
