// SPDX-License-Identifier: MIT
// The C boundary of the runtime: meshes and queries.
#include <algorithm>

#include "api/call.h"
#include "api/frame_check.h"
#include "api/mesh_check.h"
#include "burin/burin.h"
#include "map/sample_batch.h"

using namespace burin;

namespace {

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

Status check_change_options(const burin_change_options* options, ChangeRule* out) {
    if (!options) return {};
    if (options->struct_size != sizeof *options)
        return Status::error(Code::invalid_argument, "change options: size %u, expected %zu",
                             options->struct_size, sizeof *options);
    if (!(options->threshold_voxels >= 0))
        return Status::error(Code::invalid_argument,
                             "change options: threshold_voxels is %g, expected at least 0",
                             static_cast<double>(options->threshold_voxels));
    if (options->interval < 1 || options->interval > 65535)
        return Status::error(Code::invalid_argument, "change options: interval is %u, expected 1 to 65535",
                             options->interval);
    out->threshold_voxels = options->threshold_voxels;
    out->interval = options->interval;
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

}  // namespace

extern "C" {

burin_mesh_options burin_mesh_options_default(void) {
    const MeshOptions defaults;
    return {sizeof(burin_mesh_options), defaults.min_weight, defaults.max_jump_voxels};
}

burin_status burin_mesh_size(burin_map map, const burin_mesh_options* options, uint64_t* vertices,
                             uint64_t* triangles) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!vertices || !triangles) return null_argument(vertices ? "triangles" : "vertices");
        MeshOptions mesh_options;
        BURIN_TRY(check_mesh_options(options, &mesh_options));
        Watch watch(state, 2);
        const MeshCounts counts = state.session.count_mesh(mesh_options, state.jobs);
        BURIN_TRY(watch.progress.finish());
        *vertices = counts.vertices;
        *triangles = counts.triangles;
        return {};
    });
}

burin_status burin_mesh(burin_map map, const burin_mesh_options* options, burin_mesh_buffers* mesh) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(check_buffers(mesh));
        MeshOptions mesh_options;
        BURIN_TRY(check_mesh_options(options, &mesh_options));
        Watch watch(state, state.session.counted(mesh_options) ? 1 : 3);
        const MeshCounts counts = state.session.count_mesh(mesh_options, state.jobs);
        if (watch.progress.stopped()) return watch.progress.finish();
        if (counts.vertices > 0xfffffffeULL)
            return Status::error(Code::unsupported, "the mesh has %llu vertices, an index holds 32 bits",
                                 static_cast<unsigned long long>(counts.vertices));
        BURIN_TRY(require_capacity(mesh, counts.vertices, counts.triangles));
        state.session.extract_mesh(mesh_options, buffers_of(*mesh), state.jobs);
        return watch.progress.finish();
    });
}

burin_change_options burin_change_options_default(void) {
    const ChangeRule defaults;
    return {sizeof(burin_change_options), defaults.threshold_voxels, defaults.interval};
}

burin_status burin_dirty_chunks(burin_map map, burin_chunk_key* keys, uint64_t capacity, uint64_t* count) {
    return burin_changed_chunks(map, nullptr, keys, capacity, count);
}

burin_status burin_changed_chunks(burin_map map, const burin_change_options* options, burin_chunk_key* keys,
                                  uint64_t capacity, uint64_t* count) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!count) return null_argument("count");
        if (!keys && capacity > 0) return null_argument("keys");
        ChangeRule rule;
        BURIN_TRY(check_change_options(options, &rule));
        *count = state.session.changed_chunks(
            rule,
            [&](std::uint64_t i, Vec3i c) {
                keys[i] = {c.x, c.y, c.z};
            },
            capacity);
        if (*count <= capacity) return {};
        return Status::error(Code::insufficient_memory, "room for %llu keys, %llu are needed",
                             static_cast<unsigned long long>(capacity),
                             static_cast<unsigned long long>(*count));
    });
}

