// SPDX-License-Identifier: MIT
// The C boundary of the runtime: check, translate, call, and turn every outcome into a status.
#include "burin/burin.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <new>

#include "api/config.h"
#include "api/frame_check.h"
#include "api/handles.h"
#include "map/sample.h"
#include "simd/targets.h"

using namespace burin;

namespace {

burin_status report(char* error, const Status& status) {
    if (!status.ok()) std::snprintf(error, 512, "%s", status.text());
    return static_cast<burin_status>(status.code());
}

// One call on one map: finds the state, refuses a second thread, keeps the error text.
class Call {
  public:
    explicit Call(burin_map map) : state_(state_of(map)) {
        if (!state_) {
            entry_ = Status::error(Code::state, "the map is null, destroyed or was never created");
        } else if (state_->busy.exchange(true)) {
            entry_ = Status::error(Code::state, "the map is in use by another thread");
            state_ = nullptr;
        }
    }
    ~Call() {
        if (state_) state_->busy.store(false);
    }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

    // Runs body(state) unless the map could not be entered.
    template <class Body>
    burin_status run(Body&& body) {
        if (!state_) return report(thread_error(), entry_);
        return report(state_->error, body(*state_));
    }

  private:
    MapState* state_;
    Status entry_;
};

Status null_argument(const char* name) { return Status::error(Code::invalid_argument, "%s is null", name); }

// Bytes of a whole map: the state, then the session's own layout.
std::uint64_t layout(const FusionOptions& options, std::uint32_t capacity) {
    Arena arena;
    arena.allocate<MapState>(1, 64);
    return ((arena.used() + 63) & ~std::size_t{63}) + FusionSession::bytes_for(options, capacity);
}

// Fewer chunks than one frame of anything touches: the budget was given in the wrong unit.
constexpr std::uint32_t kLeastCapacity = 64;

Status plan(const burin_config& config, FusionOptions* options, std::uint64_t* bytes) {
    BURIN_TRY(check_config(config));
    *options = options_of(config);
    const std::uint64_t overhead = layout(*options, 1) - FusionSession::bytes_for(*options, 1);
    FusionOptions inner = *options;
    inner.budget_bytes = config.budget_bytes > overhead ? config.budget_bytes - overhead : 0;
    std::uint64_t inner_bytes = 0;
    const std::uint32_t capacity = FusionSession::capacity_for(inner, &inner_bytes);
    if (capacity < kLeastCapacity)
        return Status::error(Code::insufficient_memory, "config: budget_bytes is %llu, expected at least %llu",
                             static_cast<unsigned long long>(config.budget_bytes),
                             static_cast<unsigned long long>(layout(*options, kLeastCapacity)));
    options->volume.capacity = capacity;
    *bytes = overhead + inner_bytes;
    return {};
}

Status check_mesh_options(const burin_mesh_options* options, MeshOptions* out) {
    if (!options) return {};
    if (options->struct_size != sizeof *options)
        return Status::error(Code::invalid_argument, "mesh options: size %u, expected %zu", options->struct_size, sizeof *options);
    if (!(options->min_weight >= 0 && options->min_weight <= 1000))
        return Status::error(Code::invalid_argument, "mesh options: min_weight is %g, expected 0 to 1000",
                             static_cast<double>(options->min_weight));
    if (!(options->max_jump_voxels >= 1.8f))
        return Status::error(Code::invalid_argument, "mesh options: max_jump_voxels is %g, expected at least 1.8",
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
    return Status::error(Code::insufficient_memory, "mesh buffers hold %llu vertices and %llu triangles, %llu and %llu are needed",
                         static_cast<unsigned long long>(mesh->vertex_capacity),
                         static_cast<unsigned long long>(mesh->triangle_capacity), static_cast<unsigned long long>(vertices),
                         static_cast<unsigned long long>(triangles));
}

MeshBuffers buffers_of(const burin_mesh_buffers& m) { return {m.positions, m.normals, m.colours, m.triangles}; }

burin_config saved_config(const MapFileHead& head) {
    burin_config config = burin_config_default();
    if (head.config_bytes == sizeof config) std::memcpy(&config, head.config, sizeof config);
    return config;
}

Status check_fit(const MapState& state, const MapFileHead& head, const char* path) {
    const VolumeShape& shape = state.session.volume().shape();
    if (head.voxel_m != shape.voxel_m || head.truncation_m != shape.truncation_m || (head.has_colour != 0) != shape.colour)
        return Status::error(Code::invalid_argument,
                             "%s: map of voxel %g m, truncation %g m, %s colour; this map has %g, %g, %s colour", path,
                             static_cast<double>(head.voxel_m), static_cast<double>(head.truncation_m),
                             head.has_colour ? "with" : "without", static_cast<double>(shape.voxel_m),
                             static_cast<double>(shape.truncation_m), shape.colour ? "with" : "without");
    if (head.chunks > shape.capacity)
        return Status::error(Code::insufficient_memory, "%s: %u chunks need a budget of %llu bytes, this map has %llu", path,
                             head.chunks,
                             static_cast<unsigned long long>(layout(options_of(state.config), std::max(head.chunks, kLeastCapacity))),
                             static_cast<unsigned long long>(state.config.budget_bytes));
    return {};
}

}  // namespace

extern "C" {

const char* burin_strerror(burin_status status) {
    switch (status) {
        case BURIN_OK: return "ok";
        case BURIN_INVALID_ARGUMENT: return "invalid argument";
        case BURIN_INSUFFICIENT_MEMORY: return "insufficient memory";
        case BURIN_IO: return "input/output error";
        case BURIN_FORMAT: return "damaged or unknown format";
        case BURIN_STATE: return "wrong state";
        case BURIN_UNSUPPORTED: return "unsupported";
        case BURIN_CANCELLED: return "cancelled";
    }
    return "unknown status";
}

const char* burin_version(void) { return BURIN_VERSION; }
const char* burin_simd_name(void) { return simd::target_name(); }

const char* burin_last_error(burin_map map) {
    const MapState* state = state_of(map);
    return state ? state->error : thread_error();
}

burin_config burin_config_default(void) {
    burin_config c = {};
    c.struct_size = sizeof c;
    c.version = BURIN_CONFIG_VERSION;
    c.budget_bytes = std::uint64_t{256} << 20;
    c.voxel_m = 0.005f;
    c.truncation_voxels = 4;
    c.truncation = BURIN_TRUNCATION_CONSTANT;
    c.truncation_scale = 8;
    c.min_depth_m = 0.2f;
    c.max_depth_m = 4;
    c.weight = BURIN_WEIGHT_CONSTANT;
    c.drop = BURIN_DROP_LINEAR;
    c.angle_weight = 0;
    c.max_weight = 255;
    c.carve = 1;
    c.colour = 1;
    c.bilateral = 0;
    c.edge_removal = 0;
    c.max_width = 640;
    c.max_height = 480;
    c.threads = 1;
    return c;
}

burin_frame burin_frame_default(void) {
    burin_frame f = {};
    f.struct_size = sizeof f;
    f.depth_unit_m = 0.001;
    f.T_world_camera.qw = 1;
    f.T_colour_depth.qw = 1;
    return f;
}

burin_mesh_options burin_mesh_options_default(void) {
    const MeshOptions defaults;
    return {sizeof(burin_mesh_options), defaults.min_weight, defaults.max_jump_voxels};
}

burin_status burin_bytes(const burin_config* config, uint64_t* bytes) {
    if (!config || !bytes) return report(thread_error(), null_argument(config ? "bytes" : "config"));
    FusionOptions options;
    std::uint64_t needed = 0;
    const Status status = plan(*config, &options, &needed);
    if (status.ok()) *bytes = needed;
    return report(thread_error(), status);
}

burin_status burin_create(const burin_config* config, void* memory, uint64_t bytes, burin_map* map) {
    if (!config || !memory || !map) return report(thread_error(), null_argument(!config ? "config" : !memory ? "memory" : "map"));
    if (reinterpret_cast<std::uintptr_t>(memory) % 64 != 0)
        return report(thread_error(), Status::error(Code::invalid_argument, "memory is not aligned to 64 bytes"));
    FusionOptions options;
    std::uint64_t needed = 0;
    const Status status = plan(*config, &options, &needed);
    if (!status.ok()) return report(thread_error(), status);
    if (bytes < needed)
        return report(thread_error(), Status::error(Code::insufficient_memory, "memory is %llu bytes, expected at least %llu",
                                                    static_cast<unsigned long long>(bytes), static_cast<unsigned long long>(needed)));
    Arena arena(memory, needed);
    MapState* state = new (arena.allocate<MapState>(1, 64)) MapState(static_cast<int>(config->threads));
    state->config = *config;
    state->bytes = needed;
    Arena rest(static_cast<char*>(memory) + ((arena.used() + 63) & ~std::size_t{63}), needed - ((arena.used() + 63) & ~std::size_t{63}));
    state->session.place(rest, options);
    state->session.clear();
    *map = register_map(state);
    if (map->index != 0) return BURIN_OK;
    state->~MapState();
    return report(thread_error(), Status::error(Code::state, "64 maps exist already"));
}

burin_status burin_destroy(burin_map* map) {
    if (!map || (map->index == 0 && map->generation == 0)) return BURIN_OK;
    MapState* state = state_of(*map);
    if (!state) return report(thread_error(), Status::error(Code::state, "the map is destroyed or was never created"));
    if (state->busy.exchange(true)) return report(thread_error(), Status::error(Code::state, "the map is in use by another thread"));
    unregister_map(*map);
    state->~MapState();
    *map = {0, 0};
    return BURIN_OK;
}

burin_status burin_reset(burin_map map) {
    return Call(map).run([](MapState& state) {
        state.session.clear();
        return Status();
    });
}

burin_status burin_integrate(burin_map map, const burin_frame* frame, burin_frame_result* result) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!frame) return null_argument("frame");
        FrameView view;
        BURIN_TRY(checked_frame(*frame, state.config, &view));
        const FrameReport r = state.session.integrate(view, state.jobs);
        if (result)
            *result = {r.chunks.dropped > 0 ? std::uint32_t{BURIN_FLAG_POOL_FULL} : 0u, r.chunks.fused, r.chunks.added,
                       r.chunks.carved, r.chunks.dropped, r.valid_pixels, r.depth_ms, r.integrate_ms};
        return {};
    });
}

