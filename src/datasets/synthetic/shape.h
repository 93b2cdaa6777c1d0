// SPDX-License-Identifier: MIT
// The solids a scene is made of, each with its exact Euclidean signed distance (negative inside) and its
// gradient.
#pragma once

#include <cstdint>
#include <vector>

#include "core/vec.h"
#include "datasets/synthetic/relief_surface.h"

namespace burin::synthetic {

// In part coordinates; shapes of revolution turn about z. "size" below is Part::size, "round" is Part::round.
enum class Shape : std::uint8_t {
    half_space,  // z <= 0; size.x, size.y: half extents of the piece that can be seen (for planes.json only)
    box,         // half extents size, edges rounded with radius round
    sphere,      // radius size.x
    cylinder,    // radius size.x, half height size.z, rims rounded with radius round
    frustum,     // radius size.x at z = -size.z, size.y at z = +size.z
    capsule,     // spheres of radius size.x at z = -size.z and size.y at z = +size.z and all between them
    torus,       // ring radius size.x, tube radius size.y, in the plane z = 0
    ellipsoid,   // semi-axes size
    lathe,       // every point within round of the polyline `profile` of (radius, z) turned about z: vessels,
                 // shades
    relief,      // |x| <= size.x, |y| <= size.y, -size.z <= z <= height(x, y) of the relief surface
};

struct ProfilePoint {
    double r = 0, z = 0;
};

struct Part {
    Shape shape = Shape::box;
    std::uint8_t label = 0;      // none wall floor ceiling table seat window door = 0..7
    std::uint16_t instance = 0;  // the object it belongs to
    std::uint16_t material = 0;  // index into SceneData::materials
    std::int16_t blend = -1;  // parts of one blend melt into each other (index into SceneData::blends), or -1
    Mat3d R_part_scene;       // p_part = R_part_scene * (p_scene - position)
    Vec3d position;           // of the part's origin, scene frame, metres
    Vec3d size;               // metres, meaning by shape
    double round = 0;         // metres
    std::vector<ProfilePoint> profile;      // lathe only
    const ReliefSurface* relief = nullptr;  // relief only, owned by SceneData

    Vec3d to_part(Vec3d p_scene) const { return R_part_scene * (p_scene - position); }
    Vec3d to_scene_direction(Vec3d v) const {
        const double* m = R_part_scene.m;
        return {m[0] * v.x + m[3] * v.y + m[6] * v.z, m[1] * v.x + m[4] * v.y + m[7] * v.z,
                m[2] * v.x + m[5] * v.y + m[8] * v.z};
    }
};

// Distance of a point in part coordinates; the gradient (part coordinates, unit length but for the relief) is
// written when asked for. Exact outside for every shape but the relief, whose value is a lower bound with
// slope at most 1.
double part_distance(const Part& part, Vec3d p_part, Vec3d* gradient = nullptr);

// True when the solid is convex: its distance along a ray is then a convex function, and Newton's method
// started outside approaches the first intersection from the near side without ever passing it.
bool is_convex(Shape shape);

// Which planar face of the part a surface point (part coordinates) lies on: box 0..5 = +x -x +y -y +z -z,
// cylinder and frustum 0..1 = +z -z, half space 0; -1 when on none (curved or rounded surface).
int face_of(const Part& part, Vec3d p_part);

}  // namespace burin::synthetic
