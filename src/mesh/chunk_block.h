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
    float max_jump_voxels = 7.0f;  // larger differences along an edge are no surface
};

class ChunkBlock {
  public:
    static constexpr int kSide = 11;

    // The chunk must exist. The volume must not change while the block is used. Most chunks hold no surface:
    // then empty() is true and nothing has been gathered.
    ChunkBlock(const Volume& volume, std::uint32_t slot, const MeshOptions& options);

    bool empty() const { return empty_; }
    const Neighbourhood& neighbours() const { return neighbours_; }
    int sdf(int x, int y, int z) const { return sdf_[index(x, y, z)]; }

    // Bit x + 1 of a row: the cell with low corner (x, y, z), x in -1..7, y and z in -1..7, has eight known
    // corners, a crossing, and no jump.
    std::uint16_t active_cells(int y, int z) const { return active_[(z + 1) * 9 + y + 1]; }
    // Bit x + 1 of a row: voxel (x, y, z), each in -1..8, is inside (sdf < 0).
    std::uint16_t inside_row(int y, int z) const { return inside_[z + 1][y + 1]; }
    // Corner signs of a cell as a marching cubes configuration.
    int configuration(int x, int y, int z) const;

    // Before vertex(): also gathers what gradients need.
    void gather_weights();

    // The vertex on the edge from voxel (x, y, z), each in 0..8, along `axis`, which must cross.
    struct Vertex {
        Vec3f position, normal;
        std::uint8_t rgb[3];
    };
    Vertex vertex(int x, int y, int z, int axis) const;

  private:
    static int index(int x, int y, int z) { return ((z + 1) * kSide + y + 1) * kSide + x + 1; }
    void classify(std::uint16_t min_weight);
    bool find_active();
    void drop_jumps(int max_jump);
    template <class T>
    void gather(const T* (*field)(const ChunkGeometry&), T* to) const;
    Vec3f gradient(int x, int y, int z) const;

    const Volume& volume_;
    Neighbourhood neighbours_;
    bool empty_ = true;
    std::uint16_t known_[10][10], inside_[10][10];  // rows at y, z in -1..8; bit x + 1
    std::uint16_t active_[9 * 9];
    std::int16_t sdf_[kSide * kSide * kSide];
    std::uint16_t weight_[kSide * kSide * kSide];
};

}  // namespace burin
