// SPDX-License-Identifier: MIT
#include "map/integrator.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/hash.h"

namespace burin {
namespace {

// A chunk is looked at for carving every so many frames, with that many times the weight: noise fades as
// fast, and a frame pays a quarter. Which chunks are due follows from their keys, so it is the same after
// loading a map.
constexpr int kCarveEvery = 4;

constexpr int kLookAhead = 8;  // keys between asking for a hash entry and reading it

constexpr int kChunksPerItem = 16;  // one step of the job counter; 16 chunks take some 10 us

void prefetch_for_write(const void* data, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; i += 64) __builtin_prefetch(static_cast<const char*>(data) + i, 1);
}

// A camera as the kernels want it: affine maps from world to (fx X + cx Z, fy Y + cy Z, Z).
struct Projector {
    double row[3][3];
    double offset[3];

    // Pixel coordinates grow by `shift`; all lengths are scaled by `scale`.
    Projector(const Camera& c, const Se3& T_camera_world, double shift, double scale) {
        const double cx = c.cx + shift, cy = c.cy + shift;
        const Mat3d& R = T_camera_world.R;
        const Vec3d& t = T_camera_world.t;
        for (int k = 0; k < 3; ++k) {
            row[0][k] = scale * (c.fx * R(0, k) + cx * R(2, k));
            row[1][k] = scale * (c.fy * R(1, k) + cy * R(2, k));
            row[2][k] = scale * R(2, k);
        }
        offset[0] = scale * (c.fx * t.x + cx * t.z);
        offset[1] = scale * (c.fy * t.y + cy * t.z);
        offset[2] = scale * t.z;
    }

    double at(int k, Vec3d p) const {
        return row[k][0] * p.x + row[k][1] * p.y + row[k][2] * p.z + offset[k];
    }

    // Of a point relative to voxel 0, in voxels.
    float step(int k, double voxel_m, double x, double y, double z) const {
        return static_cast<float>(row[k][0] * (x * voxel_m) + row[k][1] * (y * voxel_m) +
                                  row[k][2] * (z * voxel_m));
    }
    void fill(simd::ProjectiveOffsets* table, double voxel_m) const {
        const auto set = [&](float* u, float* v, float* z_out, double x, double y, double z) {
            *u = step(0, voxel_m, x, y, z);
            *v = step(1, voxel_m, x, y, z);
            *z_out = step(2, voxel_m, x, y, z);
        };
        for (int i = 0; i < kChunkVoxels; ++i) {
            const int half = i >> 2 & 1, at = i >> 3 << 2 | (i & 3);
            set(&table->u[half][at], &table->v[half][at], &table->z[half][at], i & 7, i >> 3 & 7, i >> 6);
        }
        for (int i = 0; i < 8; ++i)
            set(&table->corner_u[i], &table->corner_v[i], &table->corner_z[i], 7 * (i & 1), 7 * (i >> 1 & 1),
                7 * (i >> 2));
        for (int i = 0; i < 32; ++i)
            set(&table->block_u[i], &table->block_v[i], &table->block_z[i], 4 * (i & 1) + 1.5,
                4 * (i >> 1 & 1) + 1.5, i >> 2);
    }
    void fill(simd::ColourOffsets* table, double voxel_m) const {
        for (int i = 0; i < kChunkVoxels; ++i) {
            table->u[i] = step(0, voxel_m, i & 7, i >> 3 & 7, i >> 6);
            table->v[i] = step(1, voxel_m, i & 7, i >> 3 & 7, i >> 6);
            table->z[i] = step(2, voxel_m, i & 7, i >> 3 & 7, i >> 6);
        }
    }

    simd::ProjectiveBase base(ChunkKey key, double voxel_m) const {
        const Vec3i c = unpack_key(key);
        const Vec3d p = {(c.x * kChunkSide + 0.5) * voxel_m, (c.y * kChunkSide + 0.5) * voxel_m,
                         (c.z * kChunkSide + 0.5) * voxel_m};
        return {static_cast<float>(at(0, p)), static_cast<float>(at(1, p)), static_cast<float>(at(2, p))};
    }
};

}  // namespace

struct Integrator::Job {
    Volume& volume;
    const DepthStage& depth;
    Jobs& jobs;
    std::uint32_t frame_number;
    const simd::DepthProjection& projection;
    Projector depth_projector;
    bool with_colour;
    simd::ColourWindow colour_window;
    simd::ColourModel colour_model;
    Projector colour_projector;
};

