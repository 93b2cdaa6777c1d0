// SPDX-License-Identifier: MIT
// Frames of data sets as the C interface takes them.
#pragma once

#include "burin/burin.h"
#include "capture/frame.h"
#include "core/camera.h"
#include "core/se3.h"

namespace burin {

burin_camera c_camera(const Camera& camera);
burin_pose c_pose(const Se3& T);
burin_frame c_frame(const Frame& frame);  // its images must outlive the result

}  // namespace burin
