// SPDX-License-Identifier: MIT
// Fuses a prepared depth image (and colour) into the volume: projective signed distance and running average
// (Curless & Levoy 1996; KinectFusion 2011, section 3.2) over the chunks that the truncation band crosses.
#pragma once

#include <cstdint>

#include "core/arena.h"
#include "core/jobs.h"
#include "depth/depth_image.h"
#include "map/band_marker.h"
#include "map/chunk_store.h"
#include "map/depth_ranges.h"
#include "map/volume.h"
#include "simd/tsdf.h"

namespace burin {

struct IntegrationOptions {
    simd::TruncationModel truncation{};
    simd::Drop drop = simd::Drop::none;
    float drop_start_m = 0;        // behind the surface by less than this the weight is full
    std::uint16_t max_weight = 0;  // of a voxel, in units of 1/64 observation, at most 64000
    bool along_ray = false;        // signed distances along the viewing ray instead of along the optical axis
    bool carve = true;
};

struct IntegrationCounts {
    std::uint32_t fused = 0, added = 0, carved = 0, dropped = 0;  // chunks
};

// Where the time of one call went, milliseconds: setting up and marking; choosing chunks by their range of
// depth and finding them in the map; distances of those that are not there; inserting; distances and averages
// of all; carving.
struct IntegrationTimes {
    double mark = 0, choose = 0, test = 0, insert = 0, fuse = 0, carve = 0;
    std::uint32_t candidates = 0, chosen = 0, missing = 0;  // chunks
};

class Integrator {
  public:
    // max_width, max_height: of the largest depth image that will come.
    void place(Arena& arena, const IntegrationOptions& options, int max_width, int max_height);

    // A chunk is touched if and only if the centre of at least one of its voxels lies in the band at its
    // nearest pixel; voxels in front of the band in touched chunks take +truncation. New chunks are inserted
    // in key order; those that find no room are counted in `dropped`. `frame_number` >= 1 and different for
    // every call. `frame` gives the pose and the colour; its depth is `depth.image`. `store`: null, or where
    // chunks go when the pool is full and come from when the frame changes them.
    IntegrationCounts integrate(Volume& volume, const DepthStage& depth, const FrameView& frame,
                                std::uint32_t frame_number, Jobs& jobs, ChunkStore* store = nullptr);

    const IntegrationTimes& times() const { return times_; }  // of the last call

  private:
    struct Job;  // what all chunks of a frame share
    struct Candidate {
        simd::ProjectedChunk projected;
        bool fresh;  // reserved in this frame, its voxels not yet wiped
        std::uint32_t slot;
        ChunkKey key;
    };
    void fuse_batch(Job& job, int count, IntegrationCounts& counts);
    void make_room(Job& job, int chosen, std::uint32_t chunks);
    void choose(const Job& job, int first, int end);
    bool fuse_chunk(const Job& job, const Candidate& candidate, const ChunkGeometry* next);
    static bool colour_due(const Job& job, const Candidate& candidate);
    void carve(Job& job, IntegrationCounts& counts);
    void carve_away(Job& job, IntegrationCounts& counts);
    std::uint32_t carve_slots(const Job& job, const std::uint32_t* slots, int count);

    // Candidates taken through the steps (choose, test, insert, fuse) at a time: enough to keep threads busy,
    // and their table (80 KiB) stays in the second-level cache.
    static constexpr int kBatch = 2048;

    IntegrationOptions options_;
    IntegrationTimes times_;
    BandMarker marker_;
    DepthRanges ranges_;
    simd::DepthProjection* depth_projection_ = nullptr;
    std::int32_t* xyz_[3] = {};         // kBatch chunks relative to the marker's origin
    Candidate* candidates_ = nullptr;   // kBatch
    std::uint16_t* chosen_ = nullptr;   // kBatch: candidates in reach, in order
    std::uint16_t* missing_ = nullptr;  // kBatch: those of them that are not in the map
    std::uint8_t* touched_ = nullptr;   // kBatch
};

}  // namespace burin
