// SPDX-License-Identifier: MIT
// The kernels of mosaic.h; what vectors leave over goes to the specification.
#include <algorithm>

#include "simd/mosaic.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/mosaic_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"
#include "simd/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

int Yuv422ToRgb(Yuv422 order, const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* rgb) {
    return scalar::yuv422_to_rgb(order, in, bytes, count, rgb);
}
void DemosaicRow(const std::uint8_t* const rows[5], BayerRow first, int width, std::uint8_t* rgb) {
    scalar::demosaic_row(rows, first, width, rgb);
}

#else

namespace hn = hwy::HWY_NAMESPACE;
using DS16 = hn::Repartition<std::int16_t, DF>;  // two pixels a lane of 32 bits
using DU8 = hn::Rebind<std::uint8_t, DS16>;
using V16 = hn::Vec<DS16>;

// Fixed-point colours of the pixels of pairs, rounded down and clamped: 8 bits each, in order.
HWY_INLINE hn::Vec<DU8> Bytes(hn::Vec<DI> first, hn::Vec<DI> second) {
    const DI di;
    const DS16 d16;
    const auto limited = [&](hn::Vec<DI> v) {
        return hn::Min(hn::Max(hn::ShiftRight<16>(v), hn::Zero(di)), hn::Set(di, 255));
    };
    const auto both =
        hn::OddEven(hn::BitCast(d16, hn::ShiftLeft<16>(limited(second))), hn::BitCast(d16, limited(first)));
    return hn::DemoteTo(DU8(), both);
}

template <Yuv422 kOrder>
HWY_INLINE int Pairs(const std::uint8_t* in, int pairs, std::uint8_t* rgb) {
    const DI di;
    const DU du;
    const hn::Repartition<std::uint8_t, DF> bytes;
    const DU8 du8;
    const int lanes = static_cast<int>(hn::Lanes(di));
    const auto byte = hn::Set(di, 255), middle = hn::Set(di, 128);
    int k = 0;
    for (; k + lanes <= pairs; k += lanes) {
        const auto word = hn::BitCast(du, hn::LoadU(bytes, in + 4 * k));
        const auto b0 = hn::And(hn::BitCast(di, word), byte),
                   b1 = hn::And(hn::BitCast(di, hn::ShiftRight<8>(word)), byte),
                   b2 = hn::And(hn::BitCast(di, hn::ShiftRight<16>(word)), byte),
                   b3 = hn::BitCast(di, hn::ShiftRight<24>(word));
        constexpr bool kLumaFirst = kOrder == Yuv422::yuyv;
        const auto luma = [&](hn::Vec<DI> y) {
            return hn::Add(hn::Mul(y, hn::Set(di, 76309)), hn::Set(di, 32768 - 16 * 76309));
        };
        const auto y0 = luma(kLumaFirst ? b0 : b1), y1 = luma(kLumaFirst ? b2 : b3);
        const auto u = hn::Sub(kLumaFirst ? b1 : b0, middle), v = hn::Sub(kLumaFirst ? b3 : b2, middle);
        const auto red = hn::Mul(v, hn::Set(di, 104597)), blue = hn::Mul(u, hn::Set(di, 132201));
        const auto green = hn::Add(hn::Mul(u, hn::Set(di, -25675)), hn::Mul(v, hn::Set(di, -53279)));
        hn::StoreInterleaved3(Bytes(hn::Add(y0, red), hn::Add(y1, red)),
                              Bytes(hn::Add(y0, green), hn::Add(y1, green)),
                              Bytes(hn::Add(y0, blue), hn::Add(y1, blue)), du8, rgb + 6 * k);
    }
    return k;
}

int Yuv422ToRgb(Yuv422 order, const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* rgb) {
    const int n = static_cast<int>(std::min(static_cast<std::size_t>(count), bytes / 4 * 2));
    const int pairs =
        order == Yuv422::yuyv ? Pairs<Yuv422::yuyv>(in, n / 2, rgb) : Pairs<Yuv422::uyvy>(in, n / 2, rgb);
    scalar::yuv422_to_rgb(order, in + 4 * pairs, bytes - 4 * static_cast<std::size_t>(pairs), n - 2 * pairs,
                          rgb + 6 * pairs);
    return n;
}

