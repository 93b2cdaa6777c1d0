// SPDX-License-Identifier: MIT
#include "mesh/mesher.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/marching_cubes_table.h"
#include "mesh/chunk_block.h"

namespace burin {
namespace {

inline void write_vertex(const ChunkBlock& block, int x, int y, int z, int axis, std::uint64_t at,
                         const MeshBuffers& out) {
    const ChunkBlock::Vertex v = block.vertex(x, y, z, axis, out.normals != nullptr, out.colours != nullptr);
    std::memcpy(out.positions + 3 * at, &v.position, sizeof v.position);
    if (out.normals) std::memcpy(out.normals + 3 * at, &v.normal, sizeof v.normal);
    if (out.colours) std::memcpy(out.colours + 3 * at, v.rgb, sizeof v.rgb);
}

// Calls body(bit, z, triangles of the cell) for the active cells in (z, y, x) order; bit = 8 * y + x.
template <class Body>
void for_cells(const std::uint64_t active[8], const ChunkCells& cells, Body&& body) {
    for (int z = 0; z < 8; ++z)
        for (std::uint64_t left = active[z]; left != 0; left &= left - 1) {
            const int bit = std::countr_zero(left);
            body(bit, z, kMarchingCubes[static_cast<std::size_t>(cells.configuration(bit, z))]);
        }
}

// A place for every edge from voxels at 0..8: EdgePlaces::of(x, y, z, axis), and the step to it from a cell's
// low corner for the 12 edges of a cell.
struct EdgePlaces {
    static constexpr int kSide = 9, kCount = 3 * kSide * kSide * kSide;
    static constexpr int of(int x, int y, int z, int axis) {
        return 3 * ((z * kSide + y) * kSide + x) + axis;
    }
    int step[12] = {};
    constexpr EdgePlaces() {
        for (std::size_t e = 0; e < 12; ++e) {
            const CubeEdge edge = kCubeEdges[e];
            step[e] = of(edge.corner & 1, edge.corner >> 1 & 1, edge.corner >> 2, edge.axis);
        }
    }
};
constexpr EdgePlaces kEdgePlaces;

// Slots of the chunks at (i & 1, i >> 1 & 1, i >> 2) times `side` from a chunk.
void find_beside(const SurfaceField& field, std::uint32_t slot, int side, std::uint32_t out[8]) {
    const Vec3i c = unpack_key(field.key(slot));
    out[0] = slot;
    for (int i = 1; i < 8; ++i) {
        const Vec3i beside{c.x + side * (i & 1), c.y + side * (i >> 1 & 1), c.z + side * (i >> 2)};
        out[i] = chunk_in_range(beside) ? field.find(pack_key(beside)) : kNoChunk;
    }
}

void upper_of(const Neighbourhood& neighbours, std::uint32_t out[8]) {
    for (int i = 0; i < 8; ++i)
        out[i] = neighbours.slot[((i >> 2) + 1) * 9 + ((i >> 1 & 1) + 1) * 3 + (i & 1) + 1];
}

// First and last plane of cells that hold surface.
struct Planes {
    int first = 0, last = 7;
    explicit Planes(const std::uint64_t active[8]) {
        while (first < 7 && active[first] == 0) ++first;
        while (last > first && active[last] == 0) --last;
    }
};

constexpr std::size_t kPerItem = 16;  // chunks a step of the job counter, some 10 us

template <class Body>
void for_slots(Jobs& jobs, const SurfaceField& field, Body&& body) {
    jobs.run_pieces(field.numbers(), kPerItem, [&](std::size_t i) {
        const std::uint32_t slot = field.slot_at(static_cast<std::uint32_t>(i));
        if (field.holds(slot)) body(slot);
    });
}

}  // namespace

void Mesher::place(Arena& arena, std::uint32_t capacity) {
    chunks_ = arena.allocate<ChunkMesh>(capacity, 64);
    order_ = arena.allocate<std::uint32_t>(capacity, 64);
}

void Mesher::find_cells(const SurfaceField& field, std::uint32_t slot, const CellRule& rule) {
    ChunkMesh& mesh = chunks_[slot];
    std::memset(mesh.active, 0, sizeof mesh.active);
    mesh.triangles = 0;
    std::uint32_t upper[8];
    find_beside(field, slot, 1, upper);
    const ChunkCells cells(field, upper, rule);
    if (!cells.find_active(mesh.active)) return;
    for_cells(mesh.active, cells, [&](int, int, const CubeTriangles& cell) { mesh.triangles += cell.count; });
}

// An own edge carries a vertex when it crosses and one of the four cells around it is active.
void Mesher::find_edges(const SurfaceField& field, std::uint32_t slot, const CellRule& rule) {
    ChunkMesh& mesh = chunks_[slot];
    static constexpr std::uint64_t kNone[8] = {};
    const std::uint64_t* active[8];
    std::uint32_t lower[8];
    find_beside(field, slot, -1, lower);
    std::uint64_t any = 0;
    for (int i = 0; i < 8; ++i) {
        active[i] = lower[i] == kNoChunk ? kNone : chunks_[lower[i]].active;
        for (int z = i < 4 ? 0 : 7; z < 8; ++z) any |= active[i][z];
    }
    mesh.vertices = 0;
    std::memset(mesh.edges, 0, sizeof mesh.edges);
    if (any == 0) return;

    std::uint32_t upper[8];
    find_beside(field, slot, 1, upper);
    const ChunkCells cells(field, upper, rule);
    struct Cells {
        std::uint64_t at, x, y, xy;  // bit 8 * y + x: the cell there, and those one step before
    };
    const auto plane = [&](int z) {
        const std::uint64_t* const* a = z < 0 ? active + 4 : active;
        z &= 7;
        const std::uint64_t y = last_y(a[0][z], a[2][z]);
        return Cells{a[0][z], last_x(a[0][z], a[1][z]), y, last_x(y, last_y(a[1][z], a[3][z]))};
    };
    Cells below = plane(-1);
    for (int z = 0; z < 8; ++z) {
        const Cells here = plane(z);
        const ChunkCells::Plane& inside = cells.inside(z);
        mesh.edges[z] = (here.at | here.y | below.at | below.y) & (inside.at ^ inside.x);
        mesh.edges[8 + z] = (here.at | here.x | below.at | below.x) & (inside.at ^ inside.y);
        mesh.edges[16 + z] = (here.at | here.x | here.y | here.xy) & (inside.at ^ cells.inside(z + 1).at);
        below = here;
    }
    for (int group = 0; group < 24; ++group) {
        mesh.rank[group] = static_cast<std::uint16_t>(mesh.vertices);
        mesh.vertices += static_cast<std::uint32_t>(std::popcount(mesh.edges[group]));
    }
}

MeshCounts Mesher::count(const SurfaceField& field, const MeshOptions& options, Jobs& jobs) {
    std::uint32_t chunks = 0;
    for (std::uint32_t i = 0; i < field.numbers(); ++i)
        if (const std::uint32_t slot = field.slot_at(i); field.holds(slot)) order_[chunks++] = slot;
    std::sort(order_, order_ + chunks,
              [&field](std::uint32_t a, std::uint32_t b) { return field.key(a) < field.key(b); });
    const CellRule rule(field, options);
    for_slots(jobs, field, [&](std::uint32_t slot) { find_cells(field, slot, rule); });
    for_slots(jobs, field, [&](std::uint32_t slot) { find_edges(field, slot, rule); });
    MeshCounts total;
    for (std::uint32_t i = 0; i < chunks; ++i) {
        ChunkMesh& mesh = chunks_[order_[i]];
        mesh.first_vertex = static_cast<std::uint32_t>(total.vertices);
        mesh.first_triangle = static_cast<std::uint32_t>(total.triangles);
        total.vertices += mesh.vertices;
        total.triangles += mesh.triangles;
    }
    return total;
}

void Mesher::extract(const SurfaceField& field, const MeshOptions& options, const MeshBuffers& out,
                     Jobs& jobs) const {
    const CellRule rule(field, options);
    for_slots(jobs, field, [&](std::uint32_t slot) {
        if (chunks_[slot].vertices > 0 || chunks_[slot].triangles > 0) extract_chunk(field, slot, rule, out);
    });
}

// Calls put(x, y, z, axis, vertex) for the edges that belong to the chunks above and lie on this one's
// border.
template <class Put>
void Mesher::for_edges_beyond(const Neighbourhood& neighbours, Put&& put) const {
    for (int i = 1; i < 8; ++i) {
        const int dx = i & 1, dy = i >> 1 & 1, dz = i >> 2;
        const std::uint32_t slot = neighbours.slot[(dz + 1) * 9 + (dy + 1) * 3 + dx + 1];
        if (slot == kNoChunk || chunks_[slot].vertices == 0) continue;
        const ChunkMesh& mesh = chunks_[slot];
        const std::uint64_t border =
            (dx ? kFirstColumn : ~std::uint64_t{0}) & (dy ? 0xff : ~std::uint64_t{0});
        for (int axis = 0; axis < 3; ++axis)
            for (int z = 0; z < (dz ? 1 : 8); ++z) {
                const int group = axis * 8 + z;
                std::uint64_t left = mesh.edges[group] & border;
                if (left == 0) continue;
                std::uint32_t vertex = mesh.first_vertex + mesh.rank[group];
                std::uint64_t counted = 0;  // bits below this one are in `vertex`
                for (; left != 0; left &= left - 1) {
                    const int bit = std::countr_zero(left);
                    const std::uint64_t before = (std::uint64_t{1} << bit) - 1;
                    if (dx)
                        vertex +=
                            static_cast<std::uint32_t>(std::popcount(mesh.edges[group] & before & ~counted));
                    counted = before;
                    put(8 * dx + (bit & 7), 8 * dy + (bit >> 3), 8 * dz + z, axis, vertex);
                    if (!dx) ++vertex;  // without holes from the first bit on
                }
            }
    }
}

void Mesher::extract_chunk(const SurfaceField& field, std::uint32_t slot, const CellRule& rule,
                           const MeshBuffers& out) const {
    const ChunkMesh& mesh = chunks_[slot];
    const Neighbourhood neighbours(field, unpack_key(field.key(slot)));
    std::uint32_t id[EdgePlaces::kCount];  // only those that carry a vertex are written, and read
    if (mesh.vertices > 0) {
        std::uint64_t planes[8];
        for (int z = 0; z < 8; ++z) planes[z] = mesh.edges[z] | mesh.edges[8 + z] | mesh.edges[16 + z];
        const Planes used(planes);
        const ChunkBlock block(field, neighbours, used.first, used.last);
        std::uint32_t at = mesh.first_vertex;
        for (int group = 0; group < 24; ++group)
            for (std::uint64_t left = mesh.edges[group]; left != 0; left &= left - 1) {
                const int bit = std::countr_zero(left), x = bit & 7, y = bit >> 3, z = group & 7,
                          axis = group >> 3;
                write_vertex(block, x, y, z, axis, at, out);
                id[EdgePlaces::of(x, y, z, axis)] = at++;
            }
    }
    if (mesh.triangles == 0) return;
    for_edges_beyond(neighbours, [&](int x, int y, int z, int axis, std::uint32_t vertex) {
        id[EdgePlaces::of(x, y, z, axis)] = vertex;
    });
    std::uint32_t upper[8];
    upper_of(neighbours, upper);
    const ChunkCells cells(field, upper, rule);
    std::uint32_t* triangle = out.triangles + 3 * std::uint64_t{mesh.first_triangle};
    for_cells(mesh.active, cells, [&](int bit, int z, const CubeTriangles& cell) {
        const std::uint32_t* here = id + EdgePlaces::of(bit & 7, bit >> 3, z, 0);
        for (int t = 0; t < cell.count; ++t)
            for (int k = 0; k < 3; ++k) *triangle++ = here[kEdgePlaces.step[cell.edge[t][k]]];
    });
}

namespace {

// The cells of one chunk by themselves, in order: new_vertex(x, y, z, axis) for every edge that a triangle
// reaches first, corner(triangle, k, vertex) for every corner.
template <class NewVertex, class Corner>
MeshCounts walk_cells(const std::uint64_t active[8], const ChunkCells& cells, NewVertex&& new_vertex,
                      Corner&& corner) {
    constexpr std::uint16_t kNone = 0xffff;
    std::uint16_t id[EdgePlaces::kCount];
    std::memset(id, 0xff, sizeof id);
    MeshCounts counts;
    for_cells(active, cells, [&](int bit, int z, const CubeTriangles& cell) {
        const int x = bit & 7, y = bit >> 3;
        std::uint16_t* here = id + EdgePlaces::of(x, y, z, 0);
        for (int t = 0; t < cell.count; ++t, ++counts.triangles)
            for (int k = 0; k < 3; ++k) {
                const int e = cell.edge[t][k];
                std::uint16_t& vertex = here[kEdgePlaces.step[e]];
                if (vertex == kNone) {
                    const CubeEdge edge = kCubeEdges[static_cast<std::size_t>(e)];
                    vertex = static_cast<std::uint16_t>(counts.vertices++);
                    new_vertex(x + (edge.corner & 1), y + (edge.corner >> 1 & 1), z + (edge.corner >> 2),
                               edge.axis, vertex);
                }
                corner(counts.triangles, k, vertex);
            }
    });
    return counts;
}

// body(active, cells) when cells of the chunk hold surface.
template <class Body>
MeshCounts with_cells(const SurfaceField& field, const Neighbourhood& neighbours, const MeshOptions& options,
                      Body&& body) {
    std::uint32_t upper[8];
    upper_of(neighbours, upper);
    const CellRule rule(field, options);
    const ChunkCells cells(field, upper, rule);
    std::uint64_t active[8];
    return cells.find_active(active) ? body(active, cells) : MeshCounts{};
}

}  // namespace

MeshCounts count_chunk(const SurfaceField& field, const Neighbourhood& neighbours,
                       const MeshOptions& options) {
    return with_cells(field, neighbours, options, [](const std::uint64_t* active, const ChunkCells& cells) {
        return walk_cells(
            active, cells, [](int, int, int, int, std::uint16_t) {},
            [](std::uint64_t, int, std::uint16_t) {});
    });
}

MeshCounts mesh_chunk(const SurfaceField& field, const Neighbourhood& neighbours, const MeshOptions& options,
                      const MeshBuffers& out) {
    return with_cells(field, neighbours, options, [&](const std::uint64_t* active, const ChunkCells& cells) {
        const Planes used(active);
        const ChunkBlock block(field, neighbours, used.first, used.last + 1);
        return walk_cells(
            active, cells,
            [&](int x, int y, int z, int axis, std::uint16_t vertex) {
                write_vertex(block, x, y, z, axis, vertex, out);
            },
            [&](std::uint64_t triangle, int k, std::uint16_t vertex) {
                out.triangles[3 * triangle + static_cast<std::uint64_t>(k)] = vertex;
            });
    });
}

}  // namespace burin
