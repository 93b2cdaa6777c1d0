// SPDX-License-Identifier: MIT
#include "session/fusion_session.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

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
    if (options.tracking.tracker != Tracker::none) depth_ahead_.place(arena, options.depth);
    tracking_.place(arena, options.tracking, options.depth);
    extra_ = tracking_.keyframes();
    integrator_.place(arena, options.integration, options.depth.max_width, options.depth.max_height);
    // Half of the chunks of a map hold surface within reach of a plane, at most: the rest is free space
    // beside it.
    options_.planes.chunks = options.volume.capacity / 2;
    planes_.place(arena, options_.planes, options.volume);
    mesher_.place(arena, options.volume.capacity + planes_.overlay().capacity());
    scratch_ = arena.allocate<std::uint32_t>(options.volume.capacity, 64);
}

void FusionSession::clear() {
    volume_.clear();
    store_.is_open() ? store_.forget() : store_.clear();
    tracking_.clear();
    planes_.clear();
    if (extra_) extra_->clear();
    frames_ = dropped_ = 0;
    counted_ = false;
    ahead_ = {};
}

FrameReport FusionSession::integrate(const FrameView& frame, Jobs& jobs) {
    FrameReport report;
    const double start = now_ms();
    depth_.prepare(frame, jobs);
    report.depth_ms = now_ms() - start;
    fuse(frame, jobs, &report);
    return report;
}

ScanReport FusionSession::scan(const FrameView& frame, Jobs& jobs, const Beside& beside) {
    ScanReport report;
    const double start = now_ms();
    if (ahead_.is_of(frame)) {
        std::swap(depth_, depth_ahead_);
        report.fusion.depth_ms = ahead_.ms;
    } else {
        depth_.prepare(frame, jobs);
        report.fusion.depth_ms = now_ms() - start;
    }
    ahead_ = {};
    // With a store, meshing moves chunks.
    if (beside.mesh && store_.is_open()) beside.mesh(beside.context, jobs);
    auto other_work = [&] {
        Jobs alone(1);
        if (beside.mesh && !store_.is_open()) beside.mesh(beside.context, alone);
        if (!beside.next) return;
        const double began = now_ms();
        depth_ahead_.prepare(*beside.next, alone);
        ahead_ = {ahead_.pixels_of(*beside.next), beside.next->t_ns, now_ms() - began};
    };
    const double prepared = now_ms();
    jobs.start_behind(other_work);
    report.tracking = tracking_.track(volume_, depth_.image, frame, jobs);
    report.tracking.track_ms = now_ms() - prepared;
    jobs.finish_behind();
    report.fusion.valid_pixels = depth_.image.valid;
    if (report.tracking.state != TrackingState::tracking) return report;
    FrameView placed = frame;
    placed.T_world_camera = report.tracking.T_world_camera;
    fuse(placed, jobs, &report.fusion);
    return report;
}

void FusionSession::fuse(const FrameView& frame, Jobs& jobs, FrameReport* report) {
    const double start = now_ms();
    ++frames_;
    if (store_.is_open()) store_.begin_frame(middle_of_view(frame));
    report->chunks = integrator_.integrate(volume_, depth_, frame, static_cast<std::uint32_t>(frames_), jobs,
                                           store_.is_open() ? &store_ : nullptr);
    const ChunkStore::Counts store = store_.counts();
    report->store_full = store.full;
    report->store_failed = store.failed;
    report->valid_pixels = depth_.image.valid;
    const double integrated = now_ms();
    report->integrate_ms = integrated - start;
    planes_.note_camera(frame.T_world_camera);
    planes_.update(volume_, frames_, jobs);
    report->planes_ms = now_ms() - integrated;
    dropped_ += report->chunks.dropped;
    counted_ = false;
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
    counted_ = false;  // slots change
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
    const SurfaceField field = surface();
    planes_.mark_meshed(key);
    if (field.find(key) == kNoChunk) return {};
    const MeshCounts counts = mesh_chunk(field, Neighbourhood(field, unpack_key(key)), options, out);
    if (volume_.find(key) != kNoChunk)
        mark_meshed(volume_, Neighbourhood(volume_, unpack_key(key)), counts.triangles > 0);
    return counts;
}

MeshCounts FusionSession::mesh_at(ChunkKey key, const MeshOptions& options, const MeshBuffers& out,
                                  const ChunkMeshRange& range) const {
    if (surface().find(key) == kNoChunk) return {};
    const std::uint64_t v = 3 * range.first_vertex;
    return mesh_chunk(surface(), Neighbourhood(surface(), unpack_key(key)), options,
                      {out.positions + v, out.normals ? out.normals + v : nullptr,
                       out.colours ? out.colours + v : nullptr, out.triangles + 3 * range.first_triangle});
}

