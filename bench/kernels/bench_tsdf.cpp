// SPDX-License-Identifier: MIT
// simd/tsdf.h, colour.h, visibility.h. One iteration is one chunk of 512 voxels.
#include "kernels/kernels.h"
#include "kernels/scene.h"

namespace {

using namespace burin;
using bench::KernelScene;

const KernelScene& scene() {
    static const KernelScene one;
    return one;
}

// The chunks' distances, as observe_chunk leaves them.
struct Observed {
    alignas(64) std::int16_t distances[KernelScene::kChunks][simd::kChunkVoxels];
    Observed() {
        for (int i = 0; i < KernelScene::kChunks; ++i)
            simd::observe_chunk(*scene().frame, scene().chunks[static_cast<std::size_t>(i)], distances[i],
                                nullptr);
    }
};
const Observed& observed() {
    static const Observed one;
    return one;
}

void observe(benchmark::State& state, bool quadratic) {
    alignas(64) std::int16_t distances[simd::kChunkVoxels];
    simd::DepthProjection frame = *scene().frame;
    if (quadratic) frame.truncation = {0.02f, true, 0.0038f, 0.00304f, 0.003f, 0.02f};
    std::size_t i = 0;
    while (state.KeepRunning()) {
        benchmark::DoNotOptimize(simd::observe_chunk(frame, scene().chunks[i], distances, nullptr));
        benchmark::ClobberMemory();
        i = (i + 1) % KernelScene::kChunks;
    }
}

template <class Body>
void over_chunks(benchmark::State& state, Body body) {
    std::vector<bench::PoolGeometry> chunks(KernelScene::kChunks);
    for (ChunkGeometry& chunk : chunks)
        for (int v = 0; v < kChunkVoxels; ++v) chunk.sdf[v] = 8000, chunk.weight[v] = 640;
    std::size_t i = 0;
    while (state.KeepRunning()) {
        benchmark::DoNotOptimize(body(observed().distances[i], chunks[i]));
        benchmark::ClobberMemory();
        i = (i + 1) % KernelScene::kChunks;
    }
}

void fuse(benchmark::State& state, bool weighted) {
    const std::vector<std::uint16_t> weights(simd::kChunkVoxels + 32, 50);
    const auto* aligned = reinterpret_cast<const std::uint16_t*>(
        (reinterpret_cast<std::uintptr_t>(weights.data()) + 63) & ~std::uintptr_t{63});
    over_chunks(state, [&](const std::int16_t* distances, ChunkGeometry& chunk) {
        return simd::fuse_distances(distances, weighted ? aligned : nullptr, KernelScene::kMaxWeight,
                                    chunk.sdf, chunk.weight);
    });
}

void carve(benchmark::State& state) {
    over_chunks(state, [&](const std::int16_t* distances, ChunkGeometry& chunk) {
        return simd::carve_distances(distances, nullptr, 4, KernelScene::kMaxWeight, chunk.sdf, chunk.weight);
    });
}

// The three steps of a chunk's colour.
void colour(benchmark::State& state, bool distorted) {
    simd::ColourFrame frame = scene().colour;
    frame.distorted = distorted;
    frame.k1 = distorted ? 0.1f : 0;
    std::vector<bench::PoolColour> chunks(KernelScene::kChunks);
    alignas(64) std::uint16_t list[simd::kListRoom];
    alignas(64) std::int32_t pixels[simd::kChunkVoxels];
    std::size_t i = 0;
    while (state.KeepRunning()) {
        std::uint8_t* colours = &chunks[i].rgbn[0][0];
        const int count = simd::select_voxels(observed().distances[i], 16384, colours, list);
        simd::find_pixels(list, count, frame, scene().colour_bases[i], pixels);
        benchmark::DoNotOptimize(simd::fuse_colours(list, count, frame, pixels, colours));
        benchmark::ClobberMemory();
        i = (i + 1) % KernelScene::kChunks;
    }
}

// Sixteen chunks an iteration.
void project(benchmark::State& state) {
    simd::ChunkProjection p{};
    p.origin_z = 3e6f;
    for (int k = 0; k < 8; ++k)
        p.corner_u[k] = p.corner_v[k] = 1e6f * static_cast<float>(k), p.corner_z[k] = 1e4f;
    simd::ChunkBatch batch{};
    while (state.KeepRunning()) {
        simd::project_chunks(p, &batch);
        benchmark::ClobberMemory();
    }
}

using benchmark::State;
const bool registered[] = {
    bench::on_every_target("observe_chunk", [](State& s) { observe(s, false); }),
    bench::on_every_target("observe_chunk_quadratic", [](State& s) { observe(s, true); }),
    bench::on_every_target("fuse_distances", [](State& s) { fuse(s, false); }),
    bench::on_every_target("fuse_distances_weighted", [](State& s) { fuse(s, true); }),
    bench::on_every_target("carve_distances", carve),
    bench::on_every_target("project_16_chunks", project),
    bench::on_every_target("colours", [](State& s) { colour(s, false); }),
    bench::on_every_target("colours_distorted", [](State& s) { colour(s, true); }),
};

}  // namespace
