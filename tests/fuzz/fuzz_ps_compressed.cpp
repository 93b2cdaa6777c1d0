// SPDX-License-Identifier: MIT
// PrimeSense's compressed depth, in packets cut at random: never beyond the frame, the sums agree, and
// cutting changes nothing.
#include <vector>

#include "capture/ps_compressed.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

namespace {

std::vector<std::uint16_t> decode(const std::uint8_t* bytes, std::size_t size, std::size_t packet,
                                  std::size_t count, std::size_t before, std::size_t after,
                                  PsCompressed::Result* result) {
    // Guards on both sides; the sanitizer has its own behind them.
    std::vector<std::uint16_t> frame(count + 2, 0xabcd);
    PsCompressed decoder;
    decoder.begin(frame.data() + 1, count, before, after);
    for (std::size_t at = 0; at < size; at += packet)
        decoder.feed(bytes + at, size - at < packet ? size - at : packet);
    *result = decoder.end();
    fuzz::check(frame.front() == 0xabcd && frame.back() == 0xabcd);
    return frame;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 5) return 0;
    const std::size_t count = data[0] | data[1] << 8, before = data[2], after = data[3],
                      packet = data[4] + 1u;
    PsCompressed::Result once, cut;
    const auto whole = decode(data + 5, size - 5, size, count, before, after, &once);
    const auto parts = decode(data + 5, size - 5, packet, count, before, after, &cut);
    fuzz::check(whole == parts);
    fuzz::check(once.pixels == cut.pixels && once.missing == cut.missing && once.surplus == cut.surplus &&
                once.cut == cut.cut);
    fuzz::check(once.pixels + once.missing <= count && once.pixels + once.missing + before + after >= count);
    fuzz::check(once.surplus == 0 || once.missing == 0);
    fuzz::check(once.pixels + once.surplus <= 32 * (size - 5));  // 16 pixels for two nibbles
    return 0;
}
