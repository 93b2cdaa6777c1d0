// SPDX-License-Identifier: MIT
// The voxels that meshing one chunk needs, gathered from up to 27 chunks: positions -1..9 along each axis.
// Cells at -1..8 decide which edges carry a vertex; gradients at 0..8 reach one voxel further.
#pragma once

#include <cstdint>

#include "map/neighbourhood.h"
#include "map/volume.h"

namespace burin {

struct MeshOptions {
    float min_weight = 0.5f;       // observations; voxels with less are unknown
    float max_jump_voxels = 6.0f;  // larger differences along an edge are no surface
};

class ChunkBlock {
  public:
    static constexpr int kSide = 11;

    // The chunk must exist. The volume must not change while the block is used.
    ChunkBlock(const Volume& volume, std::uint32_t slot, const MeshOptions& options);

    const Neighbourhood& neighbours() const { return neighbours_; }
    int sdf(int x, int y, int z) const { return sdf_[index(x, y, z)]; }
    bool known(int x, int y, int z) const { return known_[index(x, y, z)]; }
    bool seen(int x, int y, int z) const { return seen_[index(x, y, z)]; }

    // Bit x + 1 of a row: the cell with low corner (x, y, z), x in -1..7, y and z in -1..7, has eight known
    // corners, a crossing, and no jump.
    std::uint16_t active_cells(int y, int z) const { return active_[(z + 1) * 9 + y + 1]; }
    // Corner signs of a cell as a marching cubes configuration.
    int configuration(int x, int y, int z) const;

    // The vertex on the edge from voxel (x, y, z), each in 0..8, along `axis`, which must cross.
    struct Vertex {
        Vec3f position, normal;
        std::uint8_t rgb[3];
    };
    Vertex vertex(int x, int y, int z, int axis) const;

  private:
    static int index(int x, int y, int z) { return ((z + 1) * kSide + y + 1) * kSide + x + 1; }
    void find_active(int max_jump);
    Vec3f gradient(int x, int y, int z) const;

    const Volume& volume_;
    Neighbourhood neighbours_;
    std::int16_t sdf_[kSide * kSide * kSide];
    bool known_[kSide * kSide * kSide];  // weight >= min_weight
    bool seen_[kSide * kSide * kSide];   // weight > 0: good enough for gradients
    std::uint16_t active_[9 * 9];
};

}  // namespace burin
