// SPDX-License-Identifier: MIT
#include "api/chunk_mesh_call.h"

#include <algorithm>

namespace burin {

Status check_mesh_options(const burin_mesh_options* options, MeshOptions* out) {
    if (!options) return {};
    if (options->struct_size != sizeof *options)
        return Status::error(Code::invalid_argument, "mesh options: size %u, expected %zu",
                             options->struct_size, sizeof *options);
    if (!(options->min_weight >= 0 && options->min_weight <= 1000))
        return Status::error(Code::invalid_argument, "mesh options: min_weight is %g, expected 0 to 1000",
                             static_cast<double>(options->min_weight));
    if (!(options->max_jump_voxels >= 1.8f))
        return Status::error(Code::invalid_argument,
                             "mesh options: max_jump_voxels is %g, expected at least 1.8",
                             static_cast<double>(options->max_jump_voxels));
    out->min_weight = options->min_weight;
    out->max_jump_voxels = options->max_jump_voxels;
    return {};
}

Status check_buffers(const burin_mesh_buffers* mesh) {
    if (!mesh) return null_argument("mesh");
    if (!mesh->positions && mesh->vertex_capacity > 0) return null_argument("mesh->positions");
    if (!mesh->triangles && mesh->triangle_capacity > 0) return null_argument("mesh->triangles");
    return {};
}

Status require_capacity(burin_mesh_buffers* mesh, std::uint64_t vertices, std::uint64_t triangles) {
    mesh->vertex_count = vertices;
    mesh->triangle_count = triangles;
    if (vertices <= mesh->vertex_capacity && triangles <= mesh->triangle_capacity) return {};
    return Status::error(Code::insufficient_memory,
                         "mesh buffers hold %llu vertices and %llu triangles, %llu and %llu are needed",
                         static_cast<unsigned long long>(mesh->vertex_capacity),
                         static_cast<unsigned long long>(mesh->triangle_capacity),
                         static_cast<unsigned long long>(vertices),
                         static_cast<unsigned long long>(triangles));
}

Status check_chunk(const burin_chunk_key& key) {
    if (chunk_in_range({key.x, key.y, key.z})) return {};
    return Status::error(Code::invalid_argument, "chunk %d %d %d, expected coordinates below %d", key.x,
                         key.y, key.z, kChunkLimit);
}

MeshBuffers buffers_of(const burin_mesh_buffers& m) {
    return {m.positions, m.normals, m.colours, m.triangles};
}

Status ChunkMeshCall::check() {
    BURIN_TRY(check_buffers(mesh));
    if (count > 0 && (!keys || !ranges)) return null_argument(keys ? "ranges" : "keys");
    BURIN_TRY(check_mesh_options(options, &checked_options));
    for (std::uint64_t i = 0; i < count; ++i) BURIN_TRY(check_chunk(keys[i]));
    return {};
}

Status ChunkMeshCall::run(FusionSession& session, Jobs& jobs) {
    mesh->vertex_count = mesh->triangle_count = 0;
    constexpr std::uint64_t kAtOnce = 256;  // chunks: 10 KiB of the stack
    while (done < count) {
        ChunkKey some[kAtOnce];
        ChunkMeshRange places[kAtOnce];
        const int n = static_cast<int>(std::min(kAtOnce, count - done));
        for (int i = 0; i < n; ++i) {
            const burin_chunk_key& key = keys[done + static_cast<std::uint64_t>(i)];
            some[i] = pack_key({key.x, key.y, key.z});
        }
        const std::uint64_t v = mesh->vertex_count, t = mesh->triangle_count;
        const MeshBuffers out = {mesh->positions + 3 * v, mesh->normals ? mesh->normals + 3 * v : nullptr,
                                 mesh->colours ? mesh->colours + 3 * v : nullptr, mesh->triangles + 3 * t};
        const int meshed =
            session.mesh_chunks(some, n, checked_options, out,
                                {mesh->vertex_capacity - v, mesh->triangle_capacity - t}, places, jobs);
        for (int i = 0; i < meshed; ++i) {
            ranges[done + static_cast<std::uint64_t>(i)] = {v + places[i].first_vertex, places[i].vertices,
                                                            t + places[i].first_triangle,
                                                            places[i].triangles};
            mesh->vertex_count += places[i].vertices;
            mesh->triangle_count += places[i].triangles;
        }
        done += static_cast<std::uint64_t>(meshed);
        if (done == 0) return require_capacity(mesh, places[0].vertices, places[0].triangles);
        if (meshed < n) break;
    }
    return {};
}

}  // namespace burin
