// SPDX-License-Identifier: MIT
// Found planes against the true ones: which were found, which were invented, and how well they lie.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/status.h"
#include "core/triangle_mesh.h"
#include "core/vec.h"
#include "eval/plane_raster.h"

namespace burin {

// An entry of planes.json: normal . x + offset = 0, metres, world.
struct LabelledPlane {
    int id = 0;
    std::uint8_t label = 0;  // none wall floor ceiling table seat window door = 0..7
    Vec3d normal;            // unit, into free space
    double offset = 0;
    double area_m2 = 0;
    double seen_area_m2 = 0;  // truth only: of area_m2, what some frame saw
    std::vector<Ring> rings;  // inside is what an odd number of them encloses
};

// Reads planes.json, found or true. "rings" (a list of outlines) stands for "polygon" where both are given. A
// normal off unit length by rounding is brought to it. Errors: io; format, naming entry and key.
Result<std::vector<LabelledPlane>> read_planes(const std::string& path);
Result<std::vector<LabelledPlane>> parse_planes(const std::string& text, const char* name);

struct PlaneMatchOptions {
    double min_area_m2 = 0.25;  // true planes seen less, and found planes smaller, are not counted
    double max_angle_deg = 1;
    double max_offset_m = 0.005;
    // Of the smaller of the two areas, what must lie in both. Planes that go on in one another's plane touch
    // at their rims only; the rest of a true outline may be covered or out of sight, so half were too strict.
    double min_overlap_share = 0.25;
    double cell_m = 0.01;  // of the grids that areas are counted on
};

// A true and a found plane side by side.
struct PlanePair {
    int truth = -1, found = -1;  // indices into the lists, -1 when there is none
    double overlap_m2 = 0;       // inside both outlines, the true one projected along its normal
    double angle_deg = 0;        // between the normals; 180 when the found one points into the solid
    double offset_m = 0;  // signed distance of the overlap's centroid on the true plane to the found one
};

struct PlaneFault {
    int plane = -1;      // index of the missed true plane, or of the false found one
    PlanePair best;      // the candidate with the largest overlap within 30 degrees and 0.1 m
    const char* reason;  // "nothing there", "normal", "offset", "overlap" or "taken"
};

struct PlaneMatches {
    int true_planes = 0, found_planes = 0;  // that count
    double recall = 1, precision = 1;       // 1 when there is nothing to find or nothing was found
    // One to one, larger overlaps first: of a true plane that counts and a found one of any size.
    std::vector<PlanePair> pairs;
    double median_angle_deg = 0, worst_angle_deg = 0, median_offset_m = 0, worst_offset_m = 0;  // of pairs
    int split = 0;  // found planes that fit a true plane which another one was paired with
    std::vector<PlaneFault> missed, invented;
};

// A pair fits when angle, offset and overlap are within the options. recall: share of the true planes with
// seen_area_m2 >= min_area_m2 that are in `pairs`. precision: share of the found planes with area_m2 >=
// min_area_m2 that fit some true plane of any size, however many fit the same one.
PlaneMatches match_planes(const std::vector<LabelledPlane>& found, const std::vector<LabelledPlane>& truth,
                          const PlaneMatchOptions& options);

}  // namespace burin
