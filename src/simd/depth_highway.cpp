// SPDX-License-Identifier: MIT
// The kernels of depth.h, many pixels at a time; what is left of a row goes to the specification.
#include <algorithm>
#include <cstring>

#include "simd/depth.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/depth_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

void KeepInRange(const std::uint16_t* in, int count, RawRange range, std::uint16_t* out) {
    scalar::keep_in_range(in, count, range, out);
}
void ConvertU16(const std::uint16_t* in, int count, const DepthConversion& c, std::uint16_t* out) {
    scalar::convert_u16(in, count, c, out);
}
void ConvertF32(const float* in, int count, const DepthConversion& c, std::uint16_t* out) {
    scalar::convert_f32(in, count, c, out);
}
int TileRanges(const std::uint16_t* pixels, std::ptrdiff_t stride, int rows, int width, DepthRange* out) {
    return scalar::tile_ranges(pixels, stride, rows, width, out);
}

#else

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using DH = hn::Rebind<std::uint16_t, DF>;  // as many u16 as floats
// Whole vectors of u16, at most 32, also as ranges (u32) and as tiles (u64).
using D16 = hn::CappedTag<std::uint16_t, 32>;
using D32 = hn::Repartition<std::uint32_t, D16>;
using D64 = hn::Repartition<std::uint64_t, D16>;

void KeepInRange(const std::uint16_t* in, int count, RawRange range, std::uint16_t* out) {
    const D16 d;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const auto low = hn::Set(d, range.low), high = hn::Set(d, range.high);
    int i = 0;
    for (; i + lanes <= count; i += lanes) {
        const auto v = hn::LoadU(d, in + i);
        // As equality with the clamped value: not every target compares unsigned lanes by order. An empty
        // range is {1, 0}, which clamps everything to 0.
        hn::StoreU(hn::IfThenElseZero(hn::Eq(hn::Min(hn::Max(v, low), high), v), v), d, out + i);
    }
    scalar::keep_in_range(in + i, count - i, range, out + i);
}

// to_unit of depth.cpp.
struct ToUnit {
    explicit ToUnit(const DepthConversion& conversion) : c(conversion) {}
    HWY_INLINE hn::Vec<DI> operator()(hn::Vec<DF> metres) const {
        const DF df;
        const DI di;
        const auto in = hn::And(hn::Ge(metres, hn::Set(df, c.min_m)), hn::Le(metres, hn::Set(df, c.max_m)));
        const auto units =
            hn::Add(hn::Div(hn::IfThenElseZero(in, metres), hn::Set(df, c.unit_m)), hn::Set(df, 0.5f));
        const auto whole = hn::Min(hn::Max(hn::ConvertTo(di, units), hn::Set(di, 1)), hn::Set(di, 65534));
        return hn::IfThenElseZero(hn::RebindMask(di, in), whole);
    }
    const DepthConversion& c;  // no vectors as members: those of SVE have no size known to the compiler
};

void ConvertU16(const std::uint16_t* in, int count, const DepthConversion& c, std::uint16_t* out) {
    const DF df;
    const DI di;
    const DH dh;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const ToUnit to_unit(c);
    const auto scale = hn::Set(df, c.raw_to_m);
    const auto none = hn::Set(di, 65535);
    int i = 0;
    for (; i + lanes <= count; i += lanes) {
        auto raw = hn::PromoteTo(di, hn::LoadU(dh, in + i));
        raw = hn::IfThenZeroElse(hn::Eq(raw, none), raw);  // 0 m is below any range
        hn::StoreU(hn::DemoteTo(dh, to_unit(hn::Mul(hn::ConvertTo(df, raw), scale))), dh, out + i);
    }
    scalar::convert_u16(in + i, count - i, c, out + i);
}

void ConvertF32(const float* in, int count, const DepthConversion& c, std::uint16_t* out) {
    const DF df;
    const DH dh;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const ToUnit to_unit(c);
    const auto scale = hn::Set(df, c.raw_to_m);
    int i = 0;
    for (; i + lanes <= count; i += lanes)
        hn::StoreU(hn::DemoteTo(dh, to_unit(hn::Mul(hn::LoadU(df, in + i), scale))), dh, out + i);
    scalar::convert_f32(in + i, count - i, c, out + i);
}

