// SPDX-License-Identifier: MIT
// The floor plan of a scan: walls, doors, windows, free space and the outlines of furniture seen from above
// (docs/floorplan.md), as SVG and as JSON.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/se3.h"
#include "core/status.h"
#include "core/vec.h"

namespace burin {

// What the plan is made of, metres, world frame. Labels are those of triangle_mesh.h.
struct FloorPlanPlane {
    int id = 0;
    std::uint8_t label = 0;
    Vec3d normal;  // unit, into free space
    double offset = 0;
    std::vector<std::vector<Vec3d>> rings;  // outlines and holes, in any order
};
struct FloorPlanObject {  // its box along the world's axes
    std::uint8_t label = 0;
    Vec3d low, high;
};
struct FloorPlanInput {
    Vec3d up_world{0, 0, 1};
    std::vector<FloorPlanPlane> planes;
    std::vector<FloorPlanObject> objects;
};

struct PlanPoint {
    double x = 0, y = 0;  // metres
};
// A wall, door or window from above. Free space is on the right of from -> to.
struct PlanSegment {
    int id = 0;  // of its plane
    PlanPoint from, to;
    double foot = 0, height = 0;  // metres: above the floor, from foot to top
};
struct PlanOutline {
    std::uint8_t label = 0;  // table, seat, or none for any other object
    std::vector<PlanPoint> ring;
};

// The plan's frame: z up, 0 on the floor, x along the longest wall, in that of its four directions that is
// nearest to the world's x axis; the origin is below (or above) the world's.
struct FloorPlan {
    Se3 T_plan_world;
    std::vector<PlanSegment> walls, doors, windows;
    std::vector<std::vector<std::vector<PlanPoint>>> free_space;  // rings by floor plane, filled even-odd
    std::vector<PlanOutline> furniture;
};

// Error (invalid_argument), one line: a coordinate that is not finite, an up or a normal that is not of unit
// length.
Result<FloorPlan> make_floor_plan(const FloorPlanInput& input);

// SVG 1.1 in metres, x right and y up, with a grid of 1 m and a scale bar.
std::string floor_plan_svg(const FloorPlan& plan);
// Keys up, T_plan_world (4x4 by rows), walls, doors, windows, free_space, furniture: see docs/floorplan.md.
std::string floor_plan_json(const FloorPlan& plan);

// Both files, each written whole or not at all. Errors: make_floor_plan's, io.
Status write_floor_plan(const std::string& svg_path, const std::string& json_path,
                        const FloorPlanInput& input);

}  // namespace burin
