// SPDX-License-Identifier: MIT
// The depth stage's kernels over a whole 640 x 480 image on one thread: a tilted, rough wall with holes.
#include <vector>

#include "depth/depth_image.h"
#include "depth/filters.h"
#include "kernels/kernels.h"
#include "scene_helpers.h"
#include "simd/depth.h"

using namespace burin;

namespace {

constexpr int kWidth = 640, kHeight = 480;

const Image<std::uint16_t>& depth_mm() {
    static const Image<std::uint16_t> image = [] {
        Image<std::uint16_t> made(kWidth, kHeight);
        Rng rng(1);
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
                if (rng.below(10))
                    made.view().at(x, y) =
                        static_cast<std::uint16_t>(900 + 3 * x + 2 * y + rng.below(12) + (x / 80 % 2) * 300);
        return made;
    }();
    return image;
}

const Image<float>& depth_m() {
    static const Image<float> image = [] {
        Image<float> made(kWidth, kHeight);
        for (std::size_t i = 0; i < made.pixels.size(); ++i)
            made.pixels[i] = static_cast<float>(depth_mm().pixels[i]) * 0.001f;
        return made;
    }();
    return image;
}

DepthOptions options_with(bool bilateral) {
    DepthOptions o;
    o.bilateral = bilateral;
    return o;
}

const Camera kCamera{kWidth, kHeight, 525, 525, 319.5, 239.5};

// The stage on one thread: conversion, tiles, pyramid, and filters by the options.
void stage(benchmark::State& state, const DepthOptions& options, const FrameView& frame) {
    TestDepth depth(options);
    Jobs one(1);
    for (auto _ : state) {
        depth.stage.prepare(frame, one);
        benchmark::DoNotOptimize(depth.stage.image.valid);
    }
}

FrameView frame_u16() { return frame_of(depth_mm(), 0.001, kCamera, {}); }
FrameView frame_f32() { return frame_of(depth_m(), kCamera, {}); }

void convert(benchmark::State& state, int kind) {
    std::vector<std::uint16_t> out(kWidth * kHeight);
    const simd::DepthConversion c{0.2f, 4.0f, kind == 2 ? 1.0f : 0.001f, 4.0f / 65534};
    const simd::RawRange range = simd::raw_range(c);
    for (auto _ : state) {
        for (int y = 0; y < kHeight; ++y) {
            std::uint16_t* to = out.data() + y * kWidth;
            if (kind == 0) simd::keep_in_range(depth_mm().view().row(y), kWidth, range, to);
            if (kind == 1) simd::convert_u16(depth_mm().view().row(y), kWidth, c, to);
            if (kind == 2) simd::convert_f32(depth_m().view().row(y), kWidth, c, to);
        }
        benchmark::ClobberMemory();
    }
}

// One filter over a prepared image.
template <class Filter>
void filter(benchmark::State& state, Filter&& run) {
    TestDepth depth(options_with(true));
    Jobs one(1);
    depth.stage.prepare(frame_u16(), one);
    std::vector<std::uint16_t> out((kWidth + 2) * (kHeight + 2));
    std::vector<float> normals(3 * kWidth * kHeight);
    for (auto _ : state) {
        run(depth.stage.image, out.data(), normals.data(), one);
        benchmark::ClobberMemory();
    }
}

const bool registered = [] {
    const auto tiles = [](benchmark::State& state) {
        std::vector<simd::DepthRange> out(160 * 120);
        for (auto _ : state) {
            int valid = 0;
            for (int y = 0; y < kHeight; y += 4)
                valid += simd::tile_ranges(depth_mm().view().row(y), kWidth, 4, kWidth, out.data() + y * 40);
            benchmark::DoNotOptimize(valid);
            benchmark::ClobberMemory();
        }
    };
    bench::on_every_target("stage_u16_keep", [](auto& s) { stage(s, options_with(false), frame_u16()); });
    bench::on_every_target("stage_f32", [](auto& s) { stage(s, options_with(false), frame_f32()); });
    bench::on_every_target("stage_u16_bilateral", [](auto& s) { stage(s, options_with(true), frame_u16()); });
    bench::on_every_target("keep_in_range", [](auto& s) { convert(s, 0); });
    bench::on_every_target("convert_u16", [](auto& s) { convert(s, 1); });
    bench::on_every_target("convert_f32", [](auto& s) { convert(s, 2); });
    bench::on_every_target("tile_ranges", tiles);
    bench::on_every_target("bilateral", [](auto& s) {
        filter(s, [](const DepthImage& in, auto* out, float*, Jobs& one) { bilateral_filter(in, out, one); });
    });
    bench::on_every_target("remove_edges", [](auto& s) {
        filter(s, [](const DepthImage& in, auto* out, float*, Jobs& one) { remove_edges(in, out, one); });
    });
    bench::on_every_target("normals", [](auto& s) {
        filter(s, [](const DepthImage& in, auto*, float* n, Jobs& one) { compute_normals(in, n, one); });
    });
    bench::on_every_target("weights", [](auto& s) {
        filter(s, [](const DepthImage& in, auto* out, float*, Jobs& one) {
            observation_weights(in, {true, true, 64}, out, one);
        });
    });
    return true;
}();

}  // namespace
