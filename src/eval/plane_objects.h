// SPDX-License-Identifier: MIT
// Found objects against the things of a rendered scene, by their boxes.
#pragma once

#include <string>
#include <vector>

#include "core/camera.h"
#include "core/jobs.h"
#include "core/status.h"
#include "core/trajectory.h"
#include "datasets/synthetic/scene.h"

namespace burin {

struct ObjectBounds {
    int id = 0;
    Vec3d low, high;   // metres, along the world's axes
    std::string name;  // truth: the numbers of the scene's objects that it is of
};

// objects.json: a list of {"id", "min": [x, y, z], "max": [x, y, z]}; other keys are ignored.
Result<std::vector<ObjectBounds>> read_objects(const std::string& path);
Result<std::vector<ObjectBounds>> parse_objects(const std::string& text, const char* name);

// Share of the volume of both that is in both, 0..1.
double box_iou(const ObjectBounds& a, const ObjectBounds& b);

struct ObjectMatches {
    double recall = 1, precision = 1;  // 1 of nothing
    struct Pair {
        int truth = -1, found = -1;  // indices, -1 when nothing overlaps
        double iou = 0;
    };
    std::vector<Pair> pairs, missed, invented;  // of the last two the best candidate
};
// One to one, larger IoU first, of at least min_iou.
ObjectMatches match_objects(const std::vector<ObjectBounds>& found, const std::vector<ObjectBounds>& truth,
                            double min_iou);

struct TrueObjectOptions {
    int frames = 25;  // evenly spread over the sequence; more add little to what was seen
    int width = 320;  // pixels of the pictures that tell what was seen: 3 mm at 1 m
    double max_depth_m = 4;
    double min_size_m = 0.03;       // longest side of what was seen; smaller things are not counted
    double min_thickness_m = 0.01;  // shortest side: two voxels of 5 mm; a sheet of paper is its table
    int min_pixels = 30;            // all frames; fewer is a glimpse
    double max_gap_m = 0.003;       // solids closer than this are one thing: less than a voxel apart
};
// The things a map of the frames can know: solids labelled none or seat, but for boxes thinner than
// min_thickness_m that lie on something else; those that touch joined (a mug and its handle, a chair and the
// rug below it), those of one scene object that lie apart separate; each with the box of the surface that
// some frame saw.
Result<std::vector<ObjectBounds>> true_objects(const SyntheticScene& scene, const Camera& camera,
                                               const Trajectory& poses, const TrueObjectOptions& options,
                                               Jobs& jobs);

}  // namespace burin