void Integrator::place(Arena& arena, const IntegrationOptions& options) {
    options_ = options;
    marker_.place(arena);
    depth_projection_ = arena.allocate<simd::DepthProjection>(1, 64);
    colour_offsets_ = arena.allocate<simd::ColourOffsets>(1, 64);
    keys_ = arena.allocate<ChunkKey>(kBatch, 64);
    slots_ = arena.allocate<std::uint32_t>(kBatch, 64);
    touched_ = arena.allocate<std::uint8_t>(kBatch, 64);
}

IntegrationCounts Integrator::integrate(Volume& volume, const DepthStage& depth, const FrameView& frame,
                                        std::uint32_t frame_number, Jobs& jobs) {
    const DepthImage& image = depth.image;
    const Se3 T_camera_world = frame.T_world_camera.inverse();
    const bool with_colour = volume.has_colour() && !frame.colour.empty();
    const Camera& cc = frame.colour_camera;
    Job job{volume,
            depth,
            jobs,
            frame_number,
            *depth_projection_,
            // The image has a border of one pixel; distances are in stored units.
            Projector(image.camera, T_camera_world, 1.0,
                      static_cast<double>(options_.truncation.units_per_m())),
            with_colour,
            {frame.colour.data, frame.colour.width, frame.colour.height, frame.colour.stride, cc.distorted(),
             static_cast<float>(cc.fx), static_cast<float>(cc.fy), static_cast<float>(cc.cx),
             static_cast<float>(cc.cy), static_cast<float>(cc.k1), static_cast<float>(cc.k2),
             static_cast<float>(cc.p1), static_cast<float>(cc.p2), static_cast<float>(cc.k3)},
            {},
            Projector(cc, frame.T_colour_depth * T_camera_world, 0.0, 1.0)};
    // Colour is wanted where marching cubes will put vertices: within two voxels of the surface along the ray
    // covers slopes up to 60 degrees.
    job.colour_model.band = static_cast<std::int16_t>(
        std::min(32766.0f, 2.0f * volume.voxel_m() / options_.truncation.truncation_m * 32767.0f));
    job.colour_model.frame = frame_number;
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
    job.depth_projector.fill(&projection.offsets, volume.voxel_m());
    if (with_colour) job.colour_projector.fill(colour_offsets_, volume.voxel_m());

    IntegrationCounts counts;
    marker_.begin(image, depth.tiles, frame.T_world_camera, options_.truncation, volume.voxel_m());
    while (marker_.next_slab())
        while (const int n = marker_.collect(keys_, kBatch)) fuse_batch(job, n, counts);
    if (options_.carve && image.valid > 0) carve(job, counts);
    return counts;
}

void Integrator::fuse_batch(Job& job, int count, IntegrationCounts& counts) {
    Volume& volume = job.volume;
    const int items = (count + kChunksPerItem - 1) / kChunksPerItem;
    const auto for_each = [&](auto&& body) {
        job.jobs.run(items, [&](int item, int) {
            for (int i = item * kChunksPerItem; i < std::min(count, (item + 1) * kChunksPerItem); ++i)
                body(i);
        });
    };
    const double voxel_m = volume.voxel_m();

    // Candidates that are not in the map: would they be touched?
    for_each([&](int i) {
        if (i + kLookAhead < count) volume.prefetch(keys_[i + kLookAhead]);
        slots_[i] = volume.find(keys_[i]);
        touched_[i] = 0;
        if (slots_[i] != kNoChunk) return;
        alignas(64) std::int16_t distances[kChunkVoxels];
        alignas(64) std::uint16_t weights[kChunkVoxels];
        touched_[i] = simd::observe_chunk(job.projection, job.depth_projector.base(keys_[i], voxel_m),
                                          distances, weights)
                          .touched;
    });
    for (int i = 0; i < count; ++i) {
        if (!touched_[i]) continue;
        slots_[i] = volume.insert(keys_[i]);
        slots_[i] == kNoChunk ? ++counts.dropped : ++counts.added;
    }
    for_each([&](int i) {
        touched_[i] = 0;
        const std::uint32_t slot = slots_[i];
        if (slot == kNoChunk) return;
        alignas(64) std::int16_t distances[kChunkVoxels];
        alignas(64) std::uint16_t weights[kChunkVoxels];
        const std::uint16_t* w = job.projection.weighted() ? weights : nullptr;
        prefetch_for_write(&volume.geometry(slot), sizeof(ChunkGeometry));  // arrives while the depth is read
        const auto base = job.depth_projector.base(keys_[i], voxel_m);
        if (!simd::observe_chunk(job.projection, base, distances, weights).touched) return;
        ChunkGeometry& chunk = volume.geometry(slot);
        const int least = simd::fuse_distances(distances, w, options_.max_weight, chunk.sdf, chunk.weight);
        volume.least_distance(slot) =
            static_cast<std::int16_t>(std::min<int>(volume.least_distance(slot), least));
        if (job.with_colour)
            simd::fuse_colours(distances, job.colour_window, *colour_offsets_,
                               job.colour_projector.base(keys_[i], voxel_m), job.colour_model,
                               &volume.colour(slot).rgbn[0][0]);
        volume.flags(slot) |= kChunkDirty;
        volume.last_seen(slot) = job.frame_number;
        touched_[i] = 1;
    });
    for (int i = 0; i < count; ++i) counts.fused += touched_[i];
}

