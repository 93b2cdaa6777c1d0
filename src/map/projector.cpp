// SPDX-License-Identifier: MIT
#include "map/projector.h"

#include <algorithm>
#include <cmath>

namespace burin {

Projector::Projector(const Camera& c, const Se3& T_camera_world, double shift, double scale, double voxel_m) {
    const double cx = c.cx + shift, cy = c.cy + shift;
    centre_[0] = cx;
    centre_[1] = cy;
    const Mat3d& R = T_camera_world.R;
    const Vec3d& t = T_camera_world.t;
    const double voxel = scale * voxel_m;
    for (int k = 0; k < 3; ++k) {
        row_[0][k] = voxel * (c.fx * R(0, k) + cx * R(2, k));
        row_[1][k] = voxel * (c.fy * R(1, k) + cy * R(2, k));
        row_[2][k] = voxel * R(2, k);
    }
    offset_[0] = scale * (c.fx * t.x + cx * t.z);
    offset_[1] = scale * (c.fy * t.y + cy * t.z);
    offset_[2] = scale * t.z;
}

void Projector::fill(simd::ProjectiveOffsets* table) const {
    for (int i = 0; i < simd::kBlocks; ++i) {
        const int x = 4 * (i & 1), y = 4 * (i >> 1 & 1), z = i >> 2;
        simd::ProjectiveOffsets::Block& block = table->block[i];
        for (int k = 0; k < simd::kBlockVoxels; ++k)
            put(x + (k & 3), y + (k >> 2), z, &block.u[k], &block.v[k], &block.z[k]);
    }
}

template <class Table>
Projector::GroupSize Projector::fill_group(Table* table) const {
    double most_across = 0, most_z = 0;
    for (int k = 0; k < 8; ++k) {
        const double x = k & 1 ? 1.5 : -1.5, y = k & 2 ? 1.5 : -1.5, z = k & 4 ? 0.5 : -0.5;
        most_across = std::max({most_across, across(0, x, y, z), across(1, x, y, z)});
        most_z = std::max(most_z, across(2, x, y, z));
    }
    table->most_across = static_cast<float>(most_across);
    table->most_z = static_cast<float>(most_z);
    table->centre_u = static_cast<float>(centre_[0]);
    table->centre_v = static_cast<float>(centre_[1]);
    return {most_across, most_z};
}

void Projector::fill(simd::GroupOffsets* table) const {
    const GroupSize most = fill_group(table);
    for (int k = 0; k < simd::kGroupVoxels; ++k) {
        const double x = (k & 3) - 1.5, y = (k >> 3) - 1.5, z = (k >> 2 & 1) - 0.5;
        const auto part = [](double value, double largest) {
            return static_cast<std::int16_t>(std::lround(32767 * value / largest));
        };
        table->across_u[k] = part(across(0, x, y, z), most.across);
        table->across_v[k] = part(across(1, x, y, z), most.across);
        table->z[k] = part(across(2, x, y, z), most.z);
    }
    for (int g = 0; g < simd::kGroups; ++g)
        put(4 * (g & 1) + 1.5, 4 * (g >> 1 & 1) + 1.5, 2 * (g >> 2) + 0.5, &table->middle_u[g],
            &table->middle_v[g], &table->middle_z[g]);
}

void Projector::fill(simd::ColourFrame* frame) const {
    for (int k = 0; k < 3; ++k)
        put(k == 0, k == 1, k == 2, &frame->step_u[k], &frame->step_v[k], &frame->step_z[k]);
}

void Projector::fill(simd::ChunkProjection* p, Vec3i origin) const {
    for (int k = 0; k < 3; ++k)
        put(k == 0 ? kChunkSide : 0, k == 1 ? kChunkSide : 0, k == 2 ? kChunkSide : 0, &p->step_u[k],
            &p->step_v[k], &p->step_z[k]);
    for (int k = 0; k < 3; ++k) put(k == 0, k == 1, k == 2, &p->voxel_u[k], &p->voxel_v[k], &p->voxel_z[k]);
    fill_group(p);
    const simd::ProjectiveBase first = base(origin);
    p->origin_u = first.u;
    p->origin_v = first.v;
    p->origin_z = first.z;
    for (int i = 0; i < 8; ++i)
        put(7 * (i & 1), 7 * (i >> 1 & 1), 7 * (i >> 2), &p->corner_u[i], &p->corner_v[i], &p->corner_z[i]);
}

simd::ProjectiveBase Projector::base(Vec3i c) const {
    const double x = c.x * double{kChunkSide} + 0.5, y = c.y * double{kChunkSide} + 0.5,
                 z = c.z * double{kChunkSide} + 0.5;
    return {static_cast<float>(at(0, x, y, z)), static_cast<float>(at(1, x, y, z)),
            static_cast<float>(at(2, x, y, z))};
}

}  // namespace burin
