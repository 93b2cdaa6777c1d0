// SPDX-License-Identifier: MIT
#include "capture/raw_image.h"

#include <algorithm>

namespace burin {
namespace {

// Calls body(bytes, how many, y) for every row that begins within the bytes; it returns the pixels it found.
// Sets the others to 0 through clear(y, first pixel).
template <class Body, class Clear>
std::size_t each_row(const RawBytes& raw, std::size_t tight, int width, int height, Body&& body,
                     Clear&& clear) {
    const std::size_t stride = raw.stride ? raw.stride : tight;
    std::size_t pixels = 0;
    for (int y = 0; y < height; ++y) {
        const std::size_t start = static_cast<std::size_t>(y) * stride;
        // What lies behind a row within the bytes may be read: kernels load whole vectors.
        const std::size_t bytes = start < raw.size ? raw.size - start : 0;
        const int found = bytes ? body(raw.data + start, bytes, y) : 0;
        if (found < width) clear(y, found);
        pixels += static_cast<std::size_t>(found);
    }
    return pixels;
}

template <class T>
void clear_row(View<T> image, int y, int first) {
    T* row = image.row(y);
    std::fill(row + static_cast<std::ptrdiff_t>(first) * image.channels,
              row + static_cast<std::ptrdiff_t>(image.width) * image.channels, T{0});
}

// Two images of one size out of rows of `pixel_bytes` bytes for a pixel of each.
template <class T, class Split>
std::size_t split_image(const RawBytes& raw, std::size_t pixel_bytes, View<T> left, View<T> right,
                        Split&& split) {
    return each_row(
        raw, pixel_bytes * static_cast<std::size_t>(left.width), left.width, left.height,
        [&](const std::uint8_t* in, std::size_t bytes, int y) {
            return split(in, bytes, left.width, left.row(y), right.row(y));
        },
        [&](int y, int first) {
            clear_row(left, y, first);
            clear_row(right, y, first);
        });
}

int unpack_row(simd::Packing packing, const std::uint8_t* in, std::size_t bytes, int count,
               const DepthTable& table, std::uint16_t* out) {
    return table.values ? simd::unpack_table(packing, in, bytes, count, table.values, table.entries, out)
                        : simd::unpack(packing, in, bytes, count, out);
}

}  // namespace

std::size_t unpack_image(simd::Packing packing, const RawBytes& raw, const DepthTable& table,
                         View<std::uint16_t> out) {
    const auto width = static_cast<std::size_t>(out.width);
    const simd::PackedGroup group = simd::packed_group(packing);
    const auto group_pixels = static_cast<std::size_t>(group.pixels);
    const std::size_t tight = simd::packed_bytes(packing, width);
    const auto height = static_cast<std::size_t>(out.height);
    if (width % group_pixels == 0 && (raw.stride == 0 || raw.stride == tight) && out.stride == out.width) {
        const int all = static_cast<int>(width * height);
        const int found = unpack_row(packing, raw.data, raw.size, all, table, out.data);
        std::fill(out.data + found, out.data + all, std::uint16_t{0});
        return static_cast<std::size_t>(found);
    }
    if (raw.stride != 0 || group.whole || width % group_pixels == 0)
        return each_row(
            raw, tight, out.width, out.height,
            [&](const std::uint8_t* in, std::size_t bytes, int y) {
                return unpack_row(packing, in, bytes, out.width, table, out.row(y));
            },
            [&](int y, int first) { clear_row(out, y, first); });
    // A run of bits whose rows begin inside a byte: from the whole group before.
    std::size_t pixels = 0;
    for (int y = 0; y < out.height; ++y) {
        int found = 0;
        while (found < out.width) {
            const std::size_t first = static_cast<std::size_t>(y) * width + static_cast<std::size_t>(found);
            const std::size_t start = first / group_pixels * static_cast<std::size_t>(group.bytes);
            const int skip = static_cast<int>(first % group_pixels);
            if (start >= raw.size) break;
            std::uint16_t some[256];
            const int want = std::min(256, skip + out.width - found);
            const int got = unpack_row(packing, raw.data + start, raw.size - start, want, table, some) - skip;
            if (got <= 0) break;
            std::copy_n(some + skip, got, out.row(y) + found);
            found += got;
            if (got + skip < want) break;
        }
        if (found < out.width) clear_row(out, y, found);
        pixels += static_cast<std::size_t>(found);
    }
    return pixels;
}

std::size_t unpack_inzi(const RawBytes& raw, View<std::uint16_t> infrared, View<std::uint16_t> depth) {
    const std::size_t stride = raw.stride ? raw.stride : 2 * static_cast<std::size_t>(infrared.width);
    const std::size_t plane = stride * static_cast<std::size_t>(infrared.height);
    const std::size_t first = std::min(plane, raw.size);
    unpack_image(simd::Packing::le16, {raw.data, first, stride}, {}, infrared);
    // Depth is what the caller waits for: its number of pixels is the smaller one.
    return unpack_image(simd::Packing::le16, {raw.data + first, raw.size - first, stride}, {}, depth);
}

std::size_t unpack_y8i(const RawBytes& raw, View<std::uint8_t> left, View<std::uint8_t> right) {
    return split_image(raw, 2, left, right, simd::split_y8i);
}

std::size_t unpack_y12i(const RawBytes& raw, View<std::uint16_t> left, View<std::uint16_t> right) {
    return split_image(raw, 3, left, right, simd::split_y12i);
}

std::size_t unpack_y16i(const RawBytes& raw, View<std::uint16_t> left, View<std::uint16_t> right) {
    return split_image(raw, 4, left, right, simd::split_y16i);
}

std::size_t unpack_confidence(const RawBytes& raw, View<std::uint8_t> out) {
    return each_row(
        raw, (static_cast<std::size_t>(out.width) + 1) / 2, out.width, out.height,
        [&](const std::uint8_t* in, std::size_t bytes, int y) {
            return simd::unpack_nibbles(in, bytes, out.width, out.row(y));
        },
        [&](int y, int first) { clear_row(out, y, first); });
}

std::size_t unpack_yuv422(simd::Yuv422 order, const RawBytes& raw, View<std::uint8_t> rgb) {
    return each_row(
        raw, (static_cast<std::size_t>(rgb.width) + 1) / 2 * 4, rgb.width, rgb.height,
        [&](const std::uint8_t* in, std::size_t bytes, int y) {
            return simd::yuv422_to_rgb(order, in, bytes, rgb.width, rgb.row(y));
        },
        [&](int y, int first) { clear_row(rgb, y, first); });
}

}  // namespace burin