// Space carving (Chisel 2015): chunks of the map that the band no longer reaches but that rays pass through
// take the same +truncation as free voxels of touched chunks do, so that noise and what has moved away fade.
void Integrator::carve(Job& job, IntegrationCounts& counts) {
    Volume& volume = job.volume;
    const DepthImage& image = job.depth.image;
    const double voxel_m = volume.voxel_m();
    const float to_units = options_.truncation.units_per_m();  // all lengths below are in stored units
    const float radius = static_cast<float>(kChunkSide * voxel_m * 0.8661) * to_units;  // half a chunk's diagonal
    const float half = static_cast<float>((kChunkSide - 1) * voxel_m / 2);
    const Projector& p = job.depth_projector;
    const float fx = static_cast<float>(image.camera.fx), fy = static_cast<float>(image.camera.fy);
    const float cx = static_cast<float>(image.camera.cx), cy = static_cast<float>(image.camera.cy);
    float to_centre[3];  // from voxel 0's projective coordinates to the chunk centre's
    for (int k = 0; k < 3; ++k)
        to_centre[k] = static_cast<float>((p.row[k][0] + p.row[k][1] + p.row[k][2]) * half);

    constexpr int kScan = 512;  // chunks an item: a scan step is some 10 ns
    std::atomic<std::uint32_t> carved{0};
    job.jobs.run(static_cast<int>((volume.live() + kScan - 1) / kScan), [&](int item, int) {
        std::uint32_t count = 0;
        for (std::uint32_t slot = static_cast<std::uint32_t>(item) * kScan;
             slot < std::min(volume.live(), (static_cast<std::uint32_t>(item) + 1) * kScan); ++slot) {
            if (volume.last_seen(slot) == job.frame_number || volume.least_distance(slot) == simd::kFree)
                continue;
            if ((mix64(volume.key(slot)) + job.frame_number) % kCarveEvery != 0) continue;
            const auto base = p.base(volume.key(slot), voxel_m);
            const float z = base.z + to_centre[2], near_z = z - radius;
            if (z + radius <= 0.0f) continue;
            DepthRange range;
            if (near_z <= radius) {  // too close for a useful box
                range = job.depth.tiles.over(0, 0, image.width - 1, image.height - 1);
            } else {
                // The chunk's sphere lies within these pixels: |x/z - X/Z| <= (radius + |X/Z| radius) /
                // near_z.
                const float u = (base.u + to_centre[0]) / z - 1.0f, v = (base.v + to_centre[1]) / z - 1.0f;
                const float du = radius * (fx + std::fabs(u - cx)) / near_z + 1.0f;
                const float dv = radius * (fy + std::fabs(v - cy)) / near_z + 1.0f;
                if (u + du < 0.0f || v + dv < 0.0f || u - du > static_cast<float>(image.width) ||
                    v - dv > static_cast<float>(image.height))
                    continue;
                range = job.depth.tiles.over(
                    static_cast<int>(std::max(u - du, 0.0f)), static_cast<int>(std::max(v - dv, 0.0f)),
                    static_cast<int>(std::min(u + du, 1e6f)), static_cast<int>(std::min(v + dv, 1e6f)));
            }
            if (range.largest == 0 ||
                static_cast<float>(range.largest) * image.unit_m * to_units - near_z < 32767.0f)
                continue;
            alignas(64) std::int16_t distances[kChunkVoxels];
            alignas(64) std::uint16_t weights[kChunkVoxels];
            const std::uint16_t* w = job.projection.weighted() ? weights : nullptr;
            if (!simd::observe_chunk(job.projection, base, distances, weights).free) continue;
            ChunkGeometry& chunk = volume.geometry(slot);
            const int least =
                simd::carve_distances(distances, w, kCarveEvery, options_.max_weight, chunk.sdf, chunk.weight);
            if (least < 0) continue;
            volume.least_distance(slot) = static_cast<std::int16_t>(least);
            volume.flags(slot) |= kChunkDirty;
            volume.last_seen(slot) = job.frame_number;
            ++count;
        }
        carved.fetch_add(count, std::memory_order_relaxed);
    });
    counts.carved += carved.load();
}

}  // namespace burin
