// SPDX-License-Identifier: MIT
#include "session/fusion_session.h"

#include <algorithm>
#include <chrono>

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
    depth_.place(arena, options.depth);
    integrator_.place(arena, options.integration, options.depth.max_width, options.depth.max_height);
    mesher_.place(arena, options.volume.capacity);
    scratch_ = arena.allocate<std::uint32_t>(options.volume.capacity, 64);
}

void FusionSession::clear() {
    volume_.clear();
    frames_ = dropped_ = 0;
    counted_ = false;
}

FrameReport FusionSession::integrate(const FrameView& frame, Jobs& jobs) {
    FrameReport report;
    counted_ = false;
    const double start = now_ms();
    depth_.prepare(frame, jobs);
    const double prepared = now_ms();
    ++frames_;
    report.chunks = integrator_.integrate(volume_, depth_, frame, static_cast<std::uint32_t>(frames_), jobs);
    report.valid_pixels = depth_.image.valid;
    report.depth_ms = prepared - start;
    report.integrate_ms = now_ms() - prepared;
    dropped_ += report.chunks.dropped;
    return report;
}

MeshCounts FusionSession::mesh_one_chunk(ChunkKey key, const MeshOptions& options, const MeshBuffers& out) {
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

Status FusionSession::load(const char* path, const MapFileHead& head, Progress* progress) {
    clear();
    BURIN_TRY(load_map(volume_, head, path, scratch_, progress));
    frames_ = head.frames;
    return {};
}

Status FusionSession::load(MapReader& reader, const MapFileHead& head, const char* name, Progress* progress) {
    clear();
    BURIN_TRY(load_map(volume_, head, reader, name, scratch_, progress));
    frames_ = head.frames;
    return {};
}

}  // namespace burin
