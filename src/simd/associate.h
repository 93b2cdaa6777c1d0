// SPDX-License-Identifier: MIT
// Projective data association (Blais and Levine, PAMI 1995, as in KinectFusion 2011, section 3.5): points of
// one camera find the surface that another view holds where they project, and their distance to its plane.
#pragma once

#include <cstdint>

#include "simd/sample.h"

namespace burin::simd {

// What the view holds, rows of `width`, in its own camera coordinates: a point and the unit normal of the
// surface there. A cell whose point or normal is NaN holds nothing. At least one cell.
struct SurfaceGrid {
    int width = 0, height = 0;
    float fx = 0, fy = 0, cx = 0, cy = 0;  // pixels of the grid
    const float* point[3] = {};
    const float* normal[3] = {};
};

struct Association {
    float R[9];       // row-major, camera to view
    float t[3];       // metres
    float most_m;     // points further from their cell's point are no correspondence
    float least_cos;  // of the angle between normals
    float nearest_m;  // points nearer to the view's plane are no correspondence
};

// Points and their unit normals in camera coordinates; (0, 0, 0) is a point without normal, which the angle
// does not gate. Readable, not used, up to the next multiple of 16.
struct OrientedPoints {
    const float *x, *y, *z;
    const float *nx, *ny, *nz;
};

// For `count` <= kSampleBatch points p: q = R p + t, the cell (floor(fx q.x / q.z + cx + 0.5), likewise), its
// point m and normal n. With |q - m| < most_m, |n . (q - m)| < most_m, n . R n_p >= least_cos: distance[i] =
// n . (q - m), gradient[k][i] = n[k]; else NaN and 0, also from `count` to kSampleBatch. Products are summed
// from left to right.
void associate(const SurfaceGrid& grid, const Association& by, const OrientedPoints& points, int count,
               float* distance, float* const* gradient);

namespace scalar {
void associate(const SurfaceGrid& grid, const Association& by, const OrientedPoints& points, int count,
               float* distance, float* const* gradient);
}

}  // namespace burin::simd
