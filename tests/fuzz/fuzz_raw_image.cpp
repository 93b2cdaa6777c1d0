// SPDX-License-Identifier: MIT
// Raw bytes of any length as images of every layout: nothing is read beyond them, the counts are those of the
// bytes.
#include <memory>
#include <vector>

#include "capture/demosaic.h"
#include "capture/raw_image.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 5) return 0;
    const int kind = data[0], width = 1 + data[1], height = 1 + data[2] % 16;
    const std::size_t extra = data[3] % 8;
    const bool run = data[4] & 1;
    // A copy of its own, so that the sanitizer sees its end.
    const std::vector<std::uint8_t> bytes(data + 5, data + size);
    const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    const auto packing = static_cast<simd::Packing>(kind % simd::kPackings);
    const std::size_t tight = simd::packed_bytes(packing, static_cast<std::size_t>(width));
    const RawBytes raw = {bytes.data(), bytes.size(), run ? 0 : tight + extra};
    const RawBytes packed = {bytes.data(), bytes.size(), 0};
    std::vector<std::uint16_t> a(pixels), b(pixels), table(1u << (data[4] % 13), 5);
    const View<std::uint16_t> av{a.data(), width, height, width}, bv{b.data(), width, height, width};
    const DepthTable depth = {kind & 64 ? table.data() : nullptr, static_cast<int>(table.size())};
    fuzz::check(unpack_image(packing, raw, depth, av) <= pixels);
    fuzz::check(unpack_inzi(packed, av, bv) <= pixels);
    fuzz::check(unpack_y12i(packed, av, bv) <= bytes.size() / 3 || bytes.size() / 3 > pixels);
    fuzz::check(unpack_y16i(packed, av, bv) <= pixels);
    std::vector<std::uint8_t> l(pixels), r(pixels), rgb(3 * pixels);
    fuzz::check(unpack_y8i(packed, {l.data(), width, height, width}, {r.data(), width, height, width}) <=
                pixels);
    fuzz::check(unpack_confidence(packed, {l.data(), width, height, width}) <= pixels);
    fuzz::check(unpack_yuv422(static_cast<simd::Yuv422>(kind & 1), packed,
                              {rgb.data(), width, height, 3 * width, 3}) <= pixels);
    static const auto demosaic = std::make_unique<Demosaic>();
    const int bits = packing == simd::Packing::le16 || packing == simd::Packing::be16
                         ? 8 + kind / 32
                         : simd::packing_bits(packing);
    fuzz::check(demosaic->run({static_cast<BayerOrder>(kind / 8 % 4), packing, bits}, raw,
                              {rgb.data(), width, height, 3 * width, 3}) <= pixels);
    return 0;
}