burin_status burin_chunk_meshes(burin_map map, const burin_chunk_key* keys, uint64_t count,
                                const burin_mesh_options* options, burin_mesh_buffers* mesh,
                                burin_mesh_range* ranges, uint64_t* done) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(check_buffers(mesh));
        if (!done) return null_argument("done");
        *done = 0;
        if (count > 0 && (!keys || !ranges)) return null_argument(keys ? "ranges" : "keys");
        MeshOptions mesh_options;
        BURIN_TRY(check_mesh_options(options, &mesh_options));
        for (std::uint64_t i = 0; i < count; ++i) BURIN_TRY(check_chunk(keys[i]));
        mesh->vertex_count = mesh->triangle_count = 0;
        constexpr std::uint64_t kAtOnce = 256;  // chunks: 10 KiB of the stack
        while (*done < count) {
            ChunkKey some[kAtOnce];
            ChunkMeshRange places[kAtOnce];
            const int n = static_cast<int>(std::min(kAtOnce, count - *done));
            for (int i = 0; i < n; ++i) {
                const burin_chunk_key& key = keys[*done + static_cast<std::uint64_t>(i)];
                some[i] = pack_key({key.x, key.y, key.z});
            }
            const std::uint64_t v = mesh->vertex_count, t = mesh->triangle_count;
            const MeshBuffers out = {mesh->positions + 3 * v, mesh->normals ? mesh->normals + 3 * v : nullptr,
                                     mesh->colours ? mesh->colours + 3 * v : nullptr,
                                     mesh->triangles + 3 * t};
            const int meshed = state.session.mesh_chunks(
                some, n, mesh_options, out, {mesh->vertex_capacity - v, mesh->triangle_capacity - t}, places,
                state.jobs);
            for (int i = 0; i < meshed; ++i) {
                ranges[*done + static_cast<std::uint64_t>(i)] = {
                    v + places[i].first_vertex, places[i].vertices, t + places[i].first_triangle,
                    places[i].triangles};
                mesh->vertex_count += places[i].vertices;
                mesh->triangle_count += places[i].triangles;
            }
            *done += static_cast<std::uint64_t>(meshed);
            if (*done == 0) return require_capacity(mesh, places[0].vertices, places[0].triangles);
            if (meshed < n) break;
        }
        return {};
    });
}

burin_status burin_chunk_mesh(burin_map map, burin_chunk_key key, const burin_mesh_options* options,
                              burin_mesh_buffers* mesh) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(check_buffers(mesh));
        MeshOptions mesh_options;
        BURIN_TRY(check_mesh_options(options, &mesh_options));
        BURIN_TRY(check_chunk(key));
        BURIN_TRY(require_capacity(mesh, kMaxChunkVertices, kMaxChunkTriangles));
        const MeshCounts counts =
            state.session.mesh_one_chunk(pack_key({key.x, key.y, key.z}), mesh_options, buffers_of(*mesh));
        mesh->vertex_count = counts.vertices;
        mesh->triangle_count = counts.triangles;
        return {};
    });
}

burin_status burin_mesh_remove_small(burin_mesh_buffers* mesh, uint64_t min_triangles, uint32_t* scratch) {
    if (!mesh || !scratch) return report(thread_error(), null_argument(mesh ? "scratch" : "mesh"));
    if (!mesh->triangles && mesh->triangle_count > 0)
        return report(thread_error(), null_argument("mesh->triangles"));
    if (const Status status = check_indices(*mesh); !status.ok()) return report(thread_error(), status);
    const MeshCounts kept = remove_small_components(
        buffers_of(*mesh), {mesh->vertex_count, mesh->triangle_count}, min_triangles, scratch);
    mesh->vertex_count = kept.vertices;
    mesh->triangle_count = kept.triangles;
    return BURIN_OK;
}

burin_status burin_raycast(burin_map map, const burin_camera* camera, const burin_pose* T_world_camera,
                           float* depth_m, float* normals, uint8_t* rgb) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!camera || !T_world_camera) return null_argument(camera ? "T_world_camera" : "camera");
        Camera c;
        Se3 T;
        BURIN_TRY(checked_camera(*camera, "raycast", &c));
        if (c.distorted()) return Status::error(Code::unsupported, "raycast camera: distortion must be 0");
        BURIN_TRY(checked_world_pose(*T_world_camera, state.config, &T));
        Watch watch(state, 2);
        state.session.raycast_map(c, T, {depth_m, normals, rgb}, state.jobs);
        return watch.progress.finish();
    });
}

burin_status burin_sample(burin_map map, const double* points, uint64_t count, float* distances,
                          float* gradients) {
    return Call(map).run([&](MapState& state) -> Status {
        if (count > 0 && (!points || !distances)) return null_argument(points ? "distances" : "points");
        // Points an item: the memory of chunks pays, and one step of the job counter is nothing beside it.
        constexpr std::uint64_t kItem = 2048;
        const std::uint64_t items = (count + kItem - 1) / kItem;
        if (items > 0x7fffffff)
            return Status::error(Code::invalid_argument, "sample: %llu points, expected fewer than 2^42",
                                 static_cast<unsigned long long>(count));
        Watch watch(state, 1);
        state.jobs.run(static_cast<int>(items), [&](int item, int) {
            const std::uint64_t first = static_cast<std::uint64_t>(item) * kItem;
            BatchSampler sampler(state.session.volume());
            sampler.sample(points + 3 * first, static_cast<std::size_t>(std::min(kItem, count - first)),
                           distances + first, gradients ? gradients + 3 * first : nullptr);
        });
        return watch.progress.finish();
    });
}

}  // extern "C"
