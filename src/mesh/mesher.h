// SPDX-License-Identifier: MIT
// Marching cubes (Lorensen & Cline 1987) over the chunks: the whole map with every vertex once, or one chunk
// at a time for streaming.
#pragma once

#include <cstdint>

#include "core/arena.h"
#include "core/jobs.h"
#include "map/neighbourhood.h"
#include "map/surface_field.h"
#include "mesh/chunk_cells.h"

namespace burin {

struct MeshBuffers {                     // caller's memory; all but positions and triangles may be null
    float* positions = nullptr;          // 3 a vertex, metres
    float* normals = nullptr;            // 3 a vertex
    std::uint8_t* colours = nullptr;     // 3 a vertex
    std::uint32_t* triangles = nullptr;  // 3 a triangle
};

struct MeshCounts {
    std::uint64_t vertices = 0, triangles = 0;
};

// One chunk's share of buffers that hold several; its triangles count its vertices from 0.
struct ChunkMeshRange {
    std::uint64_t first_vertex = 0, vertices = 0, first_triangle = 0, triangles = 0;
};

class Mesher {
  public:
    void place(Arena& arena, std::uint32_t capacity);

    // Pass one: which edges carry vertices, and how many triangles each chunk has. extract() must follow
    // before the volume changes, with the same options; vertices and triangles come in key order of their
    // chunks, whatever the slots.
    MeshCounts count(const SurfaceField& field, const MeshOptions& options, Jobs& jobs);
    // Pass two, into buffers of at least the counted sizes.
    void extract(const SurfaceField& field, const MeshOptions& options, const MeshBuffers& out,
                 Jobs& jobs) const;

  private:
    // An edge belongs to the chunk of its low voxel. Those that carry a vertex are bits: group = axis * 8 +
    // z, bit 8 * y + x. 320 bytes a chunk.
    struct ChunkMesh {
        std::uint64_t active[8];  // cells, bit 8 * y + x of word z
        std::uint64_t edges[24];
        std::uint16_t rank[24];  // vertices of this chunk before the group
        std::uint32_t first_vertex, first_triangle, vertices, triangles;
    };
    void find_cells(const SurfaceField& field, std::uint32_t slot, const CellRule& rule);
    void find_edges(const SurfaceField& field, std::uint32_t slot, const CellRule& rule);
    void extract_chunk(const SurfaceField& field, std::uint32_t slot, const CellRule& rule,
                       const MeshBuffers& out) const;
    template <class Put>
    void for_edges_beyond(const Neighbourhood& neighbours, Put&& put) const;

    ChunkMesh* chunks_ = nullptr;     // by slot
    std::uint32_t* order_ = nullptr;  // slots in key order
};

inline constexpr int kMaxChunkVertices = 3 * 8 * 9 * 9;  // edges on and inside a 9 x 9 x 9 lattice of voxels
inline constexpr int kMaxChunkTriangles = 5 * 512;

// The cells of the chunk in the middle by themselves. `out` must hold kMaxChunkVertices and
// kMaxChunkTriangles. Positions on the border equal those of the neighbour's mesh bit for bit.
MeshCounts mesh_chunk(const SurfaceField& field, const Neighbourhood& neighbours, const MeshOptions& options,
                      const MeshBuffers& out);
// What mesh_chunk would write.
MeshCounts count_chunk(const SurfaceField& field, const Neighbourhood& neighbours,
                       const MeshOptions& options);

// See burin_mesh_remove_small.
MeshCounts remove_small_components(const MeshBuffers& mesh, MeshCounts counts, std::uint64_t min_triangles,
                                   std::uint32_t* scratch);

}  // namespace burin