burin_status burin_stats(burin_map map, burin_statistics* out) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!out) return null_argument("statistics");
        const Volume& volume = state.session.volume();
        *out = {};
        out->arena_bytes = state.bytes;
        out->frames = state.session.frames();
        out->chunks_dropped = state.session.dropped();
        out->chunks_live = volume.live();
        out->chunks_high_water = volume.high_water();
        out->chunks_capacity = volume.shape().capacity;
        out->voxel_m = volume.shape().voxel_m;
        out->truncation_m = volume.shape().truncation_m;
        Vec3i low{std::numeric_limits<std::int32_t>::max(), std::numeric_limits<std::int32_t>::max(), std::numeric_limits<std::int32_t>::max()};
        Vec3i high = -low;
        for (std::uint32_t slot = 0; slot < volume.live(); ++slot) {
            const Vec3i c = unpack_key(volume.key(slot));
            for (int r = 0; r < 3; ++r) {
                low[r] = std::min(low[r], c[r]);
                high[r] = std::max(high[r], c[r] + 1);
            }
        }
        for (int r = 0; r < 3; ++r) {
            out->bounds_min_m[r] = volume.live() ? static_cast<float>(low[r] * 8.0 * volume.voxel_m()) : 1.0f;
            out->bounds_max_m[r] = volume.live() ? static_cast<float>(high[r] * 8.0 * volume.voxel_m()) : -1.0f;
        }
        return {};
    });
}

