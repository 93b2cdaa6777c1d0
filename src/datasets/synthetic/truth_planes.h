// SPDX-License-Identifier: MIT
// The planes of a scene, with the area that lies open and the area that some frame saw.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "datasets/synthetic/render.h"

namespace burin {

struct TruthPlane {
    int id = 0;
    std::uint8_t label = 0;
    int instance = 0;
    Vec3d normal;       // unit, into free space
    double offset = 0;  // normal . x + offset = 0
    std::vector<Vec3d>
        polygon;  // outline, counter-clockwise seen from free space; other things may cover parts of it
    double area_m2 = 0;        // what lies open: not inside or against another solid
    double seen_area_m2 = 0;   // of that, what the frames given to add_frame saw
    std::int64_t support = 0;  // true depth pixels on it, all frames
};

// A rectangle or, with round set, the disc (ellipse) inside it.
struct PlanePatch {
    Vec3d centre, u, v, normal;     // u, v, normal: unit, right-handed
    double half_u = 0, half_v = 0;  // metres
    bool round = false;
};

// Collects the planar faces of a scene: coplanar faces of one object are one plane. Faces are sampled on a
// grid, which gives the areas to about 1 %.
class PlaneSurvey {
  public:
    explicit PlaneSurvey(const SyntheticScene& scene);

    // Counts what this frame sees, out to max_depth. `images` as from render_truth with the same camera and
    // pose.
    void add_frame(const TruthImages& images, const Camera& camera, const Se3& T_scene_camera,
                   double max_depth, Jobs& jobs);

    // The planes no smaller than the scene's min_plane_area, largest first, numbered from 0.
    std::vector<TruthPlane> planes() const;

  private:
    struct Sample {
        Vec3d position;
        float area = 0;  // m^2
        bool seen = false;
    };
    struct Face {
        TruthPlane plane;
        Vec3d u, v;  // in the plane
        std::vector<PlanePatch> patches;
        std::vector<Sample> samples;
    };

    void sample_patch(const PlanePatch& patch, Face* face) const;

    const SyntheticScene& scene_;
    std::vector<Face> faces_;
    std::vector<int> first_face_;  // of a part: face_ index of its face 0 in face_of_; -1 when it has none
    std::vector<int> face_of_;     // (part, its face) to index in faces_
};

// The JSON list of design.md, keys id label normal offset area_m2 seen_area_m2 polygon covariance support;
// covariance (4x4, of normal and offset) is zero, since these planes are exact.
std::string planes_json(const std::vector<TruthPlane>& planes);

}  // namespace burin
