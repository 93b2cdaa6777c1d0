// SPDX-License-Identifier: MIT
// Objects: the connected components of what is left of a mesh when its structure (floor, walls, ceiling,
// tables, doors, windows) is taken away (Dzitsiuk et al., ICRA 2017, section III-F). Seats are objects.
//
// Things that nearly touch come out of the mesh as one; where both stand on a table or the floor they are cut
// at the neck of what they cover of it (footprint.h).
//
// Where a thing meets its table the faces are neither: rounded, noisy, unlabelled, and on a full table these
// strips would join everything. So faces within a margin of a structure plane do not join; what belongs to an
// object of them, its foot, is told afterwards by its slope. The inside of a cup whose wall is thinner than a
// voxel, fruit in a bowl: a component within the box of a larger one that it nearly touches belongs to it.
#pragma once

#include <cstdint>

#include "core/vec.h"
#include "planes/footprint.h"
#include "planes/plane.h"
#include "planes/plane_extent.h"

namespace burin {

struct ObjectInput {
    const float* positions = nullptr;  // 3 a vertex, metres
    std::uint64_t vertices = 0;
    const std::uint32_t* triangles = nullptr;  // 3 a triangle, every vertex shared by all its faces
    std::uint64_t triangle_count = 0;
    const std::uint8_t* face_labels = nullptr;  // PlaneLabel, one a triangle
    // The planes with what classify_planes said of them: labels, and extents in its scratch.
    const PlaneShape* planes = nullptr;
    const PlaneExtent* extents = nullptr;
    const std::uint8_t* plane_labels = nullptr;
    int plane_count = 0;
    FootprintMemory footprint;  // empty: things that nearly touch stay one
};

struct ObjectOptions {
    double margin_m = 0.01;      // two voxels of 5 mm: how far marching cubes rounds a corner
    double edge_m = 0.06;        // a table's top is no thicker: its edge is table too
    double min_area_m2 = 0.002;  // an eraser has 0.003 above its margin; smaller ones are specks of noise
};

struct ObjectBox {
    Vec3f low, high;  // along the world's axes, metres
    double area_m2 = 0;
    double seat_area_m2 = 0;  // of that, of faces labelled seat
    std::uint32_t faces = 0;
    std::uint32_t first_vertex = 0;  // the least of its vertices: which object is which while the mesh stays
};

// Words of scratch for a mesh of this size.
constexpr std::uint64_t object_scratch_words(std::uint64_t vertices, std::uint64_t triangles) {
    return 2 * vertices + triangles;
}

// Writes the objects, largest area first, and returns how many were written: *needed, or `capacity` when that
// is less (the largest are kept). face_object, when not null, gets one number a triangle: index of its object
// in `out`, or kNoObject. The same input gives the same output; time grows with triangles times planes.
constexpr std::uint32_t kNoObject = 0xffffffffu;
int find_objects(const ObjectInput& mesh, const ObjectOptions& options, std::uint32_t* scratch,
                 ObjectBox* out, int capacity, int* needed, std::uint32_t* face_object);

}  // namespace burin