// The maximum of each four u16 in the lowest of them. What the others hold is of no use.
HWY_INLINE hn::Vec<D16> MaxOfFours(hn::Vec<D16> v) {
    const D16 d16;
    const D64 d64;
    v = hn::Max(v, hn::BitCast(d16, hn::ShiftRight<32>(hn::BitCast(d64, v))));
    return hn::Max(v, hn::BitCast(d16, hn::ShiftRight<16>(hn::BitCast(d64, v))));
}

// Ranges of one vector of columns, each in the low half of its 64 bits. The least depth is found as the
// largest of -d: modulo 2^16 "no depth" is 0 there too and loses. `zeros` counts pixels without depth.
HWY_INLINE hn::Vec<D32> ColumnsToTiles(const std::uint16_t* pixels, std::ptrdiff_t stride, int rows,
                                       hn::Vec<D16>* zeros) {
    const D16 d16;
    const D32 d32;
    const D64 d64;
    const auto zero = hn::Zero(d16);
    auto high = zero, low = zero;
    for (int y = 0; y < rows; ++y) {
        const auto v = hn::LoadU(d16, pixels + y * stride);
        high = hn::Max(high, v);
        low = hn::Max(low, hn::Sub(zero, v));
        *zeros = hn::Sub(*zeros, hn::VecFromMask(d16, hn::Eq(v, zero)));
    }
    const auto least = hn::Sub(zero, MaxOfFours(low)), largest = MaxOfFours(high);
    const auto low_half = hn::Set(d64, 0xffff);
    const auto pair = hn::Or(hn::And(hn::BitCast(d64, least), low_half),
                             hn::ShiftLeft<16>(hn::And(hn::BitCast(d64, largest), low_half)));
    return hn::BitCast(d32, pair);
}

int TileRanges(const std::uint16_t* pixels, std::ptrdiff_t stride, int rows, int width, DepthRange* out) {
    const D16 d16;
    const D32 d32;
    const int lanes = static_cast<int>(hn::Lanes(d16));
    auto* packed = reinterpret_cast<std::uint32_t*>(out);
    auto zeros = hn::Zero(d16);  // at most 4 rows * 16384 / 8 a lane
    const auto two = [&](const std::uint16_t* p, std::ptrdiff_t row, std::uint32_t* to) {
        const auto left = ColumnsToTiles(p, row, rows, &zeros),
                   right = ColumnsToTiles(p + lanes, row, rows, &zeros);
        hn::StoreU(hn::ConcatEven(d32, right, left), d32, to);
    };
    int x = 0, seen = 0;
    for (; x + 2 * lanes <= width; x += 2 * lanes) {
        two(pixels + x, stride, packed + x / kTileSide);
        seen += 2 * lanes * rows;
    }
    if (x < width) {  // the rest, filled up with "no depth"
        std::uint16_t rest[kTileSide][64] = {};
        std::uint32_t ranges[16];
        for (int y = 0; y < rows; ++y) std::copy_n(pixels + y * stride + x, width - x, rest[y]);
        two(rest[0], 64, ranges);
        seen += 2 * lanes * rows;
        std::copy_n(ranges, (width - x + kTileSide - 1) / kTileSide, packed + x / kTileSide);
    }
    alignas(64) std::uint16_t counts[32];
    hn::Store(zeros, d16, counts);
    for (int i = 0; i < lanes; ++i) seen -= counts[i];
    return seen;
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(KeepInRange);
HWY_EXPORT(ConvertU16);
HWY_EXPORT(ConvertF32);
HWY_EXPORT(TileRanges);

void keep_in_range(const std::uint16_t* in, int count, RawRange range, std::uint16_t* out) {
    if (scalar_selected()) return scalar::keep_in_range(in, count, range, out);
    BURIN_DISPATCH(KeepInRange)(in, count, range, out);
}

void convert_u16(const std::uint16_t* in, int count, const DepthConversion& c, std::uint16_t* out) {
    if (scalar_selected()) return scalar::convert_u16(in, count, c, out);
    BURIN_DISPATCH(ConvertU16)(in, count, c, out);
}

void convert_f32(const float* in, int count, const DepthConversion& c, std::uint16_t* out) {
    if (scalar_selected()) return scalar::convert_f32(in, count, c, out);
    BURIN_DISPATCH(ConvertF32)(in, count, c, out);
}

int tile_ranges(const std::uint16_t* pixels, std::ptrdiff_t stride, int rows, int width, DepthRange* out) {
    if (scalar_selected()) return scalar::tile_ranges(pixels, stride, rows, width, out);
    return BURIN_DISPATCH(TileRanges)(pixels, stride, rows, width, out);
}

}  // namespace burin::simd
#endif
