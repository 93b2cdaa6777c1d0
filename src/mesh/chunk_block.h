// SPDX-License-Identifier: MIT
// The voxels that the vertices of one chunk need, gathered from up to 27 chunks, and the vertices.
#pragma once

#include <algorithm>
#include <cstdint>

#include "map/neighbourhood.h"
#include "map/surface_field.h"
#include "simd/tsdf.h"

namespace burin {

class ChunkBlock {
  public:
    // Gathers what vertices on edges from voxels with z in z_first..z_last (0..8) need: their gradients reach
    // from z_first - 1 to z_last + 2. The volume must not change while the block is used.
    ChunkBlock(const SurfaceField& field, const Neighbourhood& neighbours, int z_first, int z_last);

    // The vertex on the edge from voxel (x, y, z), each in 0..8, along `axis`, which must cross.
    struct Vertex {
        Vec3f position, normal;
        std::uint8_t rgb[3];
    };
    Vertex vertex(int x, int y, int z, int axis, bool with_normal, bool with_colour) const;

  private:
    // Positions -1..9 along each axis.
    static constexpr int kSide = 11;
    static int index(int x, int y, int z) { return ((z + 1) * kSide + y + 1) * kSide + x + 1; }
    Vec3f gradient(int here) const;
    void paint(Vertex* v, int x, int y, int z, int axis, float t) const;
    const std::uint8_t* colour_at(int x, int y, int z) const;
    const std::uint8_t* nearest_colour(int x, int y, int z, int axis, float t) const;

    SurfaceField field_;
    const Neighbourhood& neighbours_;
    // kUnseen where the weight is 0: no stored distance is below -32767, since averages stay between the
    // readings.
    std::int16_t sdf_[kSide * kSide * kSide];
};

// Central differences in stored units per voxel, one-sided where a neighbour was never seen.
inline Vec3f ChunkBlock::gradient(int here) const {
    constexpr int kUnseen = simd::kUnseen, kRow = kSide, kPlane = kSide * kSide;
    const std::int16_t* p = sdf_ + here;
    const int low[3] = {p[-1], p[-kRow], p[-kPlane]}, high[3] = {p[1], p[kRow], p[kPlane]};
    const int least = std::min({low[0], low[1], low[2], high[0], high[1], high[2]});
    Vec3f g;
    if (least != kUnseen) {
        for (int r = 0; r < 3; ++r) g[r] = 0.5f * static_cast<float>(high[r] - low[r]);
        return g;
    }
    for (int r = 0; r < 3; ++r) {
        if (low[r] != kUnseen && high[r] != kUnseen)
            g[r] = 0.5f * static_cast<float>(high[r] - low[r]);
        else if (high[r] != kUnseen)
            g[r] = static_cast<float>(high[r] - *p);
        else if (low[r] != kUnseen)
            g[r] = static_cast<float>(*p - low[r]);
    }
    return g;
}

// In the header, since half of the time of meshing is spent here.
inline ChunkBlock::Vertex ChunkBlock::vertex(int x, int y, int z, int axis, bool with_normal,
                                             bool with_colour) const {
    // Vertices keep this share of an edge between themselves and its ends, so that the vertices of the three
    // edges that meet in a voxel never coincide, however close to zero its distance: no duplicate vertices,
    // no degenerate triangles. 1/256 of a 5 mm voxel is 20 micrometres, and 1/100 float steps at 40 m.
    constexpr float kEndMargin = 1.0f / 256.0f;
    constexpr int kStep[3] = {1, kSide, kSide * kSide};
    const int here = index(x, y, z), there = here + kStep[axis];
    const float a = static_cast<float>(sdf_[here]), b = static_cast<float>(sdf_[there]);
    const float t = std::clamp(a / (a - b), kEndMargin, 1.0f - kEndMargin);
    Vertex v;
    const Vec3i c = neighbours_.chunk;
    const double voxel_m = field_.voxel_m();
    double p[3] = {c.x * 8.0 + x + 0.5, c.y * 8.0 + y + 0.5, c.z * 8.0 + z + 0.5};
    p[axis] += t;
    v.position = {static_cast<float>(p[0] * voxel_m), static_cast<float>(p[1] * voxel_m),
                  static_cast<float>(p[2] * voxel_m)};
    if (with_normal) {
        const Vec3f g = gradient(here) * (1 - t) + gradient(there) * t;
        v.normal = normalised(g);
        if (v.normal == Vec3f{}) v.normal[axis] = b > a ? 1.0f : -1.0f;
    }
    v.rgb[0] = v.rgb[1] = v.rgb[2] = 255;
    if (with_colour && field_.has_colour()) paint(&v, x, y, z, axis, t);
    return v;
}

}  // namespace burin
