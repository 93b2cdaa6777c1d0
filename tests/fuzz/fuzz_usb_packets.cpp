// SPDX-License-Identifier: MIT
// Data packets: the input as what comes in on a pipe, in pieces, through parser, assembler and decoder, for
// each framing and format.
#include <algorithm>
#include <memory>
#include <vector>

#include "fuzz/fuzz_checks.h"
#include "platform/usb/bytes.h"
#include "platform/usb/frame_decoder.h"

using namespace burin;

namespace {

constexpr int kWidth = 32, kHeight = 8, kPixels = kWidth * kHeight;

class Decoded final : public FrameTarget {
  public:
    FrameDecoder decoder;
    StreamKind kind = StreamKind::depth;
    std::vector<std::uint8_t> image = std::vector<std::uint8_t>(4 * kPixels + 8);
    int frames = 0, capacity = 0;
    void frame(const RawFrame& f) override {
        ++frames;
        fuzz::check(f.bytes >= 0 && f.bytes <= capacity && f.pad_before >= 0 && f.pad_after >= 0 &&
                    f.pad_before + f.pad_after <= kPixels);
        std::fill(image.begin(), image.end(), 0xcc);
        (void)decoder.decode(f, image.data());
        const std::size_t used = kind == StreamKind::colour ? image.size() - 8 : 2 * kPixels;
        for (std::size_t i = used; i < image.size(); ++i) fuzz::check(image[i] == 0xcc);
        if (kind == StreamKind::colour) return;
        const auto* pixels = reinterpret_cast<const std::uint16_t*>(image.data());
        for (int i = 0; i < kPixels; ++i)
            fuzz::check(pixels[i] < (kind == StreamKind::depth ? kMaxDepth_mm : 1024));
    }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 3) return 0;
    const DepthGeometry geometry = {7.5, 2.4, 120, 0.1042, 200};
    static std::uint16_t table[kShifts];
    if (table[300] == 0) build_depth_table(geometry, 1, table);

    const auto framing = static_cast<PacketFraming>(data[0] % 3);
    SensorMode mode;
    mode.width = kWidth, mode.height = kHeight, mode.fps = 30;
    constexpr WireFormat kDepth[] = {WireFormat::shift16, WireFormat::ps_depth, WireFormat::packed10,
                                     WireFormat::packed11, WireFormat::packed12};
    constexpr WireFormat kColour[] = {WireFormat::bayer, WireFormat::uyvy, WireFormat::yuyv,
                                      WireFormat::ps_yuv, WireFormat::ps_bayer};
    static auto decoded = std::make_unique<Decoded>();
    Decoded& target = *decoded;
    target.frames = 0;
    const int which = data[1] % 11;
    target.kind = which < 5 ? StreamKind::depth : which < 10 ? StreamKind::colour : StreamKind::infrared;
    mode.format = which < 5 ? kDepth[which] : which < 10 ? kColour[which - 5] : WireFormat::packed10;
    if (!target.decoder.reset(target.kind, mode, table, data[1] & 128)) return 0;

    FrameLayout layout;
    layout.stream = target.kind == StreamKind::depth ? PacketStream::depth : PacketStream::image;
    layout.pixels = kPixels;
    if (framing == PacketFraming::whole) {
        layout.bytes = layout.capacity =
            wire_compressed(mode.format) ? 500 : wire_bytes(mode.format, kPixels);
        layout.packet_bytes = 60;
        layout.id_bits = 8;
    } else {
        layout.capacity =
            std::max(wire_bytes(WireFormat::ps_depth, kPixels), wire_bytes(mode.format, kPixels));
        layout.padded = target.kind == StreamKind::depth;
    }
    target.capacity = layout.capacity;
    FrameAssembler assembler;
    if (!assembler.reset(layout, &target)) return 0;
    PacketParser parser;
    parser.reset(&assembler, framing);
    // Pieces: a byte of length each, 0 a loss.
    for (std::size_t at = 2; at < size;) {
        const std::size_t piece = std::min<std::size_t>(data[at], size - at - 1);
        ++at;
        if (piece == 0) parser.lost();
        // In a buffer of its own, so that reading beyond is seen.
        const std::vector<std::uint8_t> own(data + at, data + at + piece);
        if (piece > 0) parser.bytes(own.data(), static_cast<int>(piece));
        at += piece;
    }
    fuzz::check(assembler.garbage_bytes() <= size);
    return 0;
}
