// SPDX-License-Identifier: MIT
// Space carving (Chisel 2015): chunks of the map that the band no longer reaches but that rays pass through
// take the same +truncation as free voxels of touched chunks do, so that noise and what has moved away fade.
#include <algorithm>
#include <atomic>

#include "core/hash.h"
#include "map/integrator_job.h"

namespace burin {
namespace {

// A chunk is looked at for carving every so many frames, with that many times the weight: noise fades as
// fast, and a frame pays a quarter. Which chunks are due follows from their keys, so it is the same after
// loading a map.
constexpr int kCarveEvery = 4;

constexpr std::uint32_t kScan = 512;  // chunks an item: a scan step is some 2 ns

}  // namespace

void Integrator::carve(Job& job, IntegrationCounts& counts) {
    const Volume& volume = job.volume;
    std::atomic<std::uint32_t> carved{0};
    job.jobs.run(static_cast<int>((volume.live() + kScan - 1) / kScan), [&](int item, int) {
        const std::uint32_t first = static_cast<std::uint32_t>(item) * kScan;
        std::uint32_t due[simd::kBatchChunks], count = 0;
        int waiting = 0;
        for (std::uint32_t slot = first; slot < std::min(volume.live(), first + kScan); ++slot) {
            if (volume.last_seen(slot) == job.frame_number || volume.least_distance(slot) == simd::kFree)
                continue;
            if ((mix64(volume.key(slot)) + job.frame_number) % kCarveEvery != 0) continue;
            due[waiting++] = slot;
            if (waiting < simd::kBatchChunks) continue;
            count += carve_slots(job, due, waiting);
            waiting = 0;
        }
        if (waiting > 0) count += carve_slots(job, due, waiting);
        carved.fetch_add(count, std::memory_order_relaxed);
    });
    counts.carved += carved.load();
}

std::uint32_t Integrator::carve_slots(const Job& job, const std::uint32_t* slots, int count) {
    Volume& volume = job.volume;
    simd::ChunkBatch batch;
    for (int i = 0; i < simd::kBatchChunks; ++i) {
        const Vec3i chunk = unpack_key(volume.key(slots[std::min(i, count - 1)])) - job.origin;
        batch.x[i] = chunk.x;
        batch.y[i] = chunk.y;
        batch.z[i] = chunk.z;
    }
    simd::project_chunks(job.chunk_projection, &batch);
    std::uint32_t carved = 0;
    for (int i = 0; i < count; ++i) {
        if (batch.most_z[i] <= 0.0f) continue;
        simd::ProjectedChunk projected;
        const ChunkReach reach(job, batch, i, &projected);
        if (!reach.may_be_free(batch.least_z[i])) continue;
        alignas(64) std::int16_t distances[kChunkVoxels];
        alignas(64) std::uint16_t weights[kChunkVoxels];
        const std::uint32_t slot = slots[i];
        if (!simd::observe_chunk(job.projection, projected, distances, weights, &volume.geometry(slot)).free)
            continue;
        ChunkGeometry& chunk = volume.geometry(slot);
        const int least = simd::carve_distances(distances, job.projection.weighted() ? weights : nullptr,
                                                kCarveEvery, options_.max_weight, chunk.sdf, chunk.weight);
        if (least < 0) continue;
        // Surface is being cleared away: as much as can be told.
        if (volume.least_distance(slot) <= job.mesh_band) volume.moved(slot) = 65535;
        volume.least_distance(slot) = static_cast<std::int16_t>(least);
        volume.touch(slot);
        volume.last_seen(slot) = job.frame_number;
        ++carved;
    }
    return carved;
}

// The chunks in the store that this frame carves come back for it. No others are read: whether a chunk is
// carved follows from its place alone.
void Integrator::carve_away(Job& job, IntegrationCounts& counts) {
    ChunkStore& store = *job.store;
    if (store.away() == 0) return;
    // Farther from the camera's chunk than this along an axis there is no free voxel: rays end before.
    const Camera& c = job.image.camera;
    const double widest = 1 + std::max(c.cx, c.width - c.cx) / c.fx,
                 highest = 1 + std::max(c.cy, c.height - c.cy) / c.fy;
    const double chunk_m = static_cast<double>(job.volume.voxel_m()) * kChunkSide;
    const auto farthest = static_cast<std::int32_t>(
        std::min(static_cast<double>(job.image.farthest_m) * (widest + highest) / chunk_m, 1e6) + 3);
    ChunkKey keys[simd::kBatchChunks];
    int waiting = 0;
    const auto flush = [&] {
        simd::ChunkBatch batch;
        for (int i = 0; i < simd::kBatchChunks; ++i) {
            const Vec3i chunk = unpack_key(keys[std::min(i, waiting - 1)]) - job.origin;
            batch.x[i] = chunk.x;
            batch.y[i] = chunk.y;
            batch.z[i] = chunk.z;
        }
        simd::project_chunks(job.chunk_projection, &batch);
        int wanted = 0;
        for (int i = 0; i < waiting; ++i) {
            if (batch.most_z[i] <= 0.0f) continue;
            simd::ProjectedChunk projected;
            const ChunkReach reach(job, batch, i, &projected);
            if (!reach.may_be_free(batch.least_z[i])) continue;
            alignas(64) std::int16_t distances[kChunkVoxels];
            alignas(64) std::uint16_t weights[kChunkVoxels];
            if (!simd::observe_chunk(job.projection, projected, distances, weights).free) continue;
            keys[wanted++] = keys[i];
            store.read_ahead(keys[i]);  // a batch has fewer chunks than the reader pages
        }
        for (int i = 0; i < wanted; ++i) {
            const std::uint32_t slot = store.bring(job.volume, keys[i]);
            if (slot != kNoChunk) counts.carved += carve_slots(job, &slot, 1);
        }
        waiting = 0;
    };
    store.begin_reading();
    store.for_each_away([&](const ChunkIndex::Entry& entry) {
        if (entry.free() || entry.last_seen == job.frame_number) return true;
        if ((mix64(entry.key) + job.frame_number) % kCarveEvery != 0) return true;
        const Vec3i from = unpack_key(entry.key) - job.camera;
        for (int r = 0; r < 3; ++r)
            if (from[r] > farthest || from[r] < -farthest) return true;
        keys[waiting++] = entry.key;
        if (waiting == simd::kBatchChunks) flush();
        return true;
    });
    if (waiting > 0) flush();
}

}  // namespace burin
