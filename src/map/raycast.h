// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "core/camera.h"
#include "core/jobs.h"
#include "core/se3.h"
#include "map/volume.h"

namespace burin {

struct RaycastImages {            // camera.width * camera.height pixels, packed; any may be null
    float* depth_m = nullptr;     // z along the optical axis, 0 where there is no surface
    float* normals = nullptr;     // 3 a pixel, world coordinates, towards free space
    std::uint8_t* rgb = nullptr;  // 3 a pixel
};

// The first crossing from + to - along each pixel's ray up to max_depth_m (KinectFusion 2011, section 3.3):
// steps of the distance itself inside chunks, over whole chunks where there are none, the crossing by linear
// interpolation.
void raycast(const Volume& volume, const Camera& camera, const Se3& T_world_camera, float max_depth_m,
             const RaycastImages& out, Jobs& jobs);

}  // namespace burin