template <bool kRedRow, bool kGreenFirst>
HWY_INLINE int Mosaic(const std::uint8_t* const rows[5], int width, std::uint8_t* rgb) {
    const DS16 d16;
    const DU8 du8;
    const int lanes = static_cast<int>(hn::Lanes(d16));
    const std::uint8_t *n2 = rows[0], *n = rows[1], *c = rows[2], *s = rows[3], *s2 = rows[4];
    const auto load = [&](const std::uint8_t* from) { return hn::PromoteTo(d16, hn::LoadU(du8, from)); };
    const auto half = hn::Set(d16, 8);
    const auto sixteenths = [&](V16 sum) { return hn::DemoteTo(du8, hn::ShiftRight<4>(hn::Add(sum, half))); };
    const auto twice = [](V16 v) { return hn::Add(v, v); };
    int x = 0;
    for (; x + lanes <= width; x += lanes) {
        const auto centre = load(c + x);
        const auto beside = hn::Add(load(c + x - 1), load(c + x + 1)),
                   beside2 = hn::Add(load(c + x - 2), load(c + x + 2));
        const auto along = hn::Add(load(n + x), load(s + x)), along2 = hn::Add(load(n2 + x), load(s2 + x));
        const auto diagonal =
            hn::Add(hn::Add(load(n + x - 1), load(n + x + 1)), hn::Add(load(s + x - 1), load(s + x + 1)));
        // At green: 10 C - 2 diagonal and what comes to it. At most 7140, at least -3060.
        const auto common = hn::Sub(hn::Add(hn::ShiftLeft<3>(centre), twice(centre)), twice(diagonal));
        const auto own_green =
            hn::Add(hn::Add(common, hn::ShiftLeft<3>(beside)), hn::Sub(along2, twice(beside2)));
        const auto other_green =
            hn::Add(hn::Add(common, hn::ShiftLeft<3>(along)), hn::Sub(beside2, twice(along2)));
        const auto far = hn::Add(beside2, along2);
        const auto eight = hn::ShiftLeft<3>(centre);
        const auto green = hn::Sub(hn::Add(eight, hn::ShiftLeft<2>(hn::Add(beside, along))), twice(far));
        const auto other =
            hn::Sub(hn::Add(hn::Add(eight, hn::ShiftLeft<2>(centre)), hn::ShiftLeft<2>(diagonal)),
                    hn::Add(far, twice(far)));
        const auto whole = hn::ShiftLeft<4>(centre);
        // OddEven: the first of two arguments in odd columns.
        const auto choose = [&](V16 at_green, V16 at_colour) {
            return sixteenths(kGreenFirst ? hn::OddEven(at_colour, at_green)
                                          : hn::OddEven(at_green, at_colour));
        };
        const auto own8 = choose(own_green, whole), green8 = choose(whole, green),
                   other8 = choose(other_green, other);
        hn::StoreInterleaved3(kRedRow ? own8 : other8, green8, kRedRow ? other8 : own8, du8, rgb + 3 * x);
    }
    return x;
}

void DemosaicRow(const std::uint8_t* const rows[5], BayerRow first, int width, std::uint8_t* rgb) {
    const int x = first == BayerRow::rg   ? Mosaic<true, false>(rows, width, rgb)
                  : first == BayerRow::gr ? Mosaic<true, true>(rows, width, rgb)
                  : first == BayerRow::gb ? Mosaic<false, true>(rows, width, rgb)
                                          : Mosaic<false, false>(rows, width, rgb);
    const std::uint8_t* const rest[5] = {rows[0] + x, rows[1] + x, rows[2] + x, rows[3] + x, rows[4] + x};
    scalar::demosaic_row(rest, first, width - x, rgb + 3 * x);  // x is even: the colours stay
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(Yuv422ToRgb);
HWY_EXPORT(DemosaicRow);

int yuv422_to_rgb(Yuv422 order, const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* rgb) {
    if (scalar_selected()) return scalar::yuv422_to_rgb(order, in, bytes, count, rgb);
    return BURIN_DISPATCH(Yuv422ToRgb)(order, in, bytes, count, rgb);
}

void demosaic_row(const std::uint8_t* const rows[5], BayerRow first, int width, std::uint8_t* rgb) {
    if (scalar_selected()) return scalar::demosaic_row(rows, first, width, rgb);
    BURIN_DISPATCH(DemosaicRow)(rows, first, width, rgb);
}

}  // namespace burin::simd
#endif
