// SPDX-License-Identifier: MIT
#include "mesh/mesher.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/marching_cubes_table.h"

namespace burin {
namespace {

void write_vertex(const ChunkBlock::Vertex& v, std::uint64_t at, const MeshBuffers& out) {
    for (int k = 0; k < 3; ++k) {
        out.positions[3 * at + static_cast<std::uint64_t>(k)] = v.position[k];
        if (out.normals) out.normals[3 * at + static_cast<std::uint64_t>(k)] = v.normal[k];
        if (out.colours) out.colours[3 * at + static_cast<std::uint64_t>(k)] = v.rgb[k];
    }
}

// Calls body(x, y, z, triangles of the cell) for the chunk's own active cells in (z, y, x) order.
template <class Body>
void for_own_cells(const ChunkBlock& block, Body&& body) {
    for (int z = 0; z < 8; ++z)
        for (int y = 0; y < 8; ++y)
            for (unsigned row = block.active_cells(y, z) >> 1; row != 0; row &= row - 1) {
                const int x = std::countr_zero(row);
                body(x, y, z, kMarchingCubes[static_cast<std::size_t>(block.configuration(x, y, z))]);
            }
}

// An own edge carries a vertex when it crosses and one of the four cells around it is active.
void find_edges(const ChunkBlock& block, std::uint64_t edges[24]) {
    for (int z = 0; z < 8; ++z) {
        std::uint64_t groups[3] = {};
        for (int y = 0; y < 8; ++y) {
            // Bit x + 1 for cell x; shifted left by one, the same bit stands for cell x - 1.
            const unsigned here = block.active_cells(y, z), below_y = block.active_cells(y - 1, z),
                           below_z = block.active_cells(y, z - 1),
                           below_both = block.active_cells(y - 1, z - 1);
            const unsigned around[3] = {here | below_y | below_z | below_both,
                                        here | here << 1 | below_z | below_z << 1,
                                        here | here << 1 | below_y | below_y << 1};
            const unsigned row = block.inside_row(y, z);
            const unsigned cross[3] = {row ^ row >> 1, row ^ block.inside_row(y + 1, z),
                                       row ^ block.inside_row(y, z + 1)};
            for (int axis = 0; axis < 3; ++axis)
                groups[axis] |= static_cast<std::uint64_t>(around[axis] >> 1 & cross[axis] >> 1 & 0xff)
                                << 8 * y;
        }
        for (int axis = 0; axis < 3; ++axis) edges[axis * 8 + z] = groups[axis];
    }
}

}  // namespace

void Mesher::place(Arena& arena, std::uint32_t capacity) {
    chunks_ = arena.allocate<ChunkMesh>(capacity, 64);
    order_ = arena.allocate<std::uint32_t>(capacity, 64);
}

MeshCounts Mesher::count(const Volume& volume, const MeshOptions& options, Jobs& jobs) {
    volume.sorted_slots(order_);
    constexpr int kPerItem = 16;
    const int live = static_cast<int>(volume.live());
    jobs.run((live + kPerItem - 1) / kPerItem, [&](int item, int) {
        for (int slot = item * kPerItem; slot < std::min(live, (item + 1) * kPerItem); ++slot) {
            ChunkMesh& mesh = chunks_[slot];
            const ChunkBlock block(volume, static_cast<std::uint32_t>(slot), options);
            if (block.empty()) {
                mesh = {};
                continue;
            }
            find_edges(block, mesh.edges);
            std::uint32_t vertices = 0;
            for (int group = 0; group < 24; ++group) {
                mesh.rank[group] = static_cast<std::uint16_t>(vertices);
                vertices += static_cast<std::uint32_t>(std::popcount(mesh.edges[group]));
            }
            mesh.vertices = vertices;
            mesh.triangles = 0;
            for_own_cells(block,
                          [&](int, int, int, const CubeTriangles& cell) { mesh.triangles += cell.count; });
        }
    });
    MeshCounts total;
    for (int i = 0; i < live; ++i) {
        ChunkMesh& mesh = chunks_[order_[i]];
        mesh.first_vertex = static_cast<std::uint32_t>(total.vertices);
        mesh.first_triangle = static_cast<std::uint32_t>(total.triangles);
        total.vertices += mesh.vertices;
        total.triangles += mesh.triangles;
    }
    return total;
}

void Mesher::extract(const Volume& volume, const MeshOptions& options, const MeshBuffers& out,
                     Jobs& jobs) const {
    constexpr int kPerItem = 16;
    const int live = static_cast<int>(volume.live());
    jobs.run((live + kPerItem - 1) / kPerItem, [&](int item, int) {
        for (int slot = item * kPerItem; slot < std::min(live, (item + 1) * kPerItem); ++slot)
            if (chunks_[slot].vertices > 0 || chunks_[slot].triangles > 0)
                extract_chunk(volume, static_cast<std::uint32_t>(slot), options, out);
    });
}

void Mesher::extract_chunk(const Volume& volume, std::uint32_t slot, const MeshOptions& options,
                           const MeshBuffers& out) const {
    ChunkBlock block(volume, slot, options);
    block.gather_weights();
    const ChunkMesh& mesh = chunks_[slot];
    std::uint64_t at = mesh.first_vertex;
    for (int group = 0; group < 24; ++group)
        for (std::uint64_t left = mesh.edges[group]; left != 0; left &= left - 1) {
            const int bit = std::countr_zero(left);
            write_vertex(block.vertex(bit & 7, bit >> 3, group & 7, group >> 3), at++, out);
        }

    std::uint32_t* triangle = out.triangles + 3 * std::uint64_t{mesh.first_triangle};
    for_own_cells(block, [&](int x, int y, int z, const CubeTriangles& cell) {
        std::uint32_t id[12];
        for (unsigned left = cell.edges; left != 0; left &= left - 1) {
            const int e = std::countr_zero(left);
            const CubeEdge edge = kCubeEdges[static_cast<std::size_t>(e)];
            const int ex = x + (edge.corner & 1), ey = y + (edge.corner >> 1 & 1),
                      ez = z + (edge.corner >> 2);
            // Known corners exist, so their chunk does.
            const ChunkMesh& owner = chunks_[block.neighbours().slot[Neighbourhood::place(ex, ey, ez)]];
            const int group = edge.axis * 8 + (ez & 7), bit = (ey & 7) * 8 + (ex & 7);
            const std::uint64_t before = owner.edges[group] & ((std::uint64_t{1} << bit) - 1);
            id[e] =
                owner.first_vertex + owner.rank[group] + static_cast<std::uint32_t>(std::popcount(before));
        }
        for (int t = 0; t < cell.count; ++t)
            for (int k = 0; k < 3; ++k) *triangle++ = id[cell.edge[t][k]];
    });
}

MeshCounts mesh_chunk(const Volume& volume, std::uint32_t slot, const MeshOptions& options,
                      const MeshBuffers& out) {
    ChunkBlock block(volume, slot, options);
    if (block.empty()) return {};
    block.gather_weights();
    constexpr std::uint16_t kNone = 0xffff;
    std::uint16_t id[3 * 9 * 9 * 9];
    std::memset(id, 0xff, sizeof id);
    MeshCounts counts;
    for_own_cells(block, [&](int x, int y, int z, const CubeTriangles& cell) {
        for (int t = 0; t < cell.count; ++t)
            for (int k = 0; k < 3; ++k) {
                const CubeEdge edge = kCubeEdges[cell.edge[t][k]];
                const int ex = x + (edge.corner & 1), ey = y + (edge.corner >> 1 & 1),
                          ez = z + (edge.corner >> 2);
                std::uint16_t& vertex = id[((edge.axis * 9 + ez) * 9 + ey) * 9 + ex];
                if (vertex == kNone) {
                    vertex = static_cast<std::uint16_t>(counts.vertices);
                    write_vertex(block.vertex(ex, ey, ez, edge.axis), counts.vertices++, out);
                }
                out.triangles[3 * counts.triangles + static_cast<std::uint64_t>(k)] = vertex;
                if (k == 2) ++counts.triangles;
            }
    });
    return counts;
}

}  // namespace burin
