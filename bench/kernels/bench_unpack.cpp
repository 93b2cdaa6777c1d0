// SPDX-License-Identifier: MIT
// Raw bytes of a sensor to pixels: one frame of 640 x 480 (colour: 1280 x 720) a time.
#include <vector>

#include "capture/demosaic.h"
#include "capture/raw_image.h"
#include "kernels/kernels.h"
#include "scene_helpers.h"

using namespace burin;

namespace {

constexpr int kWidth = 640, kHeight = 480, kPixels = kWidth * kHeight;

const std::vector<std::uint8_t>& raw_bytes() {
    static const std::vector<std::uint8_t> bytes = [] {
        std::vector<std::uint8_t> made(4 * 1280 * 720);
        Rng rng(1);
        for (auto& b : made) b = static_cast<std::uint8_t>(rng.below(256));
        return made;
    }();
    return bytes;
}

void frame(benchmark::State& state, simd::Packing packing, bool look_up) {
    std::vector<std::uint16_t> out(kPixels), table(65536, 1000);
    const DepthTable depth = {look_up ? table.data() : nullptr, 1 << simd::packing_bits(packing)};
    const RawBytes raw = {raw_bytes().data(), simd::packed_bytes(packing, kPixels), 0};
    for (auto _ : state) {
        unpack_image(packing, raw, depth, {out.data(), kWidth, kHeight, kWidth});
        benchmark::DoNotOptimize(out.data());
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * kPixels);
}

const bool registered = [] {
    using simd::Packing;
    const std::pair<const char*, Packing> packings[] = {
        {"le16", Packing::le16},    {"be16", Packing::be16},   {"msb10", Packing::msb10},
        {"msb11", Packing::msb11},  {"msb12", Packing::msb12}, {"mipi10", Packing::mipi10},
        {"mipi12", Packing::mipi12}};
    for (const auto& [name, packing] : packings)
        bench::on_every_target(std::string("unpack_") + name, [p = packing](auto& s) { frame(s, p, false); });
    bench::on_every_target("unpack_msb11_depth", [](auto& s) { frame(s, Packing::msb11, true); });
    bench::on_every_target("split_y12i", [](auto& s) {
        std::vector<std::uint16_t> left(kPixels), right(kPixels);
        for (auto _ : s) {
            unpack_y12i({raw_bytes().data(), raw_bytes().size(), 0}, {left.data(), kWidth, kHeight, kWidth},
                        {right.data(), kWidth, kHeight, kWidth});
            benchmark::ClobberMemory();
        }
    });
    bench::on_every_target("affine_u16", [](auto& s) {
        std::vector<std::uint16_t> in(kPixels, 1234), out(kPixels);
        for (auto _ : s) {
            simd::affine_u16(in.data(), kPixels, {0.25f, 3, 0x1fff, 0}, out.data());
            benchmark::ClobberMemory();
        }
    });
    bench::on_every_target("yuyv_to_rgb_720p", [](auto& s) {
        std::vector<std::uint8_t> rgb(3 * 1280 * 720);
        for (auto _ : s) {
            unpack_yuv422(simd::Yuv422::yuyv, {raw_bytes().data(), raw_bytes().size(), 0},
                          {rgb.data(), 1280, 720, 3 * 1280, 3});
            benchmark::ClobberMemory();
        }
    });
    bench::on_every_target("demosaic_vga", [](auto& s) {
        std::vector<std::uint8_t> rgb(3 * kPixels);
        const auto demosaic = std::make_unique<Demosaic>();
        for (auto _ : s) {
            demosaic->run({}, {raw_bytes().data(), raw_bytes().size(), 0},
                          {rgb.data(), kWidth, kHeight, 3 * kWidth, 3});
            benchmark::ClobberMemory();
        }
    });
    return true;
}();

}  // namespace
