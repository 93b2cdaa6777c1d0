// SPDX-License-Identifier: MIT
#include "roofline/stages.h"

#include <sys/mman.h>

#include <algorithm>

#include "api/config.h"
#include "core/arena.h"
#include "core/jobs.h"
#include "depth/depth_image.h"
#include "map/band_marker.h"
#include "map/integrator.h"
#include "map/volume.h"
#include "simd/tsdf.h"
#include "support/frames.h"

namespace burin::bench {
namespace {

constexpr int kLookAhead = 8;  // as in map/integrator.cpp
constexpr int kBatch = 16;     // chunks whose distances fit the first-level cache: 16 KiB

// The parts of a session, laid out in memory that is given back at the end.
struct Parts {
    FusionOptions options;
    Volume volume;
    DepthStage depth;
    BandMarker marker;
    Integrator integrator;
    Jobs jobs{1};
    void* memory = nullptr;
    std::size_t bytes = 0;

    ~Parts() {
        if (memory) munmap(memory, bytes);
    }
    void place(Arena& arena) {
        volume.place(arena, options.volume);
        depth.place(arena, options.depth);
        marker.place(arena);
        integrator.place(arena, options.integration);
    }
    Status create(const burin_config& config) {
        std::uint64_t map_bytes = 0;
        BURIN_TRY(plan_map(config, &options, &map_bytes));
        Arena measure;
        place(measure);
        bytes = measure.used();
        memory =
            mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        if (memory == MAP_FAILED) return Status::error(Code::insufficient_memory, "stages: no memory");
        Arena arena(memory, bytes);
        place(arena);
        volume.clear();
        return {};
    }
};

// As in map/integrator.cpp: (fx X + cx Z, fy Y + cy Z, Z) of voxel centres.
struct Projection {
    double row[3][3], offset[3];
    Projection(const Camera& c, const Se3& T) {
        const double k[3][3] = {{c.fx, 0, c.cx}, {0, c.fy, c.cy}, {0, 0, 1}};
        const double t[3] = {T.t.x, T.t.y, T.t.z};
        for (int r = 0; r < 3; ++r) {
            offset[r] = k[r][0] * t[0] + k[r][1] * t[1] + k[r][2] * t[2];
            for (int j = 0; j < 3; ++j)
                row[r][j] = k[r][0] * T.R(0, j) + k[r][1] * T.R(1, j) + k[r][2] * T.R(2, j);
        }
    }
    float at(int r, double x, double y, double z, bool with_offset) const {
        return static_cast<float>(row[r][0] * x + row[r][1] * y + row[r][2] * z +
                                  (with_offset ? offset[r] : 0));
    }
    void fill(simd::ProjectiveOffsets* out, double voxel) const {
        for (int i = 0; i < kChunkVoxels; ++i) {
            const double x = voxel * (i & 7), y = voxel * (i >> 3 & 7), z = voxel * (i >> 6);
            out->u[i] = at(0, x, y, z, false), out->v[i] = at(1, x, y, z, false),
            out->z[i] = at(2, x, y, z, false);
        }
    }
    simd::ProjectiveBase base(ChunkKey key, double voxel) const {
        const Vec3i c = unpack_key(key);
        const double x = (8 * c.x + 0.5) * voxel, y = (8 * c.y + 0.5) * voxel, z = (8 * c.z + 0.5) * voxel;
        return {at(0, x, y, z, true), at(1, x, y, z, true), at(2, x, y, z, true)};
    }
};

// Milliseconds of body(), the least of `repeats`.
template <class Body>
double least_ms(int repeats, Body&& body) {
    double least = 1e30;
    for (int i = 0; i < repeats; ++i) {
        const double start = cpu_ms();
        body();
        least = std::min(least, cpu_ms() - start);
    }
    return least;
}

// The two passes over the frame's chunks that are in the map: distances, then averages.
void time_fusing(Parts& p, const std::vector<ChunkKey>& keys, const std::vector<std::uint32_t>& slots,
                 const simd::DepthWindow& window, const simd::ProjectiveOffsets& offsets,
                 const Projection& projection, int repeats, StageTimes* t) {
    const auto& options = p.options.integration;
    const double voxel = p.volume.voxel_m();
    alignas(64) static std::int16_t distances[kBatch][kChunkVoxels];
    alignas(64) static std::uint16_t weights[kChunkVoxels];
    alignas(64) static ChunkGeometry near[kBatch];
    std::uint16_t* w = window.weights ? weights : nullptr;
    const auto observe = [&](std::size_t i) {
        return simd::observe_chunk(window, offsets, projection.base(keys[i], voxel), options.truncation,
                                   distances[i % kBatch], w);
    };
    t->observe = least_ms(repeats, [&] {
        for (std::size_t i = 0; i < keys.size(); ++i) observe(i);
    });
    const auto fuse_into = [&](std::size_t i, ChunkGeometry& chunk) {
        simd::fuse_distances(distances[i % kBatch], w, options.fuse, chunk.sdf, chunk.weight);
    };
    const double both_near = least_ms(repeats, [&] {
        for (std::size_t i = 0; i < keys.size(); ++i) observe(i), fuse_into(i, near[i % kBatch]);
    });
    const double both_far = least_ms(repeats, [&] {
        for (std::size_t i = 0; i < keys.size(); ++i) {
            ChunkGeometry& chunk = p.volume.geometry(slots[i]);
            for (std::size_t b = 0; b < sizeof chunk; b += 64)
                __builtin_prefetch(reinterpret_cast<const char*>(&chunk) + b, 1);
            observe(i), fuse_into(i, chunk);
        }
    });
    t->fuse = std::max(0.0, both_near - t->observe);
    t->memory = std::max(0.0, both_far - both_near);
}

StageTimes time_frame(Parts& p, const FrameView& view, std::uint32_t number, int repeats) {
    StageTimes t;
    t.depth = least_ms(repeats, [&] { p.depth.prepare(view, p.jobs); });
    const DepthImage& image = p.depth.image;
    const auto& options = p.options.integration;
    std::vector<ChunkKey> keys, absent, fused;
    std::vector<std::uint32_t> slots;
    static ChunkKey batch[4096];
    t.mark = least_ms(repeats, [&] {
        keys.clear();
        p.marker.begin(image, p.depth.tiles, view.T_world_camera, options.truncation, p.volume.voxel_m());
        while (p.marker.next_slab())
            while (const int n = p.marker.collect(batch, 4096)) keys.insert(keys.end(), batch, batch + n);
    });
    slots.resize(keys.size());
    t.find = least_ms(repeats, [&] {
        for (std::size_t i = 0; i < keys.size(); ++i) {
            if (i + kLookAhead < keys.size()) p.volume.prefetch(keys[i + kLookAhead]);
            slots[i] = p.volume.find(keys[i]);
        }
    });
    for (std::size_t i = 0; i < keys.size(); ++i)
        if (slots[i] == kNoChunk) absent.push_back(keys[i]);
    t.candidates = static_cast<int>(keys.size()), t.absent = static_cast<int>(absent.size());

    const simd::DepthWindow window = {image.pixels, image.weights, image.width,
                                      image.height, image.stride,  image.unit_m};
    const Projection projection(image.camera, view.T_world_camera.inverse());
    static simd::ProjectiveOffsets offsets;
    projection.fill(&offsets, p.volume.voxel_m());
    alignas(64) std::int16_t distances[kChunkVoxels];
    t.observe_new = least_ms(repeats, [&] {
        for (const ChunkKey key : absent)
            simd::observe_chunk(window, offsets, projection.base(key, p.volume.voxel_m()), options.truncation,
                                distances, nullptr);
    });

    p.integrator.integrate(p.volume, p.depth, view, number, p.jobs);
    slots.clear();
    for (const ChunkKey key : keys) {
        const std::uint32_t slot = p.volume.find(key);
        if (slot == kNoChunk || p.volume.last_seen(slot) != number) continue;
        fused.push_back(key), slots.push_back(slot);
    }
    t.fused = static_cast<int>(fused.size());
    time_fusing(p, fused, slots, window, offsets, projection, repeats, &t);
    return t;
}

}  // namespace

Result<std::vector<StageTimes>> time_stages(const std::vector<Frame>& frames, const burin_config& config,
                                            int repeats) {
    Parts parts;
    BURIN_TRY(parts.create(config));
    std::vector<StageTimes> times;
    for (std::size_t i = 0; i < frames.size(); ++i)
        times.push_back(time_frame(parts, view_of(frames[i]), static_cast<std::uint32_t>(i + 1), repeats));
    return times;
}

}  // namespace burin::bench
