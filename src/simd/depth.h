// SPDX-License-Identifier: MIT
// Kernels of the depth stage: readings of a sensor to 16-bit depth within a range, and least and largest
// depth over tiles.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin::simd {

// What counts as depth, and in which unit. 0 < min_m <= max_m, and max_m / unit_m <= 65534.
struct DepthConversion {
    float min_m, max_m;
    float raw_to_m;  // metres = reading * raw_to_m
    float unit_m;    // of the result
};

// Readings of 16 bits that keep their unit are in range if and only if they lie in these bounds: a product
// with a positive number, rounded or not, is monotone. 0 and 65535 mean "no depth" and are always out; low >
// high when nothing is in.
struct RawRange {
    std::uint16_t low, high;
};
RawRange raw_range(const DepthConversion& c);

// out[i] = in[i] when low <= in[i] <= high, else 0.
void keep_in_range(const std::uint16_t* in, int count, RawRange range, std::uint16_t* out);

// m = in[i] * raw_to_m; out[i] = clamp(floor(m / unit_m + 1/2), 1, 65534) when min_m <= m <= max_m, else 0.
// NaN is out of range; of the 16-bit readings so are 0 and 65535.
void convert_u16(const std::uint16_t* in, int count, const DepthConversion& c, std::uint16_t* out);
void convert_f32(const float* in, int count, const DepthConversion& c, std::uint16_t* out);

// Least and largest valid depth of a square of pixels; both 0 when none is valid.
struct DepthRange {
    std::uint16_t least, largest;
    friend bool operator==(const DepthRange&, const DepthRange&) = default;
};

inline constexpr int kTileSide = 4;  // pixels

// One row of tiles: `rows` (1..4) rows of `width` pixels, the first at `pixels`, to (width + 3) / 4 ranges.
// Returns how many pixels are not 0. width <= 16384.
int tile_ranges(const std::uint16_t* pixels, std::ptrdiff_t stride, int rows, int width, DepthRange* out);

// What the functions above specify, one lane at a time.
namespace scalar {
void keep_in_range(const std::uint16_t* in, int count, RawRange range, std::uint16_t* out);
void convert_u16(const std::uint16_t* in, int count, const DepthConversion& c, std::uint16_t* out);
void convert_f32(const float* in, int count, const DepthConversion& c, std::uint16_t* out);
int tile_ranges(const std::uint16_t* pixels, std::ptrdiff_t stride, int rows, int width, DepthRange* out);
}  // namespace scalar

}  // namespace burin::simd
