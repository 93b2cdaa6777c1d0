// SPDX-License-Identifier: MIT
// A camera as the kernels want it: affine maps from world to (fx X + cx Z, fy Y + cy Z, Z), so that the
// projection of a chunk, a corner or a voxel is a sum.
#pragma once

#include "core/camera.h"
#include "core/se3.h"
#include "map/chunk.h"
#include "simd/colour.h"
#include "simd/tsdf.h"
#include "simd/visibility.h"

namespace burin {

class Projector {
  public:
    // cx and cy grow by `shift` pixels; all lengths are scaled by `scale`. Distortion is left out.
    Projector(const Camera& camera, const Se3& T_camera_world, double shift, double scale, double voxel_m);

    void fill(simd::ProjectiveOffsets* table) const;
    void fill(simd::GroupOffsets* table) const;
    void fill(simd::ColourFrame* frame) const;  // its steps
    // Of chunks relative to `origin`.
    void fill(simd::ChunkProjection* projection, Vec3i origin) const;
    // Of voxel 0 of a chunk.
    simd::ProjectiveBase base(Vec3i chunk) const;

  private:
    // The largest offsets within a group of voxels, at its corners: fx X or fy Y, and Z; scaled.
    struct GroupSize {
        double across, z;
    };
    // Writes them and the principal point, and tells them before they are rounded.
    template <class Table>  // GroupOffsets or ChunkProjection
    GroupSize fill_group(Table* table) const;
    // Component k (u, v or z) of a point in voxels: (0, 0, 0) is the low corner of the world's voxel (0, 0,
    // 0).
    double at(int k, double x, double y, double z) const { return offset_[k] + step(k, x, y, z); }
    // Of a difference of points.
    double step(int k, double x, double y, double z) const {
        return row_[k][0] * x + row_[k][1] * y + row_[k][2] * z;
    }
    void put(double x, double y, double z, float* u, float* v, float* w) const {
        *u = static_cast<float>(step(0, x, y, z));
        *v = static_cast<float>(step(1, x, y, z));
        *w = static_cast<float>(step(2, x, y, z));
    }

    // Component k of a voxel's offset (x, y, z) at its own depth: fx X, fy Y or Z, scaled.
    double across(int k, double x, double y, double z) const {
        return step(k, x, y, z) - (k < 2 ? centre_[k] * step(2, x, y, z) : 0);
    }

    double centre_[2];  // principal point
    double row_[3][3];  // a voxel
    double offset_[3];
};

}  // namespace burin