burin_status burin_hash(burin_map map, uint64_t* hash) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!hash) return null_argument("hash");
        *hash = state.session.hash();
        return {};
    });
}

burin_status burin_mesh_size(burin_map map, const burin_mesh_options* options, uint64_t* vertices, uint64_t* triangles) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!vertices || !triangles) return null_argument(vertices ? "triangles" : "vertices");
        MeshOptions mesh_options;
        BURIN_TRY(check_mesh_options(options, &mesh_options));
        const MeshCounts counts = state.session.count_mesh(mesh_options, state.jobs);
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
        const MeshCounts counts = state.session.count_mesh(mesh_options, state.jobs);
        if (counts.vertices > 0xfffffffeULL)
            return Status::error(Code::unsupported, "the mesh has %llu vertices, an index holds 32 bits",
                                 static_cast<unsigned long long>(counts.vertices));
        BURIN_TRY(require_capacity(mesh, counts.vertices, counts.triangles));
        state.session.extract_mesh(mesh_options, buffers_of(*mesh), state.jobs);
        return {};
    });
}

burin_status burin_dirty_chunks(burin_map map, burin_chunk_key* keys, uint64_t capacity, uint64_t* count) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!count) return null_argument("count");
        if (!keys && capacity > 0) return null_argument("keys");
        *count = state.session.dirty_chunks(
            [&](std::uint64_t i, Vec3i c) { keys[i] = {c.x, c.y, c.z}; }, capacity);
        if (*count <= capacity) return {};
        return Status::error(Code::insufficient_memory, "room for %llu keys, %llu are needed", static_cast<unsigned long long>(capacity),
                             static_cast<unsigned long long>(*count));
    });
}

