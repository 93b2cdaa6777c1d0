// SPDX-License-Identifier: MIT
// band_boxes.h, a piece of the view a lane.
#include "simd/band_boxes.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/band_boxes_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"
#include "simd/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

void BandBoxes(const BandView& view, const float* u, const float* v, const std::uint32_t* ranges, int count,
               ChunkBox* boxes) {
    scalar::band_boxes(view, u, v, ranges, count, boxes);
}

#else

void BandBoxes(const BandView& view, const float* HWY_RESTRICT u, const float* HWY_RESTRICT v,
               const std::uint32_t* HWY_RESTRICT ranges, int count, ChunkBox* HWY_RESTRICT boxes) {
    const DF df;
    const DI di;
    const DU du;
    const TruncationModel& t = view.truncation;
    const auto zero = hn::Zero(df), most = hn::Set(df, 65535.0f), unit = hn::Set(df, view.unit_m);
    for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(df))) {
        const auto range = hn::LoadU(du, ranges + i);
        const auto metres = [&](auto raw) { return hn::Mul(hn::ConvertTo(df, hn::BitCast(di, raw)), unit); };
        const auto least_m = metres(hn::And(range, hn::Set(du, 0xffff))),
                   largest_m = metres(hn::ShiftRight<16>(range));
        auto tau = hn::Set(df, t.truncation_m);
        if (t.quadratic) {
            const auto noise =
                hn::Add(hn::Mul(hn::Add(hn::Mul(hn::Set(df, t.a), largest_m), hn::Set(df, t.b)), largest_m),
                        hn::Set(df, t.c));
            tau = hn::Max(hn::Set(df, t.floor_m), noise);
        }
        const auto near = hn::Max(hn::Sub(least_m, tau), zero), far = hn::Add(largest_m, tau);
        const auto at_u = hn::LoadU(df, u + i), at_v = hn::LoadU(df, v + i);
        // No arrays of vectors: those of SVE have no size known to the compiler.
        const auto box = [&](int r, hn::Vec<DU>* low, hn::Vec<DU>* high) HWY_ATTR {
            const auto slope = hn::Add(hn::Add(hn::Mul(hn::Set(df, view.slope_u[r]), at_u),
                                               hn::Mul(hn::Set(df, view.slope_v[r]), at_v)),
                                       hn::Set(df, view.slope_1[r]));
            const auto half = hn::Set(df, view.half_slope[r]);
            const auto left = hn::Sub(slope, half), right = hn::Add(slope, half);
            const auto from =
                hn::Add(hn::Min(hn::Mul(near, left), hn::Mul(far, left)), hn::Set(df, view.start_low[r]));
            const auto to =
                hn::Add(hn::Max(hn::Mul(near, right), hn::Mul(far, right)), hn::Set(df, view.start_high[r]));
            *low = hn::BitCast(du, hn::ConvertTo(di, hn::Min(hn::Max(from, zero), most)));
            *high = hn::BitCast(du, hn::ConvertTo(di, hn::Min(hn::Max(to, zero), most)));
        };
        hn::Vec<DU> low_0, low_1, low_2, high_0, high_1, high_2;
        box(0, &low_0, &high_0);
        box(1, &low_1, &high_1);
        box(2, &low_2, &high_2);
        const auto deep = hn::RebindMask(du, hn::Gt(hn::Sub(largest_m, least_m), hn::Set(df, view.deep_m)));
        auto kind = hn::IfThenElse(deep, hn::Set(du, ChunkBox::kDeep), hn::Set(du, ChunkBox::kBox));
        kind = hn::IfThenZeroElse(hn::Eq(range, hn::Zero(du)), kind);
        hn::StoreInterleaved4(hn::Or(low_0, hn::ShiftLeft<16>(low_1)), hn::Or(low_2, hn::ShiftLeft<16>(kind)),
                              hn::Or(high_0, hn::ShiftLeft<16>(high_1)), high_2, du,
                              reinterpret_cast<std::uint32_t*>(boxes + i));
    }
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(BandBoxes);

void band_boxes(const BandView& view, const float* u, const float* v, const std::uint32_t* ranges, int count,
                ChunkBox* boxes) {
    if (scalar_selected()) return scalar::band_boxes(view, u, v, ranges, count, boxes);
    BURIN_DISPATCH(BandBoxes)(view, u, v, ranges, count, boxes);
}

}  // namespace burin::simd
#endif
