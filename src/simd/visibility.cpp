// SPDX-License-Identifier: MIT
// The specification of the kernels of visibility.h.
#include "simd/visibility.h"

#include <algorithm>
#include <cmath>

namespace burin::simd {

namespace scalar {

void project_chunks(const ChunkProjection& p, ChunkBatch* batch) {
    for (int i = 0; i < kBatchChunks; ++i) {
        const float x = static_cast<float>(batch->x[i]), y = static_cast<float>(batch->y[i]),
                    z = static_cast<float>(batch->z[i]);
        const auto at = [&](const float step[3], float origin) {
            return ((x * step[0] + y * step[1]) + z * step[2]) + origin;
        };
        const float u = at(p.step_u, p.origin_u), v = at(p.step_v, p.origin_v), w = at(p.step_z, p.origin_z);
        batch->base_u[i] = u;
        batch->base_v[i] = v;
        batch->base_z[i] = w;
        for (int k = 0; k < 8; ++k) {
            const float corner_z = w + p.corner_z[k], inverse_z = 1.0f / corner_z;
            const float corner_u = (u + p.corner_u[k]) * inverse_z,
                        corner_v = (v + p.corner_v[k]) * inverse_z;
            // Written like a vector's minimum: of a NaN and a number, the number that came last.
            batch->least_u[i] = k > 0 && batch->least_u[i] < corner_u ? batch->least_u[i] : corner_u;
            batch->most_u[i] = k > 0 && batch->most_u[i] > corner_u ? batch->most_u[i] : corner_u;
            batch->least_v[i] = k > 0 && batch->least_v[i] < corner_v ? batch->least_v[i] : corner_v;
            batch->most_v[i] = k > 0 && batch->most_v[i] > corner_v ? batch->most_v[i] : corner_v;
            batch->least_z[i] = k > 0 && batch->least_z[i] < corner_z ? batch->least_z[i] : corner_z;
            batch->most_z[i] = k > 0 && batch->most_z[i] > corner_z ? batch->most_z[i] : corner_z;
        }
        const auto larger = [](float a, float b) { return a > b ? a : b; };
        const auto steps = [&](const float pixel[3], const float depth[3], float low, float high) {
            const auto step = [&](int axis) {
                return larger(std::fabs(pixel[axis] - low * depth[axis]),
                              std::fabs(pixel[axis] - high * depth[axis]));
            };
            return 1.5f * (step(0) + step(1)) + 0.5f * step(2);
        };
        const auto shear = [&](float centre, float low, float high) {
            return p.most_z * larger(std::fabs(centre - low), std::fabs(centre - high));
        };
        const float across = larger(steps(p.voxel_u, p.voxel_z, batch->least_u[i], batch->most_u[i]),
                                    steps(p.voxel_v, p.voxel_z, batch->least_v[i], batch->most_v[i]));
        const float sheared = larger(shear(p.centre_u, batch->least_u[i], batch->most_u[i]),
                                     shear(p.centre_v, batch->least_v[i], batch->most_v[i]));
        batch->group_reach[i] = larger(larger(across, sheared), p.most_across) / batch->least_z[i];
    }
}

void double_ranges(const std::uint32_t* from, int count, int stride, int side, std::uint32_t* to) {
    const auto joined = [](std::uint32_t a, std::uint32_t b) {
        return std::min(a & 0xffff, b & 0xffff) | std::min(a & 0xffff0000u, b & 0xffff0000u);
    };
    const std::ptrdiff_t down = static_cast<std::ptrdiff_t>(side) * stride;
    for (int i = 0; i < count; ++i)
        to[i] = joined(joined(from[i], from[i + side]), joined(from[i + down], from[i + down + side]));
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
void project_chunks(const ChunkProjection& projection, ChunkBatch* batch) {
    scalar::project_chunks(projection, batch);
}
void double_ranges(const std::uint32_t* from, int count, int stride, int side, std::uint32_t* to) {
    scalar::double_ranges(from, count, stride, side, to);
}
#endif

}  // namespace burin::simd
