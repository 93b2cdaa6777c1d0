// SPDX-License-Identifier: MIT
// simd/tsdf.h. One iteration is one chunk of 512 voxels.
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
            simd::observe_chunk(scene().window(), scene().offsets, scene().bases[static_cast<std::size_t>(i)],
                                scene().truncation, distances[i], nullptr);
    }
};
const Observed& observed() {
    static const Observed one;
    return one;
}

void observe(benchmark::State& state, bool quadratic) {
    alignas(64) std::int16_t distances[simd::kChunkVoxels];
    simd::TruncationModel truncation = scene().truncation;
    if (quadratic) truncation = {0.08f, true, 0.0038f, 0.00304f, 0.003f, 0.02f};
    std::size_t i = 0;
    while (state.KeepRunning()) {
        const auto got = simd::observe_chunk(scene().window(), scene().offsets, scene().bases[i], truncation,
                                             distances, nullptr);
        benchmark::DoNotOptimize(got);
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

void fuse(benchmark::State& state, simd::Drop drop) {
    simd::FuseModel model = scene().fuse;
    model.drop = drop;
    over_chunks(state, [&](const std::int16_t* distances, ChunkGeometry& chunk) {
        return simd::fuse_distances(distances, nullptr, model, chunk.sdf, chunk.weight);
    });
}

void carve(benchmark::State& state) {
    over_chunks(state, [&](const std::int16_t* distances, ChunkGeometry& chunk) {
        return simd::carve_distances(distances, nullptr, 4, scene().fuse, chunk.sdf, chunk.weight);
    });
}

void fuse_colour(benchmark::State& state, bool distorted) {
    const simd::ColourWindow window = {scene().rgb.data(),
                                       KernelScene::kWidth,
                                       KernelScene::kHeight,
                                       3 * KernelScene::kWidth,
                                       distorted,
                                       KernelScene::kFocal,
                                       KernelScene::kFocal,
                                       KernelScene::kCentreU,
                                       KernelScene::kCentreV,
                                       distorted ? 0.1f : 0,
                                       0,
                                       0,
                                       0,
                                       0};
    const simd::ColourModel model = {16384, 7};
    std::vector<bench::PoolColour> chunks(KernelScene::kChunks);
    std::size_t i = 0;
    while (state.KeepRunning()) {
        simd::fuse_colours(observed().distances[i], window, scene().offsets, scene().bases[i], model,
                           &chunks[i].rgbn[0][0]);
        benchmark::ClobberMemory();
        i = (i + 1) % KernelScene::kChunks;
    }
}

using benchmark::State;
const bool registered[] = {
    bench::on_every_target("observe_chunk", [](State& s) { observe(s, false); }),
    bench::on_every_target("observe_chunk_quadratic", [](State& s) { observe(s, true); }),
    bench::on_every_target("fuse_distances", [](State& s) { fuse(s, simd::Drop::none); }),
    bench::on_every_target("fuse_distances_exponential", [](State& s) { fuse(s, simd::Drop::exponential); }),
    bench::on_every_target("carve_distances", carve),
    bench::on_every_target("fuse_colours", [](State& s) { fuse_colour(s, false); }),
    bench::on_every_target("fuse_colours_distorted", [](State& s) { fuse_colour(s, true); }),
};

}  // namespace
