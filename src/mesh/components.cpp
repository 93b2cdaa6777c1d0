// SPDX-License-Identifier: MIT
#include <cstring>

#include "mesh/mesher.h"

namespace burin {
namespace {

// Union-find with path halving; roots are the smallest vertex of their set, so the result has no order to
// depend on.
std::uint32_t root_of(std::uint32_t* parent, std::uint32_t v) {
    while (parent[v] != v) {
        parent[v] = parent[parent[v]];
        v = parent[v];
    }
    return v;
}

}  // namespace

MeshCounts remove_small_components(const MeshBuffers& mesh, MeshCounts counts, std::uint64_t min_triangles,
                                   std::uint32_t* scratch) {
    std::uint32_t* parent = scratch;
    std::uint32_t* size =
        scratch + counts.vertices;  // triangles of the component, at its root; later the new index
    for (std::uint64_t v = 0; v < counts.vertices; ++v) {
        parent[v] = static_cast<std::uint32_t>(v);
        size[v] = 0;
    }
    for (std::uint64_t t = 0; t < counts.triangles; ++t)
        for (int k = 1; k < 3; ++k) {
            const std::uint32_t a = root_of(parent, mesh.triangles[3 * t]);
            const std::uint32_t b = root_of(parent, mesh.triangles[3 * t + static_cast<std::uint64_t>(k)]);
            if (a < b) parent[b] = a;
            if (b < a) parent[a] = b;
        }
    for (std::uint64_t t = 0; t < counts.triangles; ++t) ++size[root_of(parent, mesh.triangles[3 * t])];

    MeshCounts kept;
    for (std::uint64_t t = 0; t < counts.triangles; ++t) {
        const std::uint32_t* from = mesh.triangles + 3 * t;
        if (size[root_of(parent, from[0])] < min_triangles) continue;
        std::memmove(mesh.triangles + 3 * kept.triangles++, from, 3 * sizeof *from);
    }
    // A vertex goes when its component does. Roots come first in order, so parent can take the new indices as
    // it goes: a vertex's root is never above it. The verdict is kept in `size` until every vertex of the
    // component is seen.
    for (std::uint64_t v = 0; v < counts.vertices; ++v) {
        const bool keep = size[root_of(parent, static_cast<std::uint32_t>(v))] >= min_triangles &&
                          size[root_of(parent, static_cast<std::uint32_t>(v))] > 0;
        parent[v] = root_of(parent, static_cast<std::uint32_t>(v));
        if (!keep) size[v] = 0;
    }
    // Now parent[v] is v's root outright, and size[root] != 0 tells whether it stays.
    std::uint32_t next = 0;
    for (std::uint64_t v = 0; v < counts.vertices; ++v) {
        const bool keep = size[parent[v]] != 0;
        parent[v] = keep ? next : 0xffffffffu;
        if (!keep) continue;
        const auto move3 = [&](auto* data) {
            if (data) std::memmove(data + 3 * std::uint64_t{next}, data + 3 * v, 3 * sizeof *data);
        };
        move3(mesh.positions);
        move3(mesh.normals);
        move3(mesh.colours);
        ++next;
    }
    kept.vertices = next;
    for (std::uint64_t i = 0; i < 3 * kept.triangles; ++i) mesh.triangles[i] = parent[mesh.triangles[i]];
    return kept;
}

}  // namespace burin