burin_status burin_chunk_mesh(burin_map map, burin_chunk_key key, const burin_mesh_options* options, burin_mesh_buffers* mesh) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(check_buffers(mesh));
        MeshOptions mesh_options;
        BURIN_TRY(check_mesh_options(options, &mesh_options));
        const Vec3i chunk{key.x, key.y, key.z};
        if (!chunk_in_range(chunk))
            return Status::error(Code::invalid_argument, "chunk %d %d %d, expected coordinates below %d", key.x, key.y, key.z, kChunkLimit);
        BURIN_TRY(require_capacity(mesh, kMaxChunkVertices, kMaxChunkTriangles));
        const MeshCounts counts = state.session.mesh_one_chunk(pack_key(chunk), mesh_options, buffers_of(*mesh));
        mesh->vertex_count = counts.vertices;
        mesh->triangle_count = counts.triangles;
        return {};
    });
}

burin_status burin_mesh_remove_small(burin_mesh_buffers* mesh, uint64_t min_triangles, uint32_t* scratch) {
    if (!mesh || !scratch) return report(thread_error(), null_argument(mesh ? "scratch" : "mesh"));
    for (std::uint64_t i = 0; i < 3 * mesh->triangle_count; ++i)
        if (mesh->triangles[i] >= mesh->vertex_count)
            return report(thread_error(), Status::error(Code::invalid_argument, "mesh: index %u, expected below %llu", mesh->triangles[i],
                                                        static_cast<unsigned long long>(mesh->vertex_count)));
    const MeshCounts kept = remove_small_components(buffers_of(*mesh), {mesh->vertex_count, mesh->triangle_count}, min_triangles, scratch);
    mesh->vertex_count = kept.vertices;
    mesh->triangle_count = kept.triangles;
    return BURIN_OK;
}

burin_status burin_raycast(burin_map map, const burin_camera* camera, const burin_pose* T_world_camera, float* depth_m, float* normals,
                           uint8_t* rgb) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!camera || !T_world_camera) return null_argument(camera ? "T_world_camera" : "camera");
        Camera c;
        Se3 T;
        BURIN_TRY(checked_camera(*camera, "raycast", &c));
        if (c.distorted()) return Status::error(Code::unsupported, "raycast camera: distortion must be 0");
        BURIN_TRY(checked_pose(*T_world_camera, "T_world_camera", &T));
        state.session.raycast_map(c, T, {depth_m, normals, rgb}, state.jobs);
        return {};
    });
}

burin_status burin_sample(burin_map map, const double* points, uint64_t count, float* distances, float* gradients) {
    return Call(map).run([&](MapState& state) -> Status {
        if (count > 0 && (!points || !distances)) return null_argument(points ? "distances" : "points");
        Sampler sampler(state.session.volume());
        for (std::uint64_t i = 0; i < count; ++i) {
            Vec3f g{NAN, NAN, NAN};
            if (!sampler.distance_and_gradient({points[3 * i], points[3 * i + 1], points[3 * i + 2]}, &distances[i], &g))
                distances[i] = NAN;
            if (gradients)
                for (int k = 0; k < 3; ++k) gradients[3 * i + static_cast<std::uint64_t>(k)] = g[k];
        }
        return {};
    });
}

burin_status burin_save(burin_map map, const char* path) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!path) return null_argument("path");
        MapFileHead head = {};
        head.frames = state.session.frames();
        head.config_bytes = sizeof state.config;
        static_assert(sizeof state.config <= sizeof head.config);
        std::memcpy(head.config, &state.config, sizeof state.config);
        return state.session.save(path, head);
    });
}

burin_status burin_file_probe(const char* path, burin_file_info* info) {
    if (!path || !info) return report(thread_error(), null_argument(path ? "info" : "path"));
    MapFileHead head;
    const Status status = read_map_head(path, &head);
    if (!status.ok()) return report(thread_error(), status);
    *info = {};
    info->version = head.version;
    info->has_colour = head.has_colour;
    info->voxel_m = head.voxel_m;
    info->truncation_m = head.truncation_m;
    info->chunks = head.chunks;
    info->frames = head.frames;
    info->hash = head.map_hash;
    info->config = saved_config(head);
    const Status usable = check_config(info->config);
    if (!usable.ok()) return report(thread_error(), Status::error(Code::format, "%s: saved with an impossible %s", path, usable.text()));
    info->least_budget_bytes = layout(options_of(info->config), std::max(head.chunks, kLeastCapacity));
    return BURIN_OK;
}

burin_status burin_load(burin_map map, const char* path) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!path) return null_argument("path");
        MapFileHead head;
        BURIN_TRY(read_map_head(path, &head));
        BURIN_TRY(check_fit(state, head, path));
        return state.session.load(path, head);
    });
}

}  // extern "C"
