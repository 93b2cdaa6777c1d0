// SPDX-License-Identifier: MIT
// Whether a mesh is what a marching cubes mesh should be: welded, without degenerate triangles, consistently
// wound, manifold.
#pragma once

#include <cstdint>

#include "core/status.h"
#include "core/triangle_mesh.h"

namespace burin {

struct MeshTopology {
    std::int64_t vertices = 0, triangles = 0, edges = 0;
    std::int64_t duplicate_vertices = 0;     // beyond the first at exactly the same position
    std::int64_t unreferenced_vertices = 0;  // in no triangle
    std::int64_t degenerate_triangles = 0;   // a corner used twice, or no area
    std::int64_t boundary_edges = 0;         // in one triangle
    std::int64_t non_manifold_edges = 0;     // in more than two triangles
    std::int64_t inconsistent_edges = 0;     // in two triangles that run along it in the same direction
    std::int64_t components = 0;             // sets of triangles connected through vertices
    std::int64_t largest_component = 0;      // triangles of the largest
    double area_m2 = 0;

    // The surface of a solid, or several: every edge has two sides.
    bool closed() const { return triangles > 0 && boundary_edges == 0 && non_manifold_edges == 0; }
    // What Burin promises of its own meshes; a boundary is allowed, since sensors do not see everything.
    bool clean() const {
        return duplicate_vertices == 0 && unreferenced_vertices == 0 && degenerate_triangles == 0 &&
               non_manifold_edges == 0 && inconsistent_edges == 0;
    }
};

// Works on indices alone where it can, so vertices that are equal but not shared show as boundary edges. A
// triangle with a corner used twice counts as degenerate and contributes no edges. Error: check_mesh, memory
// (about 80 bytes a triangle).
Result<MeshTopology> check_topology(const TriangleMesh& mesh);

}  // namespace burin
