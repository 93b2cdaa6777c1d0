// SPDX-License-Identifier: MIT
// What a recorder does to a VGA pair on one thread: the image of a structured-light sensor (a tilted wall,
// disparity in eighths of a pixel, holes) and a textured colour image.
#include <cmath>
#include <vector>

#include "capture/crc32.h"
#include "capture/recording_images.h"
#include "kernels/kernels.h"
#include "scene_helpers.h"

using namespace burin;

namespace {

DeviceInfo vga() {
    DeviceInfo info;
    for (const StreamKind kind : {StreamKind::depth, StreamKind::colour}) {
        StreamInfo& s = info.at(kind);
        s.kind = kind;
        s.pixels = kind == StreamKind::depth ? StreamPixels::u16 : StreamPixels::colour;
        s.width = 640;
        s.height = 480;
        set_image_bytes(&s);
    }
    return info;
}

std::vector<std::uint8_t> drawn(StreamKind kind) {
    std::vector<std::uint8_t> image(vga().at(kind).image_bytes);
    Rng rng(1);
    for (int y = 0; y < 480; ++y)
        for (int x = 0; x < 640; ++x) {
            const auto at = static_cast<std::size_t>(y) * 640 + static_cast<std::size_t>(x);
            if (kind == StreamKind::colour) {
                for (std::size_t c = 0; c < 3; ++c)
                    image[3 * at + c] =
                        static_cast<std::uint8_t>(90 + 60 * std::sin(0.02 * x + 0.03 * y) +
                                                  20 * static_cast<double>(c) + 3 * rng.normal());
                continue;
            }
            // 580 pixels by 75 mm is the Kinect's focal length and base.
            const double z = 0.9 + 0.003 * x + 0.002 * y + (x / 80 % 2) * 0.3;
            const double disparity = std::round(8 * (580 * 0.075 / z + 0.1 * rng.normal())) / 8;
            const auto mm = static_cast<std::uint16_t>(rng.below(12) == 0 ? 0 : 580 * 75 / disparity);
            std::memcpy(image.data() + 2 * at, &mm, 2);
        }
    return image;
}

void encode(benchmark::State& state, StreamKind kind, RecordedColour colour) {
    const DeviceInfo info = vga();
    const std::vector<std::uint8_t> image = drawn(kind);
    ImageEncoder encoder;
    if (!encoder.reserve(info, colour, 90).ok()) return state.SkipWithError("no memory");
    std::vector<std::uint8_t> out(encoder.bound());
    RecordHead head;
    std::size_t bytes = 0;
    for (auto _ : state) {
        bytes = encoder.encode(info.at(kind), image.data(), out.data(), &head.codec, &head.parameter);
        benchmark::DoNotOptimize(bytes);
    }
    state.counters["ratio"] = static_cast<double>(image.size()) / static_cast<double>(bytes);
}

void decode(benchmark::State& state, StreamKind kind, RecordedColour colour) {
    const DeviceInfo info = vga();
    std::vector<std::uint8_t> image = drawn(kind);
    ImageEncoder encoder;
    ImageDecoder decoder;
    if (!encoder.reserve(info, colour, 90).ok() || !decoder.reserve(info).ok())
        return state.SkipWithError("no memory");
    std::vector<std::uint8_t> out(encoder.bound());
    RecordHead head;
    const std::size_t bytes =
        encoder.encode(info.at(kind), image.data(), out.data(), &head.codec, &head.parameter);
    for (auto _ : state)
        if (!decoder.decode(info.at(kind), head, out.data(), bytes, "it", image.data()).ok())
            return state.SkipWithError("no image");
}

void checksum(benchmark::State& state) {
    const std::vector<std::uint8_t> image = drawn(StreamKind::colour);
    for (auto _ : state) benchmark::DoNotOptimize(crc32(image.data(), image.size()));
    state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                            static_cast<std::int64_t>(image.size()));
}

BENCHMARK_CAPTURE(encode, depth, StreamKind::depth, RecordedColour::raw)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(encode, colour_jpeg, StreamKind::colour, RecordedColour::jpeg)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(encode, colour_lossless, StreamKind::colour, RecordedColour::lossless)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(decode, depth, StreamKind::depth, RecordedColour::raw)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(decode, colour_jpeg, StreamKind::colour, RecordedColour::jpeg)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(decode, colour_lossless, StreamKind::colour, RecordedColour::lossless)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(checksum)->Unit(benchmark::kMillisecond);

}  // namespace
