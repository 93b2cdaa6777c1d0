// SPDX-License-Identifier: MIT
// How objects are found: connected faces off the planes, cut where they are narrow, with the feet they stand
// on. Used by objects.cpp and object_finder.cpp alone.
#pragma once

#include "planes/objects.h"

namespace burin::objects {

// A face of an object's foot leans from its plane by more than 45 degrees; what is flatter is the plane's
// own.
inline constexpr double kFlat = 0.7071;
// Faces in the margin are taken ring by ring; twice the margin in edges of half a voxel.
inline constexpr int kRings = 8;
// Areas are summed as integers of 0.01 mm^2, so that a component of up to 42 m^2 needs one word; larger ones
// stay at that.
inline constexpr double kAreaUnit = 1e-8;
inline constexpr double kBeside = 0.5;    // of the margin: rounding; a foot further out is none
inline constexpr double kLegReach = 0.1;  // legs end this near below their top
inline constexpr double kOutside = 0.05;  // and stand out from under it by no more
inline constexpr double kNested = 0.5;    // of its box that lies in the box of the larger one
inline constexpr double kTouch =
    0.01;                           // metres: two voxels, the thinnest wall whose two sides are sure to join
inline constexpr int kProbes = 64;  // vertices of the smaller one, spread evenly, that look for the larger

// Metres above its table or floor: what comes down to there stands on it. Faces nearer than the margin are
// feet and count for nothing here, so that this is more than twice the margin.
inline constexpr double kStanding = 0.025;
inline constexpr double kFootprintCell =
    0.5;  // of the margin: a voxel, so that no cell between faces stays bare

// What a face is in the work array, before it has the number of its object.
inline constexpr std::uint32_t kCore = kNoObject - 1;
// A foot, and the plane it stands on: 65533 planes at most count, as many objects are never asked for.
inline constexpr std::uint32_t kFirstFoot = 0xffff0000u;
inline constexpr int kMostPlanes = 0xfffd;

struct Face {
    Vec3d corner[3];
    Vec3d normal;  // unit
    double area = 0;
};

class Finder {
  public:
    Finder(const ObjectInput& mesh, const ObjectOptions& options, std::uint32_t* scratch)
        : mesh_(mesh),
          options_(options),
          parent_(scratch),
          weight_(scratch + mesh.vertices),
          face_(scratch + 2 * mesh.vertices) {}

    int run(ObjectBox* out, int capacity, int* needed, std::uint32_t* face_object);

  private:
    Face face(std::uint64_t t) const;
    std::uint32_t vertex(std::uint64_t t, int k) const {
        return mesh_.triangles[3 * t + static_cast<std::uint64_t>(k)];
    }
    Vec3d position(std::uint32_t v) const {
        const float* p = mesh_.positions + 3 * std::uint64_t{v};
        return {p[0], p[1], p[2]};
    }
    std::uint32_t kind(std::uint64_t t) const;
    std::uint32_t root_of(std::uint32_t v);
    void join();
    void sum_areas();
    int support_of(std::uint32_t root) const;
    void cut(std::uint32_t root);
    void cut_at_necks(double least);
    void grow_feet(const ObjectBox* cores);
    void add_to(ObjectBox* box, std::uint64_t t) const;
    bool stands_under(const ObjectBox& core, std::uint64_t t) const;
    bool holds_up_a_table(const ObjectBox& box) const;
    bool part_of(const ObjectBox* out, int small, int large) const;

    const ObjectInput& mesh_;
    const ObjectOptions& options_;
    std::uint32_t* parent_;  // per vertex: union-find, later its object + 1
    std::uint32_t* weight_;  // per vertex: area of the component at its root, later the object + 1 there
    std::uint32_t* face_;    // per triangle
};

}  // namespace burin::objects
