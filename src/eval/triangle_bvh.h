// SPDX-License-Identifier: MIT
// A bounding volume hierarchy over the triangles of a mesh for exact closest-point and ray queries: binned
// surface area heuristic (Wald, "On fast construction of SAH-based bounding volume hierarchies", RT 2007),
// nodes in one array.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "core/jobs.h"
#include "core/status.h"
#include "core/triangle_mesh.h"

namespace burin {

// A point on a triangle as weights of its three corners; they sum to 1.
struct Barycentric {
    double a = 0, b = 0, c = 0;
};

struct ClosestPoint {
    bool found = false;  // false only when nothing lies within max_distance_m
    double distance_m = 0;
    std::uint32_t triangle = 0;
    Vec3d point;
    Barycentric weights;
};

struct RayHit {
    bool found = false;
    double t = 0;  // point = origin + t * direction
    std::uint32_t triangle = 0;
    Barycentric weights;
    bool back_face = false;  // seen from the side from which the corners run clockwise
};

class TriangleBvh {
  public:
    TriangleBvh() = default;

    // Keeps its own copy of the geometry (about 110 bytes a triangle). The result does not depend on the
    // number of threads. Triangles without area are kept: they are points and segments to closest(),
    // invisible to rays. Error: no triangles, an index out of range, a position that is not finite, memory.
    static Result<TriangleBvh> build(const TriangleMesh& mesh, Jobs& jobs);

    // The closest point of the surface. Exact in double arithmetic; needles thinner than 1e-5 of their length
    // may be off by 1e-5 of that length. Of equally close triangles it is always the same one. Safe from many
    // threads.
    ClosestPoint closest(Vec3d p, double max_distance_m = std::numeric_limits<double>::infinity()) const;

    // The first hit with t_min <= t <= t_max. Neighbouring triangles leave no gap between them.
    RayHit raycast(Vec3d origin, Vec3d direction, double t_min = 0,
                   double t_max = std::numeric_limits<double>::infinity()) const;

    std::size_t triangle_count() const { return triangles_.size(); }
    // Unit normal of a triangle by its winding; zero when it has no area.
    Vec3d normal(std::uint32_t triangle) const;

  private:
    struct Node {
        Vec3f low, high;
        std::uint32_t first =
            0;  // leaf: its first entry in triangles_; else: its second child (the first follows it)
        std::uint32_t count = 0;  // leaf: how many; 0: an inner node
    };
    struct Triangle {
        Vec3f a, b, c;
        std::uint32_t index = 0;  // in the mesh
    };
    struct Builder;

    std::vector<Node> nodes_;
    std::vector<Triangle> triangles_;      // in the order of the leaves
    std::vector<std::uint32_t> place_of_;  // mesh index -> triangles_
};

}  // namespace burin
