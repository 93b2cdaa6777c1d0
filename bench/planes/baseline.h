// SPDX-License-Identifier: MIT
// What candidates are measured against: planes by RANSAC on the vertices of a chunk's mesh, as Dzitsiuk et
// al. (ICRA 2017) compare their least squares on the distances with.
#pragma once

#include <cstdint>
#include <vector>

#include "core/vec.h"

namespace burin::bench {

struct Candidate {
    Vec3d normal, centre;  // unit, into free space; the middle of what supports it, world, metres
    int support = 0;
};

struct RansacOptions {
    int hypotheses = 100;
    double inlier_m = 0.0025;  // half a voxel of 5 mm
    int least = 20;  // vertices; a plane through a whole chunk has some 64 and more, its corner fewer
    int most_planes = 3;
};

// Planes of three vertices each, one after the other: the one of most vertices nearby, fitted to these by
// least squares, which then count no more. normals: of the vertices, they tell which side is free. Both hold
// 3 numbers a vertex; positions from some place nearby. *state: of the random numbers.
std::vector<Candidate> ransac_planes(const float* positions, const float* normals, std::uint64_t count,
                                     const RansacOptions& options, std::uint64_t* state);

}  // namespace burin::bench
