// SPDX-License-Identifier: MIT
// Signs of the voxels of one chunk and of those just beyond it, as bits, and which of its cells hold surface.
#pragma once

#include <cstdint>

#include "map/neighbourhood.h"
#include "map/surface_field.h"
#include "simd/classify.h"

namespace burin {

struct MeshOptions {
    float min_weight = 0.5f;       // observations; voxels with less are unknown
    float max_jump_voxels = 7.0f;  // larger differences along an edge are no surface
    bool operator==(const MeshOptions&) const = default;
};

// The same in stored units.
struct CellRule {
    CellRule(const SurfaceField& field, const MeshOptions& options);
    int max_jump;
    // An edge that crosses by more than max_jump has one end below limits.deep and the other above
    // limits.high.
    simd::CellLimits limits;
};

// Bits of rows and columns of one plane of cells, one step further along x (and y).
inline constexpr std::uint64_t kFirstColumn = 0x0101010101010101u;
inline std::uint64_t next_x(std::uint64_t plane, std::uint64_t beyond) {
    return (plane >> 1 & ~(kFirstColumn << 7)) | (beyond & kFirstColumn) << 7;
}
inline std::uint64_t next_y(std::uint64_t plane, std::uint64_t beyond) { return plane >> 8 | beyond << 56; }
inline std::uint64_t last_x(std::uint64_t plane, std::uint64_t before) {
    return (plane << 1 & ~kFirstColumn) | (before >> 7 & kFirstColumn);
}
inline std::uint64_t last_y(std::uint64_t plane, std::uint64_t before) { return plane << 8 | before >> 56; }

class ChunkCells {
  public:
    // upper[i]: the slot of the chunk at (i & 1, i >> 1 & 1, i >> 2) from this one, kNoChunk where absent.
    // The volume must not change while this is used.
    ChunkCells(const SurfaceField& field, const std::uint32_t upper[8], const CellRule& rule);

    // The cells with low corner (x, y, z), each in 0..7, that have eight known corners, a crossing, and no
    // jump: bit 8 * y + x of word z. False when there is none.
    bool find_active(std::uint64_t active[8]) const;

    // Bit 8 * y + x: voxels (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1) of plane z in 0..8 are inside (sdf
    // < 0); those of absent chunks are not.
    struct Plane {
        std::uint64_t at, x, y, xy;
    };
    const Plane& inside(int z) const { return inside_[z]; }
    // Corner signs of a cell as a marching cubes configuration.
    int configuration(int bit, int z) const {
        const Plane &low = inside_[z], &high = inside_[z + 1];
        return static_cast<int>((low.at >> bit & 1) | (low.x >> bit & 1) << 1 | (low.y >> bit & 1) << 2 |
                                (low.xy >> bit & 1) << 3 | (high.at >> bit & 1) << 4 |
                                (high.x >> bit & 1) << 5 | (high.y >> bit & 1) << 6 |
                                (high.xy >> bit & 1) << 7);
    }

  private:
    template <class Field>
    Plane plane(Field field, int z) const;
    bool jumps(int x, int y, int z) const;

    SurfaceField field_;
    const std::uint32_t* upper_;
    int max_jump_;
    simd::ChunkBits bits_[8];
    Plane inside_[9];
};

}  // namespace burin
