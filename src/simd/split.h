// SPDX-License-Identifier: MIT
// Kernels for two images in one, nibbles, and linear scales. Byte layouts: docs/capture_pixels.md. Those that
// take `bytes` do the first `count` pixels, or as many as the bytes hold, return how many, and read no byte
// beyond.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin::simd {

// Left and right images of a stereo pair, pixel by pixel: a byte each (Y8I), 12 bits each in three bytes,
// left in the low bits of the little-endian word (Y12I), a little-endian word each (Y16I).
int split_y8i(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* left, std::uint8_t* right);
int split_y12i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
               std::uint16_t* right);
int split_y16i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
               std::uint16_t* right);

// Two pixels of 4 bits a byte, the first in the low ones (CNF4), to a byte each. The last byte of an odd
// count has its high ones unused.
int unpack_nibbles(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* out);

// out = clamp(floor((reading & mask) * scale + offset + 1/2), 0, 65535), but 0 where (reading & mask) ==
// none. |scale| <= 65536, |offset| <= 2^24, both finite; a `none` above 65535 matches nothing. `in` may be
// `out`.
struct Affine {
    float scale = 1, offset = 0;
    std::uint16_t mask = 0xffff;
    std::uint32_t none = 0x10000;
};
void affine_u16(const std::uint16_t* in, int count, const Affine& a, std::uint16_t* out);
void affine_u8(const std::uint8_t* in, int count, const Affine& a, std::uint16_t* out);

// out = min(in >> shift, 255): 16-bit infrared or raw Bayer of 8 + shift bits to bytes. 0 <= shift <= 8.
void narrow_u16(const std::uint16_t* in, int count, int shift, std::uint8_t* out);

namespace scalar {
int split_y8i(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* left, std::uint8_t* right);
int split_y12i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
               std::uint16_t* right);
int split_y16i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
               std::uint16_t* right);
int unpack_nibbles(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* out);
void affine_u16(const std::uint16_t* in, int count, const Affine& a, std::uint16_t* out);
void affine_u8(const std::uint8_t* in, int count, const Affine& a, std::uint16_t* out);
void narrow_u16(const std::uint16_t* in, int count, int shift, std::uint8_t* out);
}  // namespace scalar

}  // namespace burin::simd
