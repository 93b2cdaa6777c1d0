// SPDX-License-Identifier: MIT
// The loop of fusion with given poses: depth, integrate, mesh. The only place where these stages meet.
#pragma once

#include <algorithm>
#include <cstdint>

#include "capture/frame.h"
#include "core/arena.h"
#include "core/jobs.h"
#include "core/status.h"
#include "depth/depth_image.h"
#include "map/chunk_source.h"
#include "map/chunk_store.h"
#include "map/integrator.h"
#include "map/map_file.h"
#include "map/raycast.h"
#include "map/volume.h"
#include "mesh/changes.h"
#include "mesh/mesher.h"
#include "planes/plane_layer.h"
#include "session/camera_tracking.h"

namespace burin {

struct FusionOptions {
    std::uint64_t budget_bytes = 0;
    VolumeShape volume;  // capacity is derived from the budget
    DepthOptions depth;
    IntegrationOptions integration;
    TrackingOptions tracking;
    PlaneOptions planes;             // room for chunks is derived from the capacity
    std::uint32_t store_chunks = 0;  // room in the index of a store; 0: there will be none
};

struct FrameReport {
    IntegrationCounts chunks;
    std::uint32_t valid_pixels = 0;
    double depth_ms = 0, integrate_ms = 0, planes_ms = 0;
    bool store_full = false, store_failed = false;
};

struct ScanReport {
    FrameReport fusion;
    TrackingReport tracking;
};

// What another thread does while a frame is tracked, which only reads the map: the mesh of what earlier
// frames changed, and the depth image of the next frame. Neither changes any result.
struct Beside {
    const FrameView* next = nullptr;  // checked; its pixels must stay as they are until it was scanned
    void (*mesh)(void* context, Jobs& jobs) = nullptr;  // calls mesh_chunks
    void* context = nullptr;
};

class FusionSession {
  public:
    // The largest capacity whose layout fits the budget, and the bytes of that layout. 0 chunks: the budget
    // does not even hold the parts that do not depend on the capacity; `bytes` is then what one chunk would
    // need.
    static std::uint32_t capacity_for(const FusionOptions& options, std::uint64_t* bytes);
    static std::uint64_t bytes_for(const FusionOptions& options, std::uint32_t capacity);

    // Lays everything out in the arena, options.volume.capacity chunks.
    void place(Arena& arena, const FusionOptions& options);
    void clear();

    // What is saved, loaded and cleared together with the map, such as the tracker's keyframes: a
    // FernSection. It must outlive the session's calls; null: nothing. A store (resume_store) does not keep
    // it.
    void keep_with_map(MapExtra* extra) { extra_ = extra; }

    // `frame` must have been checked.
    FrameReport integrate(const FrameView& frame, Jobs& jobs);

    // The same with the camera tracked: the pose of the frame counts only for the first one. A frame is fused
    // when its pose is sure.
    ScanReport scan(const FrameView& frame, Jobs& jobs, const Beside& beside = {});

    // Asked twice without a frame between, it remembers: the size first, then the mesh.
    MeshCounts count_mesh(const MeshOptions& options, Jobs& jobs) {
        if (counted(options)) return counts_;
        counts_ = mesher_.count(surface(), options, jobs);
        counted_options_ = options;
        counted_ = !jobs.stopped();
        return counts_;
    }
    bool counted(const MeshOptions& options) const { return counted_ && counted_options_ == options; }
    void extract_mesh(const MeshOptions& options, const MeshBuffers& out, Jobs& jobs) {
        mesher_.extract(surface(), options, out, jobs);
    }
    // One chunk's mesh for streaming; it is no longer listed then.
    MeshCounts mesh_one_chunk(ChunkKey key, const MeshOptions& options, const MeshBuffers& out);
    // The same for several, one behind the other in `out`: as many of the first ones as fit `room`. Returns
    // how many; `ranges` has one more when that did not fit.
    int mesh_chunks(const ChunkKey* keys, int count, const MeshOptions& options, const MeshBuffers& out,
                    MeshCounts room, ChunkMeshRange* ranges, Jobs& jobs);
    // The chunks to be meshed again, in key order: put(i, chunk) for the first `capacity`. Returns how many
    // there are.
    template <class Put>
    std::uint64_t changed_chunks(const ChangeRule& rule, Put&& put, std::uint64_t capacity) {
        const std::uint32_t count = list_changed(volume_, rule, frames_, scratch_);
        // And what planes complete where the map has no chunk.
        const std::uint32_t* entries = nullptr;
        const std::uint32_t completed = planes_.list_stale(volume_, &entries);
        for (std::uint32_t i = 0, k = 0; i + k < count + completed && i + k < capacity;) {
            const ChunkKey own = i < count ? volume_.key(scratch_[i]) : ~ChunkKey{0},
                           other = k < completed ? planes_.overlay().key(entries[k]) : ~ChunkKey{0};
            put(i + k, unpack_key(std::min(own, other)));
            ++(own < other ? i : k);
        }
        return std::uint64_t{count} + completed;
    }

