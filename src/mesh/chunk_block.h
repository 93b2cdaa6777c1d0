// SPDX-License-Identifier: MIT
// The voxels that the vertices of one chunk need, gathered from up to 27 chunks, and the vertices.
#pragma once

#include <cstdint>

#include "map/neighbourhood.h"

namespace burin {

class ChunkBlock {
  public:
    // Gathers what vertices on edges from voxels with z in z_first..z_last (0..8) need: their gradients reach
    // from z_first - 1 to z_last + 2. The volume must not change while the block is used.
    ChunkBlock(const Volume& volume, const Neighbourhood& neighbours, int z_first, int z_last);

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
    const std::uint8_t* colour_at(int x, int y, int z) const;
    const std::uint8_t* nearest_colour(int x, int y, int z, int axis, float t) const;

    const Volume& volume_;
    const Neighbourhood& neighbours_;
    std::int16_t sdf_[kSide * kSide * kSide];  // kUnseen where the weight is 0
};

}  // namespace burin
