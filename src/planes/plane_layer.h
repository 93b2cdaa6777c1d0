// SPDX-License-Identifier: MIT
// Planes on the fly (Dzitsiuk et al., ICRA 2017), a layer over the volume: candidates in chunks that changed,
// one set of global planes, and distances that join them, in an overlay. The volume is only read.
#pragma once

#include <cstdint>

#include "core/arena.h"
#include "core/jobs.h"
#include "core/se3.h"
#include "map/map_file.h"
#include "map/overlay.h"
#include "map/volume.h"
#include "planes/extents.h"
#include "planes/plane_extent.h"
#include "planes/plane_set.h"

namespace burin {

enum class MergeBy : std::uint8_t {
    ransac,  // a patch as hypothesis, its supporters the members
    growing  // from a patch to its neighbours
};

struct PlaneOptions {
    bool enabled = false;
    std::uint32_t chunks = 0;     // room for so many chunks with planes
    std::uint32_t planes = 512;   // at a time
    std::uint32_t turn_bits = 6;  // a chunk that changed has its turn every 64 frames
    MergeBy merge_by = MergeBy::ransac;
    double least_area_m2 = kLeastPlaneM2;  // smaller planes are not told and pull nothing
};

// The told planes as the last refresh() described them, valid until the next.
struct DescribedPlanes {
    const PlaneShape* shapes = nullptr;
    const PlaneExtent* extents = nullptr;
    const std::uint8_t* labels = nullptr;
    int count = 0;
};

inline constexpr int kChunkFills = 2;

// What the layer knows of one chunk, beside its entry in the overlay.
struct ChunkPlanes {
    Patch patch[kChunkPlanes];
    std::uint8_t count;   // of patches
    std::uint8_t pulled;  // number of planes that its distances were drawn to
    std::uint16_t pull[4];
    std::uint32_t revision;  // of the planes when they were
    // Columns that planes complete: bit 8 b + a at (a, b) along the plane's own axis.
    std::uint8_t fills;
    std::uint16_t fill_plane[kChunkFills];
    std::uint64_t fill_cells[kChunkFills];
    std::uint64_t fill_rim[kChunkFills];  // and those beside them
    void begin() { count = pulled = fills = 0; }
};

class PlaneLayer {
  public:
    void place(Arena& arena, const PlaneOptions& options, const VolumeShape& shape);
    void clear();
    bool enabled() const { return options_.enabled; }

    // The share of one frame: the chunks whose turn it is.
    void update(Volume& volume, std::uint64_t frame, Jobs& jobs);
    // Everything at once: every chunk that changed, planes merged until nothing changes, all chunks drawn to
    // them.
    // Also completes planes and labels them. up_world: against gravity, where known (null: as set_up() told,
    // else from the planes and the cameras so far, else z).
    void refresh(Volume& volume, const Vec3d* up_world, Jobs& jobs);

    // A camera that the map was fused from; also without planes, for those that will be found in its file.
    void note_camera(const Se3& T_world_camera);
    MapCameras cameras() const;
    void set_cameras(const MapCameras& cameras);
    void set_up(Vec3d up_world) { up_ = up_world, has_up_ = true; }
    // The direction that the last labels are by.
    Vec3d up() const { return labelled_up_; }

    // Entries where planes complete, or completed, surface in chunks that the volume does not have, and whose
    // mesh may differ from the one last extracted, in key order; *entries is valid until the next call here.
    std::uint32_t list_stale(const Volume& volume, const std::uint32_t** entries);
    void mark_meshed(ChunkKey key) {
        const std::uint32_t entry = overlay_.find(key);
        if (entry != kNoChunk) overlay_.set_stale(entry, false);
    }

    // Memory for find_objects, until the next call here.
    FootprintMemory lend() { return extents_.lend(); }

    DescribedPlanes described() const { return {shapes_, boxes_, labels_, described_}; }

    // The outline of a plane (its place in the set): of what was seen of it, or also of what was completed.
    // Points of the rings are corners of cells of *grid; valid until the next call here.
    Outline outline(std::uint16_t plane, bool completed, ExtentGrid* grid, OutlineCounts* counts);
    // The first told plane that a ray meets where it was seen or completed, from its free side; kNoPlane for
    // none.
    std::uint16_t hit(Vec3d origin, Vec3d direction, double max_m, double* distance_m) const;

