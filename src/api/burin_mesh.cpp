// SPDX-License-Identifier: MIT
// The C boundary of the runtime: meshes and queries.
#include <algorithm>

#include "api/call.h"
#include "api/chunk_mesh_call.h"
#include "api/frame_check.h"
#include "api/mesh_check.h"
#include "burin/burin.h"
#include "map/sample_batch.h"

using namespace burin;

namespace {

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
        if (!done) return null_argument("done");
        ChunkMeshCall call = {keys, count, options, mesh, ranges, 0, {}};
        const Status checked = call.check();
        *done = 0;
        BURIN_TRY(checked);
        const Status status = call.run(state.session, state.jobs);
        *done = call.done;
        return status;
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
