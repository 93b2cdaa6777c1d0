// SPDX-License-Identifier: MIT
// The kernels of sample.h, up to 16 points at a time: the same operations in the same order a lane.
#include <algorithm>
#include <limits>

#include "simd/sample.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/sample_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

void LocateCells(const LatticeMap& map, const float* x, const float* y, const float* z, int count,
                 Cells* cells) {
    scalar::locate_cells(map, x, y, z, count, cells);
}
void InterpolateCells(const Corners& corners, const float (*t)[kSampleBatch], int count, SampleScale scale,
                      float* distances, float (*gradients)[kSampleBatch]) {
    scalar::interpolate_cells(corners, t, count, scale, distances, gradients);
}

#else

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using DU = hn::RebindToUnsigned<DF>;
using DH = hn::Repartition<std::uint16_t, DU>;
using VF = hn::Vec<DF>;

void LocateCells(const LatticeMap& map, const float* x, const float* y, const float* z, int count,
                 Cells* cells) {
    const DF df;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto limit = hn::Set(df, kLatticeLimit), zero = hn::Zero(df);
    for (int i = 0; i < count; i += lanes) {
        VF px, py, pz;
        if (i + lanes <= count) {
            px = hn::LoadU(df, x + i);
            py = hn::LoadU(df, y + i);
            pz = hn::LoadU(df, z + i);
        } else {
            alignas(64) float rest[3][16] = {};
            std::copy_n(x + i, count - i, rest[0]);
            std::copy_n(y + i, count - i, rest[1]);
            std::copy_n(z + i, count - i, rest[2]);
            px = hn::Load(df, rest[0]);
            py = hn::Load(df, rest[1]);
            pz = hn::Load(df, rest[2]);
        }
        auto inside = hn::Eq(zero, zero);
        hn::Vec<DI> v0 = hn::Zero(di);
        for (int k = 2; k >= 0; --k) {
            const float* m = map.m + 3 * k;
            const auto sum = hn::Add(hn::Add(hn::Mul(hn::Set(df, m[0]), px), hn::Mul(hn::Set(df, m[1]), py)),
                                     hn::Mul(hn::Set(df, m[2]), pz));
            const auto at = hn::Add(sum, hn::Set(df, map.offset[k]));
            const auto near = hn::And(hn::Gt(at, hn::Neg(limit)), hn::Lt(at, limit));
            inside = hn::And(inside, near);
            const auto v = hn::IfThenElseZero(near, at);
            auto floor = hn::ConvertTo(di, v);
            const auto above = hn::RebindMask(di, hn::Gt(hn::ConvertTo(df, floor), v));
            floor = hn::Add(floor, hn::VecFromMask(di, above));  // -1 where truncation went up
            hn::Store(hn::Sub(v, hn::ConvertTo(df, floor)), df, cells->t[k] + i);
            hn::Store(floor, di, cells->v[k] + i);
            v0 = floor;
        }
        hn::Store(hn::IfThenElse(hn::RebindMask(di, inside), v0, hn::Set(di, kNoCell)), di, cells->v[0] + i);
    }
}

HWY_INLINE VF Mix(VF a, VF b, VF t) { return hn::Add(a, hn::Mul(t, hn::Sub(b, a))); }

void InterpolateCells(const Corners& corners, const float (*t)[kSampleBatch], int count, SampleScale scale,
                      float* distances, float (*gradients)[kSampleBatch]) {
    const DF df;
    const DI di;
    const DU du;
    const DH dh;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto none = hn::Set(df, std::numeric_limits<float>::quiet_NaN());
    const auto distance_scale = hn::Set(df, scale.distance), gradient_scale = hn::Set(df, scale.gradient);
    for (int i = 0; i < count; i += lanes) {
        // The least of the four rows' weights, both halves at once; then both halves must be above 0.
        const auto weight = [&](int row) { return hn::BitCast(dh, hn::Load(du, corners.weight[row] + i)); };
        const auto least =
            hn::BitCast(du, hn::Min(hn::Min(weight(0), weight(1)), hn::Min(weight(2), weight(3))));
        const auto unknown =
            hn::RebindMask(df, hn::Or(hn::Eq(hn::And(least, hn::Set(du, 0xffffu)), hn::Zero(du)),
                                      hn::Eq(hn::ShiftRight<16>(least), hn::Zero(du))));
        const auto result = [&](VF value) { return hn::IfThenElse(unknown, none, value); };

        const auto row = [&](int k) { return hn::BitCast(di, hn::Load(du, corners.sdf[k] + i)); };
        const auto low = [&](hn::Vec<DI> v) {
            return hn::ConvertTo(df, hn::ShiftRight<16>(hn::ShiftLeft<16>(v)));
        };
        const auto high = [&](hn::Vec<DI> v) { return hn::ConvertTo(df, hn::ShiftRight<16>(v)); };
        const auto r0 = row(0), r1 = row(1), r2 = row(2), r3 = row(3);
        const auto d0 = low(r0), d1 = high(r0), d2 = low(r1), d3 = high(r1), d4 = low(r2), d5 = high(r2),
                   d6 = low(r3), d7 = high(r3);
        const auto x = hn::LoadU(df, t[0] + i), y = hn::LoadU(df, t[1] + i), z = hn::LoadU(df, t[2] + i);
        const auto y0 = Mix(Mix(d0, d1, x), Mix(d2, d3, x), y);
        const auto y1 = Mix(Mix(d4, d5, x), Mix(d6, d7, x), y);
        hn::StoreU(result(hn::Mul(distance_scale, Mix(y0, y1, z))), df, distances + i);
        if (!gradients) continue;
        const auto gx =
            Mix(Mix(hn::Sub(d1, d0), hn::Sub(d3, d2), y), Mix(hn::Sub(d5, d4), hn::Sub(d7, d6), y), z);
        const auto gy =
            Mix(Mix(hn::Sub(d2, d0), hn::Sub(d3, d1), x), Mix(hn::Sub(d6, d4), hn::Sub(d7, d5), x), z);
        hn::StoreU(result(hn::Mul(gradient_scale, gx)), df, gradients[0] + i);
        hn::StoreU(result(hn::Mul(gradient_scale, gy)), df, gradients[1] + i);
        hn::StoreU(result(hn::Mul(gradient_scale, hn::Sub(y1, y0))), df, gradients[2] + i);
    }
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(LocateCells);
HWY_EXPORT(InterpolateCells);

void locate_cells(const LatticeMap& map, const float* x, const float* y, const float* z, int count,
                  Cells* cells) {
    if (scalar_selected()) return scalar::locate_cells(map, x, y, z, count, cells);
    BURIN_DISPATCH(LocateCells)(map, x, y, z, count, cells);
}

void interpolate_cells(const Corners& corners, const float (*t)[kSampleBatch], int count, SampleScale scale,
                       float* distances, float (*gradients)[kSampleBatch]) {
    if (scalar_selected()) return scalar::interpolate_cells(corners, t, count, scale, distances, gradients);
    BURIN_DISPATCH(InterpolateCells)(corners, t, count, scale, distances, gradients);
}

}  // namespace burin::simd
#endif
