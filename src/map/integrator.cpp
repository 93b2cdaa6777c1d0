// SPDX-License-Identifier: MIT
#include "map/integrator.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>

#include "core/hash.h"
#include "map/colour_pixels.h"
#include "map/integrator_job.h"

namespace burin {
namespace {

constexpr int kChunksPerItem = 64;  // one step of the job counter; 64 chunks take some 15 us
static_assert(kChunksPerItem % simd::kBatchChunks == 0);

// Adds the time since the last lap to `to`.
class Laps {
  public:
    void add(double* to) {
        const auto now = std::chrono::steady_clock::now();
        *to += std::chrono::duration<double, std::milli>(now - last_).count();
        last_ = now;
    }

  private:
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

// Pixels by groups are off by less than reach^2 / focal length: a tenth of a pixel here.
float group_reach(const simd::DepthProjection& projection, const Camera& camera, bool along_ray) {
    float along = 1;
    if (along_ray) {
        const double x = std::max(camera.cx, camera.width - 1 - camera.cx) / camera.fx,
                     y = std::max(camera.cy, camera.height - 1 - camera.cy) / camera.fy;
        along = static_cast<float>(std::sqrt(1 + x * x + y * y));
    }
    if (!projection.allows_groups(along)) return 0;
    return static_cast<float>(std::sqrt(0.1 * std::min(camera.fx, camera.fy)));
}

template <class Body>
void for_ranges(Jobs& jobs, int count, Body&& body) {
    jobs.run((count + kChunksPerItem - 1) / kChunksPerItem, [&](int item, int) {
        body(item * kChunksPerItem, std::min(count, (item + 1) * kChunksPerItem));
    });
}

}  // namespace

void Integrator::place(Arena& arena, const IntegrationOptions& options, int max_width, int max_height) {
    options_ = options;
    marker_.place(arena, max_width, max_height);
    ranges_.place(arena, max_width, max_height);
    depth_projection_ = arena.allocate<simd::DepthProjection>(1, 64);
    for (std::int32_t*& axis : xyz_) axis = arena.allocate<std::int32_t>(kBatch, 64);
    candidates_ = arena.allocate<Candidate>(kBatch, 64);
    chosen_ = arena.allocate<std::uint16_t>(kBatch, 64);
    missing_ = arena.allocate<std::uint16_t>(kBatch, 64);
    touched_ = arena.allocate<std::uint8_t>(kBatch, 64);
}

IntegrationCounts Integrator::integrate(Volume& volume, const DepthStage& depth, const FrameView& frame,
                                        std::uint32_t frame_number, Jobs& jobs, ChunkStore* store) {
    const DepthImage& image = depth.image;
    times_ = {};
    if (image.valid == 0) return {};
    Laps laps;
    const Se3 T_camera_world = frame.T_world_camera.inverse();
    const double voxel_m = volume.voxel_m();
    const float units_per_m = options_.truncation.units_per_m();
    // The image has a border of one pixel; distances are in stored units.
    const Projector projector(image.camera, T_camera_world, 1.0, units_per_m, voxel_m);

    simd::DepthProjection& projection = *depth_projection_;
    projection.pixels = image.pixels;
    projection.weights = image.weights;
    projection.width = image.width;
    projection.height = image.height;
    projection.stride = image.stride;
    projection.unit_m = image.unit_m;
    projection.truncation = options_.truncation;
    projection.drop = options_.drop;
    projection.drop_start_m = options_.drop_start_m;
    projector.fill(&projection.offsets);
    projector.fill(&projection.groups);
    ranges_.build(depth.tiles);
    marker_.begin(image, depth.tiles, frame.T_world_camera, options_.truncation, volume.voxel_m(), jobs);

    const Camera& cc = frame.colour_camera;
    Job job{volume,
            jobs,
            image,
            ranges_,
            projection,
            frame_number,
            image.unit_m * units_per_m,
            options_.along_ray,
            group_reach(projection, image.camera, options_.along_ray),
            marker_.origin(),
            {},
            volume.has_colour() && !frame.colour.empty(),
            {frame.colour.data,
             frame.colour.width,
             frame.colour.height,
             offsets_stride(frame),
             cc.distorted(),
             static_cast<float>(cc.fx),
             static_cast<float>(cc.fy),
             static_cast<float>(cc.cx),
             static_cast<float>(cc.cy),
             static_cast<float>(cc.k1),
             static_cast<float>(cc.k2),
             static_cast<float>(cc.p1),
             static_cast<float>(cc.p2),
             static_cast<float>(cc.k3),
             {},
             {},
             {},
             frame_number},
            // Colour is wanted where marching cubes will put vertices: within two voxels of the surface along
            // the ray covers slopes up to 60 degrees.
            static_cast<std::int16_t>(std::min(32766.0f, 2.0f * volume.voxel_m() * units_per_m)),
            // Up to those slopes the nearer end of an edge with a vertex lies within one.
            static_cast<std::uint16_t>(std::min(32766.0f, volume.voxel_m() * units_per_m)),
            Projector(cc, frame.T_colour_depth * T_camera_world, 0.0, 1.0, voxel_m),
            frame,
            {},
            store};
    for (int r = 0; r < 3; ++r)
        job.camera[r] = static_cast<std::int32_t>(std::floor(std::clamp(
            frame.T_world_camera.t[r] / (voxel_m * kChunkSide), -1.0 * kChunkLimit, 1.0 * kChunkLimit)));
    projector.fill(&job.chunk_projection, job.origin);
    if (job.with_colour) job.colour_projector.fill(&job.colour);

    IntegrationCounts counts;
    // With a store, a batch must fit the pool, however small that is; the frame need not.
    const int batch =
        store ? static_cast<int>(std::min<std::uint32_t>(kBatch, volume.shape().capacity)) : kBatch;
    while (marker_.next_slab())
        while (const int n = marker_.collect(xyz_[0], xyz_[1], xyz_[2], batch)) {
            laps.add(&times_.mark);
            fuse_batch(job, n, counts);
            laps = {};
        }
    laps.add(&times_.mark);
    if (options_.carve) carve(job, counts);
    if (options_.carve && store) carve_away(job, counts);
    laps.add(&times_.carve);
    return counts;
}

void Integrator::fuse_batch(Job& job, int count, IntegrationCounts& counts) {
    Volume& volume = job.volume;
    Laps laps;
    for_ranges(job.jobs, count, [&](int first, int end) { choose(job, first, end); });
    int chosen = 0, missing = 0;
    for (int i = 0; i < count; ++i) {
        if (candidates_[i].key == 0) continue;
        chosen_[chosen++] = static_cast<std::uint16_t>(i);
        if (candidates_[i].slot == kNoChunk) missing_[missing++] = static_cast<std::uint16_t>(i);
    }

    laps.add(&times_.choose);
    times_.candidates += static_cast<std::uint32_t>(count);
    times_.chosen += static_cast<std::uint32_t>(chosen);
    times_.missing += static_cast<std::uint32_t>(missing);

    // Chunks that are away are read meanwhile, in the order in which they will come.
    int told = 0;
    const auto read_ahead = [&] {
        while (told < missing && job.store->read_ahead(candidates_[missing_[told]].key)) ++told;
    };
    if (job.store) {
        job.store->begin_reading();
        read_ahead();
    }
    // Chunks that are not in the map: would they be touched?
    for_ranges(job.jobs, missing, [&](int first, int end) {
        alignas(64) std::int16_t distances[kChunkVoxels];
        alignas(64) std::uint16_t weights[kChunkVoxels];
        for (int i = first; i < end; ++i)
            touched_[i] =
                simd::observe_chunk(job.projection, candidates_[missing_[i]].projected, distances, weights)
                    .touched;
    });
    laps.add(&times_.test);
    if (job.store)
        make_room(job, chosen,
                  static_cast<std::uint32_t>(std::count_if(
                      touched_, touched_ + missing, [](std::uint8_t touched) { return touched != 0; })));
    for (int i = 0; i < missing; ++i) {
        if (!touched_[i]) continue;
        Candidate& candidate = candidates_[missing_[i]];
        const bool away = job.store && job.store->holds(candidate.key);
        if (away) read_ahead();
        // A chunk that is away and cannot come back may not begin anew.
        candidate.slot = !away                                     ? volume.reserve(candidate.key)
                         : volume.live() < volume.shape().capacity ? job.store->bring(volume, candidate.key)
                                                                   : kNoChunk;
        if (candidate.slot == kNoChunk)
            ++counts.dropped;
        else if (!away)
            candidate.fresh = true, ++counts.added;
    }

    laps.add(&times_.insert);

    std::atomic<std::uint32_t> fused{0};
    for_ranges(job.jobs, chosen, [&](int first, int end) {
        std::uint32_t done = 0;
        for (int i = first; i < end; ++i) {
            // The next chunk arrives while this one is fused.
            const std::uint32_t next = i + 1 < end ? candidates_[chosen_[i + 1]].slot : kNoChunk;
            done +=
                fuse_chunk(job, candidates_[chosen_[i]], next == kNoChunk ? nullptr : &volume.geometry(next));
        }
        fused.fetch_add(done, std::memory_order_relaxed);
    });
    counts.fused += fused.load();
    laps.add(&times_.fuse);
}

// Evicts until there is room for the chunks that this batch adds or brings back; those it has stay.
void Integrator::make_room(Job& job, int chosen, std::uint32_t chunks) {
    Volume& volume = job.volume;
    if (volume.shape().capacity - volume.live() >= chunks) return;
    const auto pin = [&](bool on) {
        for (int i = 0; i < chosen; ++i) {
            Candidate& candidate = candidates_[chosen_[i]];
            if (candidate.slot == kNoChunk) continue;
            candidate.slot = volume.find(candidate.key);
            std::uint8_t& flags = volume.flags(candidate.slot);
            flags = static_cast<std::uint8_t>(on ? flags | kChunkPinned : flags & ~kChunkPinned);
        }
    };
    pin(true);
    job.store->make_room(volume, chunks);
    pin(false);
}

// Which of the marked chunks does the band reach, by the range of depth where they fall? Their places in the
// map.
void Integrator::choose(const Job& job, int first, int end) {
    simd::ChunkBatch batch;
    for (int start = first; start < end; start += simd::kBatchChunks) {
        const int count = std::min(simd::kBatchChunks, end - start);
        for (int i = 0; i < simd::kBatchChunks; ++i) {
            const int from = start + std::min(i, count - 1);
            batch.x[i] = xyz_[0][from];
            batch.y[i] = xyz_[1][from];
            batch.z[i] = xyz_[2][from];
        }
        simd::project_chunks(job.chunk_projection, &batch);
        for (int i = 0; i < count; ++i) {
            Candidate& candidate = candidates_[start + i];
            candidate.fresh = false;
            const ChunkReach reach(job, batch, i, &candidate.projected);
            candidate.key = 0;
            const bool hidden = reach.most < batch.least_z[i] * (1 - kRounding) - 32768.0f;
            const bool in_front = reach.least > (batch.most_z[i] + 32768.0f) * (1 + kRounding);
            if (hidden || in_front) continue;
            candidate.key =
                pack_key({job.origin.x + batch.x[i], job.origin.y + batch.y[i], job.origin.z + batch.z[i]});
            job.volume.prefetch(candidate.key);
        }
    }
    for (int i = first; i < end; ++i)
        if (candidates_[i].key != 0) candidates_[i].slot = job.volume.find(candidates_[i].key);
}

// A colour is well known after some readings; from then on a chunk takes every third frame's, which saves
// half of the time and two thirds of the memory traffic. Which chunks are due follows from their keys and
// their content, so it is the same after loading a map.
bool Integrator::colour_due(const Job& job, const Candidate& candidate) {
    constexpr int kSettled = 4;
    return job.volume.colour_readings(candidate.slot) < kSettled ||
           (mix64(candidate.key) + job.frame_number) % 3 == 0;
}

bool Integrator::fuse_chunk(const Job& job, const Candidate& candidate, const ChunkGeometry* next) {
    const std::uint32_t slot = candidate.slot;
    if (slot == kNoChunk) return false;
    Volume& volume = job.volume;
    if (candidate.fresh) volume.wipe(slot);
    alignas(64) std::int16_t distances[kChunkVoxels];
    alignas(64) std::uint16_t weights[kChunkVoxels];
    if (!simd::observe_chunk(job.projection, candidate.projected, distances, weights, next).touched)
        return false;
    alignas(64) std::uint16_t coloured[simd::kListRoom];
    alignas(64) std::int32_t pixels[kChunkVoxels];
    std::uint8_t* colours = nullptr;
    int count = 0;
    if (job.with_colour && colour_due(job, candidate)) {  // they arrive while the distances are fused
        colours = &volume.colour(slot).rgbn[0][0];
        count = simd::select_voxels(distances, job.colour_band, colours, coloured);
        simd::find_pixels(coloured, count, job.colour, job.colour_projector.base(unpack_key(candidate.key)),
                          pixels);
    }
    ChunkGeometry& chunk = volume.geometry(slot);
    std::uint16_t moved = 0;
    const int least =
        simd::fuse_distances(distances, job.projection.weighted() ? weights : nullptr, options_.max_weight,
                             chunk.sdf, chunk.weight, job.mesh_band, &moved);
    volume.moved(slot) = add_saturated(volume.moved(slot), moved);
    volume.least_distance(slot) =
        static_cast<std::int16_t>(std::min<int>(volume.least_distance(slot), least));
    if (count > 0) {
        const int readings = job.frame.colour_format == PixelFormat::rgb8
                                 ? simd::fuse_colours(coloured, count, job.colour, pixels, colours)
                                 : fuse_other_format(job.frame, coloured, count, job.colour, pixels, colours);
        volume.colour_readings(slot) =
            static_cast<std::uint8_t>(std::max<int>(volume.colour_readings(slot), readings));
    }
    volume.touch(slot);
    volume.last_seen(slot) = job.frame_number;
    return true;
}

}  // namespace burin
