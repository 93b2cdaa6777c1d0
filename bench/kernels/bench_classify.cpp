// SPDX-License-Identifier: MIT
// simd/classify.h. One iteration is one chunk.
#include "kernels/kernels.h"
#include "kernels/scene.h"
#include "simd/classify.h"

namespace {

using namespace burin;

void classify(benchmark::State& state) {
    std::vector<bench::PoolGeometry> chunks(bench::KernelScene::kChunks);
    std::uint32_t seed = 1;
    for (ChunkGeometry& chunk : chunks)
        for (int v = 0; v < kChunkVoxels; ++v) {
            seed = seed * 1664525u + 1013904223u;
            chunk.sdf[v] = static_cast<std::int16_t>(seed >> 16);
            chunk.weight[v] = static_cast<std::uint16_t>(seed >> 24);
        }
    simd::ChunkBits bits;
    std::size_t i = 0;
    while (state.KeepRunning()) {
        simd::classify_chunk(chunks[i].sdf, chunks[i].weight, 8, {32, -20000, 20000}, &bits);
        benchmark::DoNotOptimize(bits);
        benchmark::ClobberMemory();
        i = (i + 1) % chunks.size();
    }
}

const bool registered = bench::on_every_target("classify_chunk", classify);

}  // namespace
