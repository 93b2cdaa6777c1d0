// SPDX-License-Identifier: MIT
// The mesh of a map that is larger than its memory. Chunks come back from the store one after another, in key
// order.
#include <array>
#include <cstring>
#include <unordered_map>

#include "cli/common.h"

namespace burin::cli {
namespace {

struct HashPosition {
    std::size_t operator()(const std::array<std::uint32_t, 3>& p) const {
        std::uint64_t h = p[0] * 0x9e3779b97f4a7c15ULL;
        h = (h ^ h >> 29 ^ p[1]) * 0xbf58476d1ce4e5b9ULL;
        h = (h ^ h >> 32 ^ p[2]) * 0x94d049bb133111ebULL;
        return static_cast<std::size_t>(h ^ h >> 31);
    }
};

}  // namespace

Status extract_stored_mesh(burin_map map, const MeshFlags& flags, bool colour, TriangleMesh* mesh) {
    std::uint64_t count = 0;
    burin_chunks(map, nullptr, 0, &count);
    std::vector<burin_chunk_key> keys(count);
    BURIN_TRY(status_of(burin_chunks(map, keys.data(), keys.size(), &count), map));

    constexpr std::uint64_t kVertices = 1944, kTriangles = 2560;  // of one chunk, see burin.h
    std::vector<float> positions(3 * kVertices), normals(3 * kVertices);
    std::vector<std::uint8_t> colours(3 * kVertices);
    std::vector<std::uint32_t> triangles(3 * kTriangles);
    std::vector<std::uint32_t> index(kVertices);
    // Chunks repeat the vertices on their border bit for bit.
    std::unordered_map<std::array<std::uint32_t, 3>, std::uint32_t, HashPosition> known;
    *mesh = {};
    for (const burin_chunk_key& key : keys) {
        burin_mesh_buffers part = {};
        part.vertex_capacity = kVertices;
        part.triangle_capacity = kTriangles;
        part.positions = positions.data();
        part.normals = normals.data();
        part.colours = colour ? colours.data() : nullptr;
        part.triangles = triangles.data();
        BURIN_TRY(status_of(burin_chunk_mesh(map, key, &flags.options, &part), map));
        for (std::uint64_t v = 0; v < part.vertex_count; ++v) {
            std::array<std::uint32_t, 3> bits;
            std::memcpy(bits.data(), &positions[3 * v], sizeof bits);
            const auto [at, fresh] =
                known.try_emplace(bits, static_cast<std::uint32_t>(mesh->positions.size()));
            index[v] = at->second;
            if (!fresh) continue;
            mesh->positions.push_back({positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]});
            mesh->normals.push_back({normals[3 * v], normals[3 * v + 1], normals[3 * v + 2]});
            if (colour) mesh->colours.push_back({colours[3 * v], colours[3 * v + 1], colours[3 * v + 2]});
        }
        for (std::uint64_t t = 0; t < part.triangle_count; ++t)
            mesh->triangles.push_back(
                {index[triangles[3 * t]], index[triangles[3 * t + 1]], index[triangles[3 * t + 2]]});
    }
    return remove_small(flags, mesh);
}

}  // namespace burin::cli
