// SPDX-License-Identifier: MIT
// The specification of associate. associate_highway.cpp computes the same bits.
#include "simd/associate.h"

#include <cmath>
#include <limits>

namespace burin::simd {
namespace scalar {

void associate(const SurfaceGrid& grid, const Association& by, const OrientedPoints& points, int count,
               float* distance, float* const* gradient) {
    // A cell's centre is at integers.
    const float cx = grid.cx + 0.5f, cy = grid.cy + 0.5f;
    const float width = static_cast<float>(grid.width), height = static_cast<float>(grid.height);
    const float most_squared = by.most_m * by.most_m;
    const float* R = by.R;
    const auto find = [&](int i) -> int {
        const float x = points.x[i], y = points.y[i], z = points.z[i];
        const float qx = ((R[0] * x + R[1] * y) + R[2] * z) + by.t[0];
        const float qy = ((R[3] * x + R[4] * y) + R[5] * z) + by.t[1];
        const float qz = ((R[6] * x + R[7] * y) + R[8] * z) + by.t[2];
        if (!(qz > by.nearest_m)) return -1;
        const float u = (grid.fx * qx) / qz + cx, v = (grid.fy * qy) / qz + cy;
        if (!(u >= 0 && u < width && v >= 0 && v < height)) return -1;
        const int cell = static_cast<int>(v) * grid.width + static_cast<int>(u);
        const float nx = grid.normal[0][cell], ny = grid.normal[1][cell], nz = grid.normal[2][cell];
        const float dx = qx - grid.point[0][cell], dy = qy - grid.point[1][cell],
                    dz = qz - grid.point[2][cell];
        const float d = (nx * dx + ny * dy) + nz * dz;
        if (!((dx * dx + dy * dy) + dz * dz < most_squared && std::fabs(d) < by.most_m)) return -1;
        const float px = points.nx[i], py = points.ny[i], pz = points.nz[i];
        const float rx = (R[0] * px + R[1] * py) + R[2] * pz;
        const float ry = (R[3] * px + R[4] * py) + R[5] * pz;
        const float rz = (R[6] * px + R[7] * py) + R[8] * pz;
        const bool bare = px == 0 && py == 0 && pz == 0;
        if (!(bare || (nx * rx + ny * ry) + nz * rz >= by.least_cos)) return -1;
        distance[i] = d;
        return cell;
    };
    for (int i = 0; i < kSampleBatch; ++i) {
        const int cell = i < count ? find(i) : -1;
        if (cell < 0) distance[i] = std::numeric_limits<float>::quiet_NaN();
        for (int k = 0; k < 3; ++k) gradient[k][i] = cell < 0 ? 0.0f : grid.normal[k][cell];
    }
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
void associate(const SurfaceGrid& grid, const Association& by, const OrientedPoints& points, int count,
               float* distance, float* const* gradient) {
    scalar::associate(grid, by, points, count, distance, gradient);
}
#endif

}  // namespace burin::simd