    const Overlay& overlay() const { return overlay_; }
    PlaneSet& set() { return set_; }
    const PlaneSet& set() const { return set_; }
    const ChunkPlanes& chunk(std::uint32_t entry) const { return chunks_[entry]; }
    Vec3d centre_of(ChunkKey key) const;
    // Whether the plane is there and large enough to be told.
    bool told(const GlobalPlane& plane) const {
        // What is rough by a voxel is a hedge, a curtain, or noise.
        return plane.id != 0 && plane.area_m2 >= options_.least_area_m2 &&
               plane.rms_m() < static_cast<double>(shape_.voxel_m);
    }
    // Chunks that found no room since clear().
    std::uint64_t dropped() const { return dropped_; }

    // Of each triangle (3 indices, 3 coordinates a vertex): label, plane's id, and 1 where it was completed;
    // each may be null.
    void label_faces(const float* positions, const std::uint32_t* triangles, std::uint64_t count,
                     std::uint8_t* labels, std::uint32_t* ids, std::uint8_t* filled, const Volume& volume,
                     Jobs& jobs) const;

    // The plane (its place in the set) that surface at x with this normal in the chunk belongs to, kNoPlane.
    std::uint16_t plane_at(Vec3d x, Vec3d normal) const;

  private:
    struct Work {  // a chunk of a batch
        std::uint32_t slot, entry;
        std::int8_t found;  // candidates; -1: not looked for
        std::uint8_t pulls;
        std::uint16_t pull[4];
        float stretch[4], rms_m[4];
        Patch patch[kChunkPlanes];
    };
    static constexpr std::uint32_t kBatch = 512;
    static constexpr std::size_t kPerItem = 8;  // chunks a step of the job counter, some 40 us

    std::uint32_t list_due(Volume& volume, std::uint64_t frame);
    void process(Volume& volume, const std::uint32_t* slots, std::uint32_t count, Jobs& jobs);
    void assign(Volume& volume, Work& work);
    void gather_pulls(const Volume& volume, Work* work) const;
    void pull(Volume& volume, Work& work);
    void draw(Volume& volume, const std::uint32_t* slots, std::uint32_t count, Jobs& jobs);
    void check_patches(std::uint32_t entry);
    void describe(const Volume& volume, const Vec3d* up_world);
    void keep_fills(std::uint16_t plane, const ExtentGrid& grid);
    void fill(std::uint32_t entry, float units_to_m);
    void draw_alone(Volume& volume);
    void mark_around(Volume& volume, ChunkKey key);
    void make_room(Volume& volume);
    bool covers(std::uint32_t plane, Vec3d x) const;
    bool fills_at(Vec3i voxel, Vec3d x) const;
    bool merge_planes();
    // New planes among the patches that have none: `tries` hypotheses. Returns how many.
    int seed(int tries);
    std::uint32_t list_unassigned();
    // members_[0 .. members - 1] become a plane. 0: no room for it.
    int found_plane(const Scatter& sums, Vec3d normal, std::uint32_t members);
    int seed_region(int tries);
    std::uint32_t grow(std::uint32_t first, PlaneFit* fit);
    bool agrees(const PlaneFit& fit, const Patch& patch, Vec3d middle) const;
    std::uint32_t choose_members(const PlaneFit& fit, Vec3d low, Vec3d high, double margin, Scatter* sums,
                                 double* area, Vec3d* grown_low, Vec3d* grown_high);

    PlaneOptions options_;
    VolumeShape shape_;
    PlaneSet set_;
    Overlay overlay_;
    ChunkPlanes* chunks_ = nullptr;        // by entry
    std::uint32_t* turn_ = nullptr;        // slots
    std::uint32_t* unassigned_ = nullptr;  // 4 * entry + patch
    std::uint32_t* members_ = nullptr;     // of a plane to be: the same
    std::uint32_t unassigned_count_ = 0;
    Work* work_ = nullptr;
    PlaneExtents extents_;
    static constexpr std::uint32_t kOutlinePoints = 1 << 14;
    PlaneShape* shapes_ = nullptr;  // of the told planes, and the next three
    PlaneExtent* boxes_ = nullptr;
    std::uint16_t* places_ = nullptr;
    std::uint8_t* labels_ = nullptr;
    Vec3f* outlines_ = nullptr;
    int described_ = 0;
    struct Cameras {
        Vec3d up, position;  // sums
        double count = 0;
    } cameras_;
    Vec3d up_, labelled_up_{0, 0, 1};
    bool has_up_ = false;
    std::uint64_t random_ = 0, dropped_ = 0;
};

}  // namespace burin
