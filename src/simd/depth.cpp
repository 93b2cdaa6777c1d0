// SPDX-License-Identifier: MIT
#include "simd/depth.h"

#include <algorithm>

namespace burin::simd {
namespace {

inline std::uint16_t to_unit(float metres, const DepthConversion& c) {
    if (!(metres >= c.min_m && metres <= c.max_m)) return 0;  // NaN fails too
    return static_cast<std::uint16_t>(std::clamp(static_cast<int>(metres / c.unit_m + 0.5f), 1, 65534));
}

inline DepthRange joined(DepthRange a, DepthRange b) {
    if (a.largest == 0) return b;
    if (b.largest == 0) return a;
    return {std::min(a.least, b.least), std::max(a.largest, b.largest)};
}

// The least of 1..65535 for which `above` holds; it holds from there on.
template <class Predicate>
int first_that(Predicate&& above) {
    int low = 1, high = 65535;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (above(middle))
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

}  // namespace

RawRange raw_range(const DepthConversion& c) {
    const auto metres = [&](int raw) { return static_cast<float>(raw) * c.raw_to_m; };
    const int low = first_that([&](int raw) { return metres(raw) >= c.min_m; });
    const int high = first_that([&](int raw) { return metres(raw) > c.max_m; }) - 1;
    if (low > std::min(high, 65534) || !(metres(low) <= c.max_m)) return {1, 0};
    return {static_cast<std::uint16_t>(low), static_cast<std::uint16_t>(std::min(high, 65534))};
}

namespace scalar {

void keep_in_range(const std::uint16_t* in, int count, RawRange range, std::uint16_t* out) {
    for (int i = 0; i < count; ++i)
        out[i] = in[i] >= range.low && in[i] <= range.high ? in[i] : std::uint16_t{0};
}

void convert_u16(const std::uint16_t* in, int count, const DepthConversion& c, std::uint16_t* out) {
    for (int i = 0; i < count; ++i)
        out[i] = in[i] == 0 || in[i] == 65535 ? std::uint16_t{0}
                                              : to_unit(static_cast<float>(in[i]) * c.raw_to_m, c);
}

void convert_f32(const float* in, int count, const DepthConversion& c, std::uint16_t* out) {
    for (int i = 0; i < count; ++i) out[i] = to_unit(in[i] * c.raw_to_m, c);
}

int tile_ranges(const std::uint16_t* pixels, std::ptrdiff_t stride, int rows, int width, DepthRange* out) {
    int valid = 0;
    for (int x0 = 0; x0 < width; x0 += kTileSide) {
        DepthRange range{0, 0};
        for (int y = 0; y < rows; ++y)
            for (int x = x0; x < std::min(x0 + kTileSide, width); ++x) {
                const std::uint16_t d = pixels[y * stride + x];
                range = joined(range, {d, d});
                valid += d != 0;
            }
        *out++ = range;
    }
    return valid;
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
void keep_in_range(const std::uint16_t* in, int count, RawRange range, std::uint16_t* out) {
    scalar::keep_in_range(in, count, range, out);
}
void convert_u16(const std::uint16_t* in, int count, const DepthConversion& c, std::uint16_t* out) {
    scalar::convert_u16(in, count, c, out);
}
void convert_f32(const float* in, int count, const DepthConversion& c, std::uint16_t* out) {
    scalar::convert_f32(in, count, c, out);
}
int tile_ranges(const std::uint16_t* pixels, std::ptrdiff_t stride, int rows, int width, DepthRange* out) {
    return scalar::tile_ranges(pixels, stride, rows, width, out);
}
#endif

}  // namespace burin::simd