    void raycast_map(const Camera& camera, const Se3& T_world_camera, const RaycastImages& out,
                     Jobs& jobs) const {
        raycast(volume_, camera, T_world_camera, options_.depth.max_depth_m, out, jobs);
    }

    // For the head of a map file.
    MapCameras cameras() const;
    Status save(const char* path, const MapFileHead& head, Progress* progress = nullptr);
    Status save(MapWriter& writer, const MapFileHead& head, const char* name, Progress* progress);
    // On failure the map is empty.
    Status load(const char* path, const MapFileHead& head, Progress* progress = nullptr);
    Status load(MapReader& reader, const MapFileHead& head, const char* name, Progress* progress);
    std::uint64_t hash();  // of all chunks, also of those in the store

    Status start_store() { return store_.start(); }  // its thread
    // A file for what finds no room in memory. resume: the map becomes that of its last commit.
    Status open_store(const char* path, const StoreHead& head) { return store_.create(path, head); }
    Status resume_store(const char* path);
    Status commit_store() { return store_.commit(volume_, frames_); }
    // All chunks in key order, put(i, chunk) for the first `capacity`. Returns how many there are.
    template <class Put>
    std::uint64_t all_chunks(Put&& put, std::uint64_t capacity) {
        std::uint64_t count = 0;
        if (store_.away() == 0) {
            volume_.sorted_slots(scratch_);
            for (; count < std::min<std::uint64_t>(capacity, volume_.live()); ++count)
                put(count, unpack_key(volume_.key(scratch_[count])));
            return volume_.live();
        }
        for (ChunkKey last = 0; count < capacity;) {
            const auto keys = store_.next_keys(volume_, last);
            if (keys.empty()) break;
            last = keys.back();
            for (const ChunkKey key : keys)
                if (count < capacity) put(count++, unpack_key(key));
        }
        return volume_.live() + std::uint64_t{store_.away()};
    }
    // Unit vector against gravity in the world, once an IMU told; see GravityFilter.
    bool gravity(Vec3d* up_world, double* sigma_rad) const { return tracking_.gravity(up_world, sigma_rad); }
    // Brings planes, and the surface that joins them, up to date with the map.
    void refresh_planes(Jobs& jobs) {
        Vec3d up;
        double sigma_rad = 0;
        planes_.refresh(volume_, gravity(&up, &sigma_rad) ? &up : nullptr, jobs);
        counted_ = false;
    }
    PlaneLayer& planes() { return planes_; }
    const PlaneLayer& planes() const { return planes_; }
    // What is meshed: the volume, with the planes over it.
    SurfaceField surface() const { return {volume_, planes_.enabled() ? &planes_.overlay() : nullptr}; }
    const ChunkStore& store() const { return store_; }

    const Volume& volume() const { return volume_; }
    std::uint64_t frames() const { return frames_; }
    std::uint64_t dropped() const { return dropped_; }

  private:
    void fuse(const FrameView& frame, Jobs& jobs, FrameReport* report);
    Vec3i middle_of_view(const FrameView& frame) const;
    void bring_around(ChunkKey key);
    MeshCounts mesh_at(ChunkKey key, const MeshOptions& options, const MeshBuffers& out,
                       const ChunkMeshRange& range) const;
    template <class Body>  // body(ChunkSource&)
    Status with_all_chunks(Body&& body);

    FusionOptions options_;
    Volume volume_;
    ChunkStore store_;
    DepthStage depth_;
    DepthStage depth_ahead_;  // of the next frame, when the last call was told of it
    struct {
        const void* pixels = nullptr;  // of that frame; null: none
        std::int64_t t_ns = 0;
        double ms = 0;
        bool is_of(const FrameView& frame) const {
            return pixels && pixels == pixels_of(frame) && t_ns == frame.t_ns;
        }
        static const void* pixels_of(const FrameView& frame) {
            return frame.depth_u16.data ? static_cast<const void*>(frame.depth_u16.data)
                                        : frame.depth_f32.data;
        }
    } ahead_;
    CameraTracking tracking_;
    Integrator integrator_;
    PlaneLayer planes_;
    Mesher mesher_;
    MapExtra* extra_ = nullptr;
    std::uint32_t* scratch_ = nullptr;  // one entry a chunk
    std::uint64_t frames_ = 0, dropped_ = 0;
    bool counted_ = false;  // counts_ and what mesher_ holds are of the volume as it is
    MeshOptions counted_options_;
    MeshCounts counts_;
};

}  // namespace burin
