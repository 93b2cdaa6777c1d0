// SPDX-License-Identifier: MIT
// What every emulator sends and every client expects, pixel by pixel.
//
// Sample (x, y) of frame n has the value (n + offset(x, y)) modulo 2^bits, with offset(0, 0) = 0: the first
// sample tells n modulo 2^bits, and with it all others are known. Neighbours differ by nothing, by one, by
// tens and by hundreds in turn, so that each code of the compressed formats comes up.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace rig {

inline std::uint32_t pattern_offset(std::uint32_t x, std::uint32_t y) {
    const std::uint32_t block = x / 16, in = x % 16, base = 5 * block + 11 * y;
    switch ((block + y) % 4) {
        case 0:
            return base;  // runs of one value
        case 1:
            return base + in;  // differences of one
        case 2:
            return base + 37 * (in & 1);  // differences of 37
        default:
            return base + (((in * 2654435761u) ^ (y * 40503u)) >> 7 & 1023);  // jumps
    }
}

inline std::uint32_t pattern(std::uint32_t frame, std::uint32_t x, std::uint32_t y) {
    return frame + pattern_offset(x, y);
}

// How samples lie in memory. "columns" below are samples a row, "rows" all rows of all planes.
enum class Layout {
    u8,      // one byte a sample
    u16,     // two bytes, little endian, of which `bits` are used (the low ones)
    u16_be,  // the same, big endian
    packed,  // `bits` a sample, most significant bit first, no gaps (Kinect, PrimeSense)
    mipi10,  // four samples in five bytes: high bytes, then the low bits (pRAA, Y10P)
    pair12,  // two 12-bit samples in three bytes, least significant first (Y12I: left, right)
    inzi,    // a u16 plane of 10 bits, then a u16 plane of 16 bits: rows is twice the height
};

struct Format {
    Layout layout = Layout::u16;
    int bits = 16;
    int columns = 0, rows = 0;
};

inline std::size_t format_bytes(const Format& f) {
    const std::size_t n = static_cast<std::size_t>(f.columns) * f.rows;
    switch (f.layout) {
        case Layout::u8:
            return n;
        case Layout::packed:
            return (n * f.bits + 7) / 8;
        case Layout::mipi10:
            return n * 5 / 4;
        case Layout::pair12:
            return n * 3 / 2;
        default:
            return 2 * n;
    }
}

// Sample i (row by row) of a frame; `stride` is the bytes of a row, 0 for none between rows.
inline std::uint32_t format_sample(const Format& f, const std::uint8_t* data, std::size_t i,
                                   std::size_t stride = 0) {
    const std::size_t row = i / f.columns, column = i % f.columns;
    const auto row_bytes = [&](std::size_t packed_bytes) { return stride != 0 ? stride : packed_bytes; };
    switch (f.layout) {
        case Layout::u8:
            return data[row * row_bytes(f.columns) + column];
        case Layout::u16_be: {
            const std::uint8_t* p = data + row * row_bytes(2 * f.columns) + 2 * column;
            return static_cast<std::uint32_t>(p[0] << 8 | p[1]);
        }
        case Layout::packed: {
            const std::size_t bit = i * f.bits;
            std::uint32_t v = 0;
            for (int k = 0; k < f.bits; ++k) v = v << 1 | (data[(bit + k) / 8] >> (7 - (bit + k) % 8) & 1);
            return v;
        }
        case Layout::mipi10: {
            const std::uint8_t* p = data + row * row_bytes(f.columns * 5 / 4) + column / 4 * 5;
            return static_cast<std::uint32_t>(p[column % 4] << 2 | (p[4] >> 2 * (column % 4) & 3));
        }
        case Layout::pair12: {
            const std::uint8_t* p = data + row * row_bytes(f.columns * 3 / 2) + column / 2 * 3;
            return static_cast<std::uint32_t>(column % 2 == 0 ? p[0] | (p[1] & 15) << 8
                                                              : p[1] >> 4 | p[2] << 4);
        }
        default: {
            const std::uint8_t* p = data + row * row_bytes(2 * f.columns) + 2 * column;
            return static_cast<std::uint32_t>(p[0] | p[1] << 8);
        }
    }
}

