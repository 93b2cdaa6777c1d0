// SPDX-License-Identifier: MIT
#include "session/fusion_session.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace burin {
namespace {

double now_ms() {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

}  // namespace

std::uint64_t FusionSession::bytes_for(const FusionOptions& options, std::uint32_t capacity) {
    FusionOptions sized = options;
    sized.volume.capacity = capacity;
    FusionSession session;
    Arena arena;
    session.place(arena, sized);
    return arena.used();
}

std::uint32_t FusionSession::capacity_for(const FusionOptions& options, std::uint64_t* bytes) {
    *bytes = bytes_for(options, 1);
    if (*bytes > options.budget_bytes) return 0;
    // The layout grows with the capacity, so the largest that fits is found by bisection.
    std::uint64_t fits = 1, too_many = options.budget_bytes / sizeof(ChunkGeometry) + 1;
    too_many = std::min<std::uint64_t>(too_many, 1u << 30);
    while (fits + 1 < too_many) {
        const std::uint64_t middle = (fits + too_many) / 2;
        (bytes_for(options, static_cast<std::uint32_t>(middle)) <= options.budget_bytes ? fits : too_many) =
            middle;
    }
    *bytes = bytes_for(options, static_cast<std::uint32_t>(fits));
    return static_cast<std::uint32_t>(fits);
}

void FusionSession::place(Arena& arena, const FusionOptions& options) {
    options_ = options;
    volume_.place(arena, options.volume);
    store_.place(arena, options.volume, options.store_chunks);
    depth_.place(arena, options.depth);
    integrator_.place(arena, options.integration, options.depth.max_width, options.depth.max_height);
    mesher_.place(arena, options.volume.capacity);
    scratch_ = arena.allocate<std::uint32_t>(options.volume.capacity, 64);
}

void FusionSession::clear() {
    volume_.clear();
    store_.is_open() ? store_.forget() : store_.clear();
    frames_ = dropped_ = 0;
}

FrameReport FusionSession::integrate(const FrameView& frame, Jobs& jobs) {
    FrameReport report;
    const double start = now_ms();
    depth_.prepare(frame, jobs);
    const double prepared = now_ms();
    ++frames_;
    if (store_.is_open()) store_.begin_frame(middle_of_view(frame));
    report.chunks = integrator_.integrate(volume_, depth_, frame, static_cast<std::uint32_t>(frames_), jobs,
                                          store_.is_open() ? &store_ : nullptr);
    const ChunkStore::Counts store = store_.counts();
    report.store_full = store.full;
    report.store_failed = store.failed;
    report.valid_pixels = depth_.image.valid;
    report.depth_ms = prepared - start;
    report.integrate_ms = now_ms() - prepared;
    dropped_ += report.chunks.dropped;
    return report;
}

// The chunk in the middle of what a camera may see: from there, distance tells what leaves memory first.
Vec3i FusionSession::middle_of_view(const FrameView& frame) const {
    const Vec3d middle =
        frame.T_world_camera * Vec3d{0, 0, 0.5 * static_cast<double>(options_.depth.max_depth_m)};
    const double chunk_m = static_cast<double>(volume_.voxel_m()) * kChunkSide;
    Vec3i chunk;
    for (int r = 0; r < 3; ++r)
        chunk[r] = static_cast<std::int32_t>(
            std::floor(std::clamp(middle[r] / chunk_m, -1.0 * kChunkLimit, 1.0 * kChunkLimit)));
    return chunk;
}

// A chunk and what its mesh reads come back from the store.
void FusionSession::bring_around(ChunkKey key) {
    if (store_.away() == 0) return;
    const Vec3i centre = unpack_key(key);
    ChunkKey away[27];
    std::uint32_t count = 0;
    const auto for_neighbours = [&](auto&& body) {
        for (int i = 0; i < 27; ++i) {
            const Vec3i c = {centre.x + i % 3 - 1, centre.y + i / 3 % 3 - 1, centre.z + i / 9 - 1};
            if (chunk_in_range(c)) body(pack_key(c));
        }
    };
    for_neighbours([&](ChunkKey k) {
        if (store_.holds(k)) away[count++] = k;
    });
    if (count == 0) return;
    const auto pin = [&](bool on) {
        for_neighbours([&](ChunkKey k) {
            const std::uint32_t slot = volume_.find(k);
            if (slot == kNoChunk) return;
            std::uint8_t& flags = volume_.flags(slot);
            flags = static_cast<std::uint8_t>(on ? flags | kChunkPinned : flags & ~kChunkPinned);
        });
    };
    pin(true);
    store_.look_at(centre);
    if (store_.make_room(volume_, count))
        for (std::uint32_t i = 0; i < count; ++i) (void)store_.bring(volume_, away[i]);
    pin(false);
}

MeshCounts FusionSession::mesh_one_chunk(ChunkKey key, const MeshOptions& options, const MeshBuffers& out) {
    bring_around(key);
    const std::uint32_t slot = volume_.find(key);
    if (slot == kNoChunk) return {};
    spread_dirt_of(slot);  // a frame may have come in since the dirty chunks were listed
    volume_.flags(slot) = static_cast<std::uint8_t>(volume_.flags(slot) & ~kChunkStale);
    return mesh_chunk(volume_, slot, options, out);
}

// A change reaches the meshes of all neighbours: their cells read the voxels on the border, their normals one
// more.
void FusionSession::spread_dirt_of(std::uint32_t slot) {
    if (!(volume_.flags(slot) & kChunkDirty)) return;
    const Neighbourhood around(volume_, unpack_key(volume_.key(slot)));
    for (const std::uint32_t neighbour : around.slot)
        if (neighbour != kNoChunk) volume_.flags(neighbour) |= kChunkStale;
    volume_.flags(slot) = static_cast<std::uint8_t>(volume_.flags(slot) & ~kChunkDirty);
}

void FusionSession::spread_dirt() {
    for (std::uint32_t slot = 0; slot < volume_.live(); ++slot) spread_dirt_of(slot);
}

Status FusionSession::save(const char* path, const MapFileHead& head) {
    if (store_.away() > 0) {
        StoreSource all(volume_, store_);
        return save_map(all, options_.volume, head, path);
    }
    VolumeSource resident(volume_, scratch_);
    return save_map(resident, options_.volume, head, path);
}

Status FusionSession::load(const char* path, const MapFileHead& head) {
    clear();
    BURIN_TRY(load_map(volume_, head, path, scratch_));
    frames_ = head.frames;
    return {};
}

std::uint64_t FusionSession::hash() {
    if (store_.away() == 0) return volume_.hash(scratch_);
    return StoreSource(volume_, store_).hash();
}

Status FusionSession::resume_store(const char* path) {
    std::uint64_t frames = 0;
    BURIN_TRY(store_.resume(path, &frames));
    volume_.clear();
    frames_ = frames;
    dropped_ = 0;
    return {};
}

}  // namespace burin
