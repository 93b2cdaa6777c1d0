// SPDX-License-Identifier: MIT
// The specification of the kernels of split.h.
#include "simd/split.h"

#include <algorithm>

namespace burin::simd {
namespace {

inline int complete(std::size_t pixels, int count) {
    return static_cast<int>(std::min(static_cast<std::size_t>(count), pixels));
}

inline std::uint16_t scaled(std::uint16_t reading, const Affine& a) {
    const auto value = static_cast<std::uint16_t>(reading & a.mask);
    if (value == a.none) return 0;
    const float y = static_cast<float>(value) * a.scale + a.offset;
    return static_cast<std::uint16_t>(std::min(std::max(y, 0.0f), 65535.0f) + 0.5f);
}

}  // namespace

namespace scalar {

int split_y8i(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* left, std::uint8_t* right) {
    const int n = complete(bytes / 2, count);
    for (int i = 0; i < n; ++i, in += 2) {
        left[i] = in[0];
        right[i] = in[1];
    }
    return n;
}

int split_y12i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
               std::uint16_t* right) {
    const int n = complete(bytes / 3, count);
    for (int i = 0; i < n; ++i, in += 3) {
        left[i] = static_cast<std::uint16_t>((in[0] | in[1] << 8) & 0xfff);
        right[i] = static_cast<std::uint16_t>((in[1] | in[2] << 8) >> 4);
    }
    return n;
}

int split_y16i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
               std::uint16_t* right) {
    const int n = complete(bytes / 4, count);
    for (int i = 0; i < n; ++i, in += 4) {
        left[i] = static_cast<std::uint16_t>(in[0] | in[1] << 8);
        right[i] = static_cast<std::uint16_t>(in[2] | in[3] << 8);
    }
    return n;
}

int unpack_nibbles(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* out) {
    const int n = complete(bytes * 2, count);
    for (int i = 0; i < n; ++i) out[i] = static_cast<std::uint8_t>(in[i / 2] >> (i % 2 * 4) & 15);
    return n;
}

void affine_u16(const std::uint16_t* in, int count, const Affine& a, std::uint16_t* out) {
    for (int i = 0; i < count; ++i) out[i] = scaled(in[i], a);
}

void affine_u8(const std::uint8_t* in, int count, const Affine& a, std::uint16_t* out) {
    for (int i = 0; i < count; ++i) out[i] = scaled(in[i], a);
}

void narrow_u16(const std::uint16_t* in, int count, int shift, std::uint8_t* out) {
    for (int i = 0; i < count; ++i) out[i] = static_cast<std::uint8_t>(std::min(in[i] >> shift, 255));
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
int split_y8i(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* left, std::uint8_t* right) {
    return scalar::split_y8i(in, bytes, count, left, right);
}
int split_y12i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
               std::uint16_t* right) {
    return scalar::split_y12i(in, bytes, count, left, right);
}
int split_y16i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
               std::uint16_t* right) {
    return scalar::split_y16i(in, bytes, count, left, right);
}
int unpack_nibbles(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* out) {
    return scalar::unpack_nibbles(in, bytes, count, out);
}
void affine_u16(const std::uint16_t* in, int count, const Affine& a, std::uint16_t* out) {
    scalar::affine_u16(in, count, a, out);
}
void affine_u8(const std::uint8_t* in, int count, const Affine& a, std::uint16_t* out) {
    scalar::affine_u8(in, count, a, out);
}
void narrow_u16(const std::uint16_t* in, int count, int shift, std::uint8_t* out) {
    scalar::narrow_u16(in, count, shift, out);
}
#endif

}  // namespace burin::simd