int FusionSession::mesh_chunks(const ChunkKey* keys, int count, const MeshOptions& options,
                               const MeshBuffers& out, MeshCounts room, ChunkMeshRange* ranges, Jobs& jobs) {
    const auto measure = [&](int i) {
        MeshCounts counts;
        if (surface().find(keys[i]) != kNoChunk)
            counts = count_chunk(surface(), Neighbourhood(surface(), unpack_key(keys[i])), options);
        ranges[i].vertices = counts.vertices;
        ranges[i].triangles = counts.triangles;
    };
    MeshCounts used;
    const auto place = [&](int i) {
        ranges[i].first_vertex = used.vertices;
        ranges[i].first_triangle = used.triangles;
        if (used.vertices + ranges[i].vertices > room.vertices ||
            used.triangles + ranges[i].triangles > room.triangles)
            return false;
        used.vertices += ranges[i].vertices;
        used.triangles += ranges[i].triangles;
        return true;
    };
    const auto meshed = [&](int i) {
        planes_.mark_meshed(keys[i]);
        if (volume_.find(keys[i]) != kNoChunk)
            mark_meshed(volume_, Neighbourhood(volume_, unpack_key(keys[i])), ranges[i].triangles > 0);
    };
    int done = 0;
    // One after the other, where there is one thread, or where what one mesh reads may not all be there for
    // the next. While there is room for any chunk, none needs to be counted first.
    if (store_.away() > 0 || jobs.threads() == 1) {
        for (; done < count; ++done) {
            ChunkMeshRange& range = ranges[done];
            bring_around(keys[done]);
            range = {};
            const bool any_fits = room.vertices - used.vertices >= kMaxChunkVertices &&
                                  room.triangles - used.triangles >= kMaxChunkTriangles;
            if (!any_fits) measure(done);
            if (!place(done)) break;
            if (any_fits || range.triangles > 0) {
                const MeshCounts counts = mesh_at(keys[done], options, out, range);
                used.vertices = range.first_vertex + (range.vertices = counts.vertices);
                used.triangles = range.first_triangle + (range.triangles = counts.triangles);
            }
            meshed(done);
        }
        return done;
    }
    constexpr std::size_t kPerItem = 8;  // chunks a step of the job counter, some 100 us
    const auto chunks = [&](int some, auto&& body) {
        jobs.run_pieces(static_cast<std::size_t>(some), kPerItem,
                        [&](std::size_t i) { body(static_cast<int>(i)); });
    };
    chunks(count, measure);
    while (done < count && place(done)) ++done;
    chunks(done, [&](int i) {
        if (ranges[i].triangles > 0) mesh_at(keys[i], options, out, ranges[i]);
    });
    for (int i = 0; i < done; ++i) meshed(i);
    return done;
}

template <class Body>
Status FusionSession::with_all_chunks(Body&& body) {
    if (store_.away() > 0) {
        StoreSource all(volume_, store_);
        return body(all);
    }
    VolumeSource resident(volume_, scratch_);
    return body(resident);
}

MapCameras FusionSession::cameras() const {
    MapCameras cameras = planes_.cameras();
    Vec3d up;
    double sigma_rad = 0;
    if (cameras.up_is_sure == 0 && gravity(&up, &sigma_rad)) {
        for (int r = 0; r < 3; ++r) cameras.up[r] = up[r];
        cameras.up_is_sure = 1;
    }
    return cameras;
}

Status FusionSession::save(const char* path, const MapFileHead& head, Progress* progress) {
    return with_all_chunks(
        [&](ChunkSource& chunks) { return save_map(chunks, options_.volume, head, path, progress, extra_); });
}

Status FusionSession::save(MapWriter& writer, const MapFileHead& head, const char* name, Progress* progress) {
    return with_all_chunks([&](ChunkSource& chunks) {
        return save_map(chunks, options_.volume, head, writer, name, progress, extra_);
    });
}

Status FusionSession::load(const char* path, const MapFileHead& head, Progress* progress) {
    clear();
    BURIN_TRY(load_map(volume_, head, path, scratch_, progress, extra_));
    frames_ = head.frames;
    planes_.set_cameras(head.cameras);
    tracking_.look_for_camera();
    return {};
}

Status FusionSession::load(MapReader& reader, const MapFileHead& head, const char* name, Progress* progress) {
    clear();
    BURIN_TRY(load_map(volume_, head, reader, name, scratch_, progress, extra_));
    frames_ = head.frames;
    planes_.set_cameras(head.cameras);
    tracking_.look_for_camera();
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
    planes_.clear();
    if (extra_) extra_->clear();
    frames_ = frames;
    dropped_ = 0;
    counted_ = false;
    tracking_.look_for_camera();
    return {};
}

}  // namespace burin
