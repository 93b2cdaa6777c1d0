// SPDX-License-Identifier: MIT
// The C boundary of the runtime: configuration, life of a map, frames, statistics.
#include "burin/burin.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <new>

#include "api/call.h"
#include "api/config.h"
#include "api/frame_check.h"
#include "api/frame_result.h"
#include "simd/targets.h"

using namespace burin;

extern "C" {

const char* burin_strerror(burin_status status) {
    switch (status) {
        case BURIN_OK:
            return "ok";
        case BURIN_INVALID_ARGUMENT:
            return "invalid argument";
        case BURIN_INSUFFICIENT_MEMORY:
            return "insufficient memory";
        case BURIN_IO:
            return "input/output error";
        case BURIN_FORMAT:
            return "damaged or unknown format";
        case BURIN_STATE:
            return "wrong state";
        case BURIN_UNSUPPORTED:
            return "unsupported";
        case BURIN_CANCELLED:
            return "cancelled";
        case BURIN_TIMEOUT:
            return "timeout";
        case BURIN_DISCONNECTED:
            return "disconnected";
        case BURIN_BUSY:
            return "busy";
        case BURIN_DENIED:
            return "denied";
        case BURIN_ENDED:
            return "ended";
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
    c.drop = BURIN_DROP_NONE;
    c.angle_weight = 0;
    c.max_weight = 255;
    c.carve = 1;
    c.colour = 1;
    c.bilateral = 0;
    c.edge_removal = 0;
    c.max_width = 640;
    c.max_height = 480;
    c.threads = 1;
    c.tracker = BURIN_TRACKER_NONE;
    c.track_colour = 1;
    c.track_gyro = 1;
    return c;
}

burin_config burin_scan_config_default(void) {
    burin_config c = burin_config_default();
    c.tracker = BURIN_TRACKER_SDF;
    c.truncation_voxels = 8;
    c.max_depth_m = 5;
    c.bilateral = 1;
    c.edge_removal = 1;
    return c;
}

burin_frame burin_frame_default(void) {
    burin_frame f = {};
    f.struct_size = sizeof f;
    f.depth_unit_m = 0.001;
    f.T_world_camera.qw = 1;
    f.T_colour_depth.qw = 1;
    f.T_camera_imu.qw = 1;
    return f;
}

burin_status burin_bytes(const burin_config* config, uint64_t* bytes) {
    if (!config || !bytes) return report(thread_error(), null_argument(config ? "bytes" : "config"));
    FusionOptions options;
    std::uint64_t needed = 0;
    const Status status = plan_map(*config, &options, &needed);
    if (status.ok()) *bytes = needed;
    return report(thread_error(), status);
}

burin_status burin_create(const burin_config* config, void* memory, uint64_t bytes, burin_map* map) {
    if (!config || !memory || !map)
        return report(thread_error(), null_argument(!config ? "config" : !memory ? "memory" : "map"));
    if (reinterpret_cast<std::uintptr_t>(memory) % 64 != 0)
        return report(thread_error(),
                      Status::error(Code::invalid_argument, "memory is not aligned to 64 bytes"));
    FusionOptions options;
    std::uint64_t needed = 0;
    const Status status = plan_map(*config, &options, &needed);
    if (!status.ok()) return report(thread_error(), status);
    if (bytes < needed)
        return report(
            thread_error(),
            Status::error(Code::insufficient_memory, "memory is %llu bytes, expected at least %llu",
                          static_cast<unsigned long long>(bytes), static_cast<unsigned long long>(needed)));
    simd::target_name();  // the choice of kernels allocates, once a process: not in the first frame
    Arena arena(memory, needed);
    MapState* state = new (arena.allocate<MapState>(1, 64)) MapState(static_cast<int>(config->threads));
    state->config = *config;
    state->bytes = needed;
    Arena rest(static_cast<char*>(memory) + ((arena.used() + 63) & ~std::size_t{63}),
               needed - ((arena.used() + 63) & ~std::size_t{63}));
    state->session.place(rest, options);
    state->session.clear();
    Status ready = config->store_chunks > 0 ? state->session.start_store() : Status();
    if (ready.ok()) {
        *map = register_map(state);
        if (map->index != 0) {
            char line[128];
            std::snprintf(line, sizeof line, "map of %u chunks in %llu bytes, kernels %s, %d threads",
                          options.volume.capacity, static_cast<unsigned long long>(needed),
                          simd::target_name(), state->jobs.threads());
            log_line(BURIN_LOG_INFO, line);
            return BURIN_OK;
        }
        ready = Status::error(Code::state, "64 maps exist already");
    }
    state->~MapState();
    return report(thread_error(), ready);
}

burin_status burin_destroy(burin_map* map) {
    if (!map || (map->index == 0 && map->generation == 0)) return BURIN_OK;
    MapState* state = state_of(*map);
    if (!state)
        return report(thread_error(),
                      Status::error(Code::state, "the map is destroyed or was never created"));
    if (state->busy.exchange(true))
        return report(thread_error(), Status::error(Code::state, "the map is in use by another thread"));
    unregister_map(*map);
    state->~MapState();
    *map = {0, 0};
    return BURIN_OK;
}

burin_status burin_reset(burin_map map) {
    return Call(map).run([](MapState& state) {
        state.session.clear();
        state.told_full = false;
        return Status();
    });
}

burin_status burin_integrate(burin_map map, const burin_frame* frame, burin_frame_result* result) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!frame) return null_argument("frame");
        FrameView view;
        BURIN_TRY(checked_frame(*frame, state.config, &view));
        const FrameReport r = state.session.integrate(view, state.jobs);
        const burin_frame_result fused = frame_result(r, &state);
        if (result) *result = fused;
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
        Vec3i low{std::numeric_limits<std::int32_t>::max(), std::numeric_limits<std::int32_t>::max(),
                  std::numeric_limits<std::int32_t>::max()};
        Vec3i high = -low;
        const auto grow = [&](Vec3i c) {
            for (int r = 0; r < 3; ++r) {
                low[r] = std::min(low[r], c[r]);
                high[r] = std::max(high[r], c[r] + 1);
            }
        };
        for (std::uint32_t slot = 0; slot < volume.live(); ++slot) grow(unpack_key(volume.key(slot)));
        const ChunkStore& store = state.session.store();
        if (store.known() > 0) {
            grow(store.low());
            grow(store.high());
        }
        const ChunkStore::Counts counts = store.counts();
        out->chunks_evicted = counts.evicted;
        out->chunks_reloaded = counts.reloaded;
        out->store_bytes = counts.bytes;
        out->store_error = counts.disk_error;
        out->chunks_stored = store.away();
        const bool any = low.x < high.x;
        for (int r = 0; r < 3; ++r) {
            out->bounds_min_m[r] = any ? static_cast<float>(low[r] * 8.0 * volume.voxel_m()) : 1.0f;
            out->bounds_max_m[r] = any ? static_cast<float>(high[r] * 8.0 * volume.voxel_m()) : -1.0f;
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

}  // extern "C"