inline std::uint32_t format_mask(const Format& f, std::size_t i) {
    const bool first_plane = f.layout == Layout::inzi && i < static_cast<std::size_t>(f.columns) * f.rows / 2;
    return (1u << (first_plane ? 10 : f.bits)) - 1;
}

// Frame n in this format; out has format_bytes(f).
template <class Value>
inline void format_fill(const Format& f, std::uint8_t* out, const Value& value) {
    std::uint64_t acc = 0;
    int have = 0;
    std::size_t i = 0;
    if (f.layout == Layout::mipi10) std::memset(out, 0, format_bytes(f));
    for (int y = 0; y < f.rows; ++y) {
        for (int x = 0; x < f.columns; ++x, ++i) {
            const std::uint32_t v = value(x, y) & format_mask(f, i);
            switch (f.layout) {
                case Layout::u8:
                    *out++ = static_cast<std::uint8_t>(v);
                    break;
                case Layout::u16_be:
                    *out++ = static_cast<std::uint8_t>(v >> 8), *out++ = static_cast<std::uint8_t>(v);
                    break;
                case Layout::packed:
                    acc = acc << f.bits | v;
                    for (have += f.bits; have >= 8; have -= 8)
                        *out++ = static_cast<std::uint8_t>(acc >> (have - 8));
                    break;
                case Layout::mipi10:
                    out[x % 4] = static_cast<std::uint8_t>(v >> 2);
                    out[4] = static_cast<std::uint8_t>(out[4] | (v & 3) << 2 * (x % 4));
                    if (x % 4 == 3) out += 5;
                    break;
                case Layout::pair12:
                    if (x % 2 == 0)
                        out[0] = static_cast<std::uint8_t>(v), out[1] = static_cast<std::uint8_t>(v >> 8);
                    else
                        out[1] = static_cast<std::uint8_t>(out[1] | v << 4),
                        out[2] = static_cast<std::uint8_t>(v >> 4), out += 3;
                    break;
                default:
                    *out++ = static_cast<std::uint8_t>(v), *out++ = static_cast<std::uint8_t>(v >> 8);
            }
        }
    }
    if (have > 0) *out = static_cast<std::uint8_t>(acc << (8 - have));
}

inline void pattern_fill(const Format& f, std::uint32_t frame, std::uint8_t* out) {
    format_fill(f, out, [frame](int x, int y) { return pattern(frame, x, y); });
}

// How many samples differ from the pattern. *frame becomes the frame's number modulo 2^bits (2^10 for inzi),
// as the first sample tells it; of a u16 plane that follows, as its own first sample does, modulo that.
inline std::size_t pattern_mismatches(const Format& f, const std::uint8_t* data, std::uint32_t* frame,
                                      std::size_t stride = 0) {
    const std::size_t n = static_cast<std::size_t>(f.columns) * f.rows;
    std::size_t wrong = 0;
    std::uint32_t number = *frame = format_sample(f, data, 0, stride);
    for (std::size_t i = 0; i < n; ++i) {
        const auto x = static_cast<std::uint32_t>(i % f.columns),
                   y = static_cast<std::uint32_t>(i / f.columns);
        if (f.layout == Layout::inzi && i == n / 2) {
            number = format_sample(f, data, i, stride) - pattern_offset(0, y);
            if ((number & 1023) != *frame) ++wrong;
        }
        if (format_sample(f, data, i, stride) != (pattern(number, x, y) & format_mask(f, i))) ++wrong;
    }
    return wrong;
}

// Colour as JPEG loses detail, so it is blocks of 16 x 16 of one grey; a decoder is within 3 of it.
inline std::uint8_t pattern_jpeg_grey(std::uint32_t frame, std::uint32_t x, std::uint32_t y) {
    return static_cast<std::uint8_t>(32 + (8 * (frame % 24) + 23 * (x / 16) + 41 * (y / 16)) % 192);
}

}  // namespace rig
