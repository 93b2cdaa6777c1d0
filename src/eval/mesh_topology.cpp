// SPDX-License-Identifier: MIT
#include "eval/mesh_topology.h"

#include <algorithm>
#include <exception>
#include <numeric>
#include <vector>

namespace burin {
namespace {

std::int64_t count_duplicates(const std::vector<Vec3f>& positions) {
    std::vector<Vec3f> sorted = positions;
    std::sort(sorted.begin(), sorted.end(), [](const Vec3f& a, const Vec3f& b) {
        return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
    });
    std::int64_t count = 0;
    for (std::size_t i = 1; i < sorted.size(); ++i) count += sorted[i] == sorted[i - 1];
    return count;
}

// Every edge of every proper triangle: smaller vertex << 32 | larger vertex << 1 | direction. Vertices have
// 31 bits (check_mesh), so equal edges lie together once sorted.
void count_edges(const TriangleMesh& mesh, MeshTopology* out) {
    std::vector<std::uint64_t> sides;
    sides.reserve(3 * mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint64_t from = t[k], to = t[(k + 1) % 3];
            sides.push_back(std::min(from, to) << 32 | std::max(from, to) << 1 | std::uint64_t{from > to});
        }
    }
    std::sort(sides.begin(), sides.end());
    for (std::size_t i = 0; i < sides.size();) {
        std::size_t end = i;
        while (end < sides.size() && sides[end] >> 1 == sides[i] >> 1) ++end;
        ++out->edges;
        out->boundary_edges += end - i == 1;
        out->non_manifold_edges += end - i > 2;
        out->inconsistent_edges += end - i == 2 && sides[i] == sides[i + 1];
        i = end;
    }
}

void count_components(const TriangleMesh& mesh, MeshTopology* out) {
    // Union-find over vertices; the root of a set is its smallest vertex.
    std::vector<std::uint32_t> parent(mesh.positions.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    std::vector<bool> referenced(mesh.positions.size(), false);
    for (const auto& t : mesh.triangles) {
        for (const std::uint32_t v : t) referenced[v] = true;
        for (std::size_t k = 1; k < 3; ++k) {
            const std::uint32_t a = root(t[0]), b = root(t[k]);
            parent[std::max(a, b)] = std::min(a, b);
        }
    }
    out->unreferenced_vertices = std::count(referenced.begin(), referenced.end(), false);
    std::vector<std::int64_t> size(mesh.positions.size(), 0);
    for (const auto& t : mesh.triangles) {
        std::int64_t& s = size[root(t[0])];
        out->components += s == 0;
        out->largest_component = std::max(out->largest_component, ++s);
    }
}

}  // namespace

Result<MeshTopology> check_topology(const TriangleMesh& mesh) try {
    BURIN_TRY(check_mesh(mesh));
    MeshTopology out;
    out.vertices = static_cast<std::int64_t>(mesh.positions.size());
    out.triangles = static_cast<std::int64_t>(mesh.triangles.size());
    out.duplicate_vertices = count_duplicates(mesh.positions);
    for (const auto& t : mesh.triangles) {
        // Differences of floats and their products are exact in double for coordinates of like size: a
        // triangle that is a line has an area of exactly zero.
        const Vec3d a = to_double(mesh.positions[t[0]]);
        const double area =
            0.5 * norm(cross(to_double(mesh.positions[t[1]]) - a, to_double(mesh.positions[t[2]]) - a));
        out.degenerate_triangles += !(area > 0);
        out.area_m2 += area;
    }
    count_edges(mesh, &out);
    count_components(mesh, &out);
    return out;
} catch (const std::exception&) {
    return Status::error(Code::insufficient_memory, "no memory to check a mesh of %zu triangles",
                         mesh.triangles.size());
}

}  // namespace burin
