// SPDX-License-Identifier: MIT
// What a plane is, told from geometry and gravity alone: floor and walls by area and angle with gravity
// (Dzitsiuk et al., ICRA 2017, section III-F), tables, seats, doors and windows by the sizes furniture and
// buildings are made in, and by what stands beside what.
#pragma once

#include "planes/plane.h"
#include "planes/plane_extent.h"

namespace burin {

// Writes a PlaneLabel for each of `count` planes. `up_world` is a unit vector against gravity, within
// 5 degrees; floor and walls refine it. `scratch` has
// room for `count` extents and holds them afterwards. `mean_camera_position`, where known, tells a table that
// is seen alone from a floor. Needs no memory but the caller's; quadratic in `count`.
void classify_planes(const PlaneShape* planes, int count, Vec3d up_world, const Vec3d* mean_camera_position,
                     PlaneExtent* scratch, std::uint8_t* labels);

// The direction against gravity without an IMU: the normal of the level planes, which are those within 45
// degrees of the mean of the cameras' up axes (-y of the camera) that most other planes are parallel or
// perpendicular to, refined by all of these. Without any plane it is the cameras' mean up.
Vec3d estimate_up(const PlaneShape* planes, int count, Vec3d mean_camera_up);

}  // namespace burin
