// SPDX-License-Identifier: MIT
// Kernels that turn the words of a sensor into u16, with a table of depth by reading when there is one. Byte
// layouts: docs/capture_pixels.md.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin::simd {

// How pixels of 16 bits or less lie in bytes. Bit 7 is a byte's first.
enum class Packing : std::uint8_t {
    u8,      // a byte a pixel: GREY
    le16,    // Z16, Y10, Y12, Y16, SBGGR10 and the like
    be16,    // Y16_BE
    msb10,   // a run of bits, most significant first, no padding: Y10BPACK; Kinect and PrimeSense, 10 bits
    msb11,   // the same with 11 bits: Kinect and PrimeSense depth
    msb12,   // the same with 12 bits: PrimeSense depth
    mipi10,  // Y10P, pRAA: four bytes of high bits, a byte of their low bits, first pixel lowest
    mipi12,  // Y12P, pRCC: two bytes of high bits, a byte of their low bits, first pixel lowest
};
inline constexpr int kPackings = 8;

// Bits of a pixel.
inline constexpr int packing_bits(Packing p) {
    constexpr int kBits[kPackings] = {8, 16, 16, 10, 11, 12, 10, 12};
    return kBits[static_cast<int>(p)];
}

// Whole pixels come in groups of these. A run of bits may end inside one, with zero bits up to the byte's
// end.
struct PackedGroup {
    int pixels, bytes;
    bool whole;  // also the last one of a row is stored whole
};
inline constexpr PackedGroup packed_group(Packing p) {
    constexpr PackedGroup kGroups[kPackings] = {{1, 1, true},   {1, 2, true},  {1, 2, true}, {4, 5, false},
                                                {8, 11, false}, {2, 3, false}, {4, 5, true}, {2, 3, true}};
    return kGroups[static_cast<int>(p)];
}

// Bytes that hold so many pixels, and pixels that are complete in so many bytes (of 16 384 x 16 384 pixels at
// most).
inline constexpr std::size_t packed_bytes(Packing p, std::size_t pixels) {
    const PackedGroup g = packed_group(p);
    const auto group = static_cast<std::size_t>(g.pixels);
    if (g.whole) return (pixels + group - 1) / group * static_cast<std::size_t>(g.bytes);
    return (pixels * static_cast<std::size_t>(packing_bits(p)) + 7) / 8;
}
inline constexpr std::size_t packed_pixels(Packing p, std::size_t bytes) {
    const PackedGroup g = packed_group(p);
    if (g.whole) return bytes / static_cast<std::size_t>(g.bytes) * static_cast<std::size_t>(g.pixels);
    return bytes * 8 / static_cast<std::size_t>(packing_bits(p));
}

// The first `count` pixels, or as many as the `bytes` hold: returns how many, the rest of `out` stays. Reads
// no byte beyond `bytes`. `in` and `out` are apart, or the same for le16 and be16. count >= 0.
int unpack(Packing p, const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* out);

// Depth by reading: out = table[reading] for readings below `entries`, else 0. 1 <= entries <= 65536. What
// counts as no depth has 0 in the table. One pass, as unpack() otherwise.
int unpack_table(Packing p, const std::uint8_t* in, std::size_t bytes, int count, const std::uint16_t* table,
                 int entries, std::uint16_t* out);

namespace scalar {
int unpack(Packing p, const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* out);
int unpack_table(Packing p, const std::uint8_t* in, std::size_t bytes, int count, const std::uint16_t* table,
                 int entries, std::uint16_t* out);
}  // namespace scalar

}  // namespace burin::simd
