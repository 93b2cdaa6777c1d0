// SPDX-License-Identifier: MIT
// track/ferns.h: a full store of 1024 keyframes. Not a kernel of src/simd, so without targets.
#include <benchmark/benchmark.h>

#include "fern_helpers.h"

namespace {

using namespace burin;

const TestFerns& full() {
    static TestFerns ferns;
    FernKeyframes& k = ferns.keyframes;
    if (k.count() > 0) return ferns;
    for (std::uint32_t i = 0; i < 1024; ++i)
        k.add(k.encode(stamp(i / 8, 60, i)), {{}, {0.1 * (i / 8), 0.02 * (i % 8), 0}}, i, 0);
    return ferns;
}

void nearest(benchmark::State& state) {
    const FernKeyframes& k = full().keyframes;
    const FernCode code = k.encode(stamp(40));
    FernMatch best[8];
    while (state.KeepRunning()) benchmark::DoNotOptimize(k.nearest(code, best, 8));
}

void least_dissimilarity(benchmark::State& state) {
    const FernKeyframes& k = full().keyframes;
    const FernCode code = k.encode(stamp(40));
    while (state.KeepRunning()) benchmark::DoNotOptimize(k.least_dissimilarity(code));
}

void encode(benchmark::State& state) {
    const Thumbnail thumbnail = stamp(40);
    while (state.KeepRunning()) benchmark::DoNotOptimize(full().keyframes.encode(thumbnail));
}

void add_to_full(benchmark::State& state) {
    TestFerns ferns;
    FernKeyframes& k = ferns.keyframes;
    for (std::uint32_t i = 0; i < 1024; ++i) k.add(k.encode(stamp(i / 8, 60, i)), {}, i, 0);
    std::uint64_t i = 1024;
    std::vector<FernCode> codes;
    for (std::uint64_t n = 0; n < 256; ++n) codes.push_back(k.encode(stamp(1000 + n)));
    while (state.KeepRunning()) {
        benchmark::DoNotOptimize(k.add(codes[i % 256], {}, i, 0));
        ++i;
    }
}

void thumbnail_640x480(benchmark::State& state) {
    DepthOptions options;
    TestDepth depth(options);
    const Image<float> flat(640, 480, 1, 1.5f);
    const Image<std::uint8_t> colour(640, 480, 3, 90);
    FrameView view = frame_of(flat, test_camera(640, 480), {});
    view.colour = colour.view();
    const DepthImage& image = depth.prepare(view);
    while (state.KeepRunning()) benchmark::DoNotOptimize(make_thumbnail(image, view));
}

BENCHMARK(thumbnail_640x480)->Name("ferns_thumbnail/640x480");
BENCHMARK(encode)->Name("ferns_encode/500");
BENCHMARK(nearest)->Name("ferns_nearest/1024");
BENCHMARK(least_dissimilarity)->Name("ferns_least_dissimilarity/1024");
BENCHMARK(add_to_full)->Name("ferns_add_to_full/1024");

}  // namespace
