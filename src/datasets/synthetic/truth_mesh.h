// SPDX-License-Identifier: MIT
// The true surface as triangles and as points.
#pragma once

#include <vector>

#include "core/jobs.h"
#include "core/triangle_mesh.h"
#include "datasets/synthetic/scene.h"

namespace burin {

// Marching cubes over the scene's mesh_bounds with cells of `resolution` metres (0: the scene's
// mesh_resolution). Every vertex lies on the surface (found on its cell edge by root finding, to 1e-9 m), is
// shared by all its triangles, and carries the true normal and albedo; labels are those of the surface under
// each triangle's centre. Closed and manifold inside mesh_bounds, open where the bounds cut the surface.
// Details thinner than a cell may be missing. Error (invalid_argument): a resolution not positive or so fine
// that the mesh would pass 2^32 vertices.
Result<TriangleMesh> truth_mesh(const SyntheticScene& scene, double resolution, Jobs& jobs);

// A point on the true surface with its outward normal.
struct SurfacePoint {
    Vec3d position, normal;
    std::uint8_t label = 0;
};
// About `count` points spread over the surface inside mesh_bounds evenly by area (deterministic for a seed):
// drawn on the triangles of a truth mesh of at least the given resolution (0: the scene's) and moved onto the
// surface.
Result<std::vector<SurfacePoint>> sample_surface(const SyntheticScene& scene, int count, std::uint64_t seed,
                                                 double resolution, Jobs& jobs);

}  // namespace burin
