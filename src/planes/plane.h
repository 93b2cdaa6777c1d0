// SPDX-License-Identifier: MIT
// What the rooms above see of a plane.
#pragma once

#include <cstdint>

#include "core/vec.h"

namespace burin {

// Labels of faces and planes, as in truth files, PLY and the C API.
enum PlaneLabel : std::uint8_t {
    kLabelNone = 0,
    kLabelWall,
    kLabelFloor,
    kLabelCeiling,
    kLabelTable,
    kLabelSeat,
    kLabelWindow,
    kLabelDoor
};

// The geometry that labels follow from.
struct PlaneShape {
    Vec3d normal;        // unit, into free space, world
    double offset = 0;   // normal . x + offset = 0, metres
    double area_m2 = 0;  // what was seen of it
    // Vertices of its outline(s) in the world, metres, in any order: what its width and height follow from.
    const Vec3f* outline = nullptr;
    int outline_count = 0;
};

}  // namespace burin
