// SPDX-License-Identifier: MIT
// The specification of the kernels of unpack.h.
#include "simd/unpack.h"

#include <algorithm>

namespace burin::simd {
namespace {

// Pixel i of the bytes at `in`, which hold it whole.
inline std::uint16_t reading_at(Packing p, const std::uint8_t* in, std::size_t i) {
    switch (p) {
        case Packing::u8:
            return in[i];
        case Packing::le16:
            return static_cast<std::uint16_t>(in[2 * i] | in[2 * i + 1] << 8);
        case Packing::be16:
            return static_cast<std::uint16_t>(in[2 * i] << 8 | in[2 * i + 1]);
        case Packing::mipi10: {
            const std::uint8_t* group = in + i / 4 * 5;
            const unsigned k = i % 4;
            return static_cast<std::uint16_t>(group[k] << 2 | (group[4] >> (2 * k) & 3));
        }
        case Packing::mipi12: {
            const std::uint8_t* group = in + i / 2 * 3;
            const unsigned k = i % 2;
            return static_cast<std::uint16_t>(group[k] << 4 | (group[2] >> (4 * k) & 15));
        }
        case Packing::msb10:
        case Packing::msb11:
        case Packing::msb12:
            break;
    }
    const auto bits = static_cast<std::size_t>(packing_bits(p));
    const std::size_t first = i * bits, end = first + bits;  // bits
    std::uint32_t word = 0;
    for (std::size_t b = first / 8; b < (end + 7) / 8; ++b) word = word << 8 | in[b];
    return static_cast<std::uint16_t>(word >> ((8 - end % 8) % 8) & ((1u << bits) - 1));
}

inline int complete(Packing p, std::size_t bytes, int count) {
    return static_cast<int>(std::min(static_cast<std::size_t>(count), packed_pixels(p, bytes)));
}

}  // namespace

namespace scalar {

int unpack(Packing p, const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* out) {
    const int n = complete(p, bytes, count);
    for (int i = 0; i < n; ++i) out[i] = reading_at(p, in, static_cast<std::size_t>(i));
    return n;
}

int unpack_table(Packing p, const std::uint8_t* in, std::size_t bytes, int count, const std::uint16_t* table,
                 int entries, std::uint16_t* out) {
    const int n = complete(p, bytes, count);
    for (int i = 0; i < n; ++i) {
        const std::uint16_t reading = reading_at(p, in, static_cast<std::size_t>(i));
        out[i] = reading < entries ? table[reading] : std::uint16_t{0};
    }
    return n;
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
int unpack(Packing p, const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* out) {
    return scalar::unpack(p, in, bytes, count, out);
}
int unpack_table(Packing p, const std::uint8_t* in, std::size_t bytes, int count, const std::uint16_t* table,
                 int entries, std::uint16_t* out) {
    return scalar::unpack_table(p, in, bytes, count, table, entries, out);
}
#endif

}  // namespace burin::simd
