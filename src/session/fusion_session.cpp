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
    const Neighbourhood around(volume_, unpack_key(key));
    const MeshCounts counts = mesh_chunk(volume_, around, options, out);
    mark_meshed(volume_, around, counts.triangles > 0);
    return counts;
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
