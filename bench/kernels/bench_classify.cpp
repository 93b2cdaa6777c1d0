// SPDX-License-Identifier: MIT
// simd/classify.h. One iteration is the 64 rows of one chunk.
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
    std::uint8_t known[64], inside[64];
    std::size_t i = 0;
    while (state.KeepRunning()) {
        simd::classify_rows(chunks[i].sdf, chunks[i].weight, 0, 1, 64, 32, known, inside);
        benchmark::DoNotOptimize(known);
        benchmark::DoNotOptimize(inside);
        benchmark::ClobberMemory();
        i = (i + 1) % chunks.size();
    }
}

const bool registered = bench::on_every_target("classify_rows", classify);

}  // namespace
