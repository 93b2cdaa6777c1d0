// SPDX-License-Identifier: MIT
// The kernels of depth_filters.h, up to 16 pixels at a time: the same operations in the same order a lane.
// What the specification skips gets weight 0 here, which adds nothing. The last vector of a row reads past
// its end and stores only what belongs to the row, since other threads write the rows beside.
#include <algorithm>

#include "simd/depth_filters.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/depth_filters_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

void BilateralRow(const DepthRow& in, int above, int below, std::uint16_t* out) {
    scalar::bilateral_row(in, above, below, out);
}
void RemoveEdgesRow(const DepthRow& in, std::uint16_t* out) { scalar::remove_edges_row(in, out); }
void NormalsRow(const DepthRow& in, const RayModel& rays, int y, float* normals) {
    scalar::normals_row(in, rays, y, normals);
}
void WeightsRow(const DepthRow& in, const RayModel& rays, int y, const WeightModel& model,
                std::uint16_t* weights) {
    scalar::weights_row(in, rays, y, model, weights);
}

#else

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using DH = hn::Rebind<std::uint16_t, DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using MI = hn::Mask<DI>;
static_assert(kOverread >= 16 + 2);

HWY_INLINE VI Depths(const std::uint16_t* p) { return hn::PromoteTo(DI(), hn::LoadU(DH(), p)); }

// values[0..lanes) to out[0..count).
HWY_INLINE void StoreFirst(VI values, std::uint16_t* out, int count) {
    const DH dh;
    const auto narrow = hn::DemoteTo(dh, values);
    if (count >= static_cast<int>(hn::Lanes(dh))) {
        hn::StoreU(narrow, dh, out);
        return;
    }
    alignas(32) std::uint16_t all[16];
    hn::Store(narrow, dh, all);
    std::copy_n(all, count, out);
}

HWY_INLINE MI AcrossJump(VI a, VI b) {
    const DF df;
    const auto difference = hn::ConvertTo(df, hn::Abs(hn::Sub(a, b)));
    const auto limit = hn::Mul(hn::Set(df, kJump), hn::ConvertTo(df, hn::Min(a, b)));
    return hn::RebindMask(DI(), hn::Gt(difference, limit));
}

void BilateralRow(const DepthRow& in, int above, int below, std::uint16_t* out) {
    const DF df;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto zero_i = hn::Zero(di);
    const auto zero = hn::Zero(df), one = hn::Set(df, 1.0f), two = hn::Set(df, 2.0f),
               three = hn::Set(df, 3.0f), unit = hn::Set(df, in.unit_m);
    for (int x = 0; x < in.width; x += lanes) {
        const std::uint16_t* p = in.pixels + x;
        const auto centre = Depths(p);
        const auto there = hn::Ne(centre, zero_i);
        if (hn::AllFalse(di, there)) {
            StoreFirst(zero_i, out + x, in.width - x);
            continue;
        }
        const auto from_04 = hn::Sub(hn::Mul(hn::ConvertTo(df, centre), unit), hn::Set(df, 0.4f));
        const auto noise =
            hn::Add(hn::Set(df, 0.0012f), hn::Mul(hn::Mul(hn::Set(df, 0.0019f), from_04), from_04));
        const auto sigma = hn::Div(hn::Mul(three, noise), unit);
        const auto inverse = hn::Div(hn::Set(df, 0.125f), hn::Mul(hn::Mul(two, sigma), sigma));
        auto sum = zero, total = zero;
        for (int dy = -above; dy <= below; ++dy)
            for (int dx = -2; dx <= 2; ++dx) {
                const auto value = Depths(p + dy * in.stride + dx);
                const auto d = hn::ConvertTo(df, hn::Sub(value, centre));
                auto w = hn::Max(hn::Sub(one, hn::Mul(hn::Mul(d, d), inverse)), zero);
                w = hn::Mul(w, w);
                w = hn::Mul(w, w);
                w = hn::Mul(hn::Mul(w, w), hn::Set(df, kBilateralSpatial[dx * dx + dy * dy]));
                w = hn::IfThenElseZero(hn::RebindMask(df, hn::Ne(value, zero_i)), w);
                sum = hn::Add(sum, hn::Mul(w, d));
                total = hn::Add(total, w);
            }
        // Lanes without depth divide by 1: what they hold is dropped, but must be a number.
        const auto step = hn::NearestInt(hn::Div(sum, hn::IfThenElse(hn::RebindMask(df, there), total, one)));
        const auto result = hn::Min(hn::Max(hn::Add(centre, step), hn::Set(di, 1)), hn::Set(di, 65534));
        StoreFirst(hn::IfThenElseZero(there, result), out + x, in.width - x);
    }
}

void RemoveEdgesRow(const DepthRow& in, std::uint16_t* out) {
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(di));
    for (int x = 0; x < in.width; x += lanes) {
        const std::uint16_t* p = in.pixels + x;
        const auto centre = Depths(p);
        const auto edge = [&](const std::uint16_t* q) {
            const auto value = Depths(q);
            return hn::And(hn::Ne(value, hn::Zero(di)), AcrossJump(centre, value));
        };
        const auto any =
            hn::Or(hn::Or(edge(p - 1), edge(p + 1)), hn::Or(edge(p - in.stride), edge(p + in.stride)));
        StoreFirst(hn::IfThenZeroElse(any, centre), out + x, in.width - x);
    }
}

// scalar::normal_at for the lanes from column x on. Results through pointers, since the vectors of SVE have
// no size known to the compiler and are no members.
HWY_INLINE void NormalsAt(const DepthRow& in, const RayModel& rays, int x, int y, VF* normal_x, VF* normal_y,
                          VF* normal_z) {
    const DF df;
    const DI di;
    const std::uint16_t* p = in.pixels + x;
    const auto centre = Depths(p), zero_i = hn::Zero(di);
    const auto unit = hn::Set(df, in.unit_m), inverse_fx = hn::Set(df, rays.inverse_fx),
               cx = hn::Set(df, rays.cx);
    const auto slope_u = [&](int column) {
        return hn::Mul(hn::Sub(hn::ConvertTo(df, hn::Iota(di, column)), cx), inverse_fx);
    };
    const auto slope_v = [&](int row) {
        return hn::Set(df, (static_cast<float>(row) - rays.cy) * rays.inverse_fy);
    };
    const auto sx = slope_u(x), sy = slope_v(y);
    const auto point = [&](std::ptrdiff_t step, VF its_sx, VF its_sy, VF* px, VF* py, VF* pz) HWY_ATTR {
        const auto value = Depths(p + step);
        const auto there = hn::AndNot(AcrossJump(centre, value), hn::Ne(value, zero_i));
        const auto there_f = hn::RebindMask(df, there);
        const auto z = hn::Mul(hn::ConvertTo(df, hn::IfThenElse(there, value, centre)), unit);
        *px = hn::Mul(z, hn::IfThenElse(there_f, its_sx, sx));
        *py = hn::Mul(z, hn::IfThenElse(there_f, its_sy, sy));
        *pz = z;
        return there;
    };
    VF right_x, right_y, right_z, left_x, left_y, left_z, down_x, down_y, down_z, up_x, up_y, up_z;
    const MI right = point(1, slope_u(x + 1), sy, &right_x, &right_y, &right_z);
    const MI left = point(-1, slope_u(x - 1), sy, &left_x, &left_y, &left_z);
    const MI down = point(in.stride, sx, slope_v(y + 1), &down_x, &down_y, &down_z);
    const MI up = point(-in.stride, sx, slope_v(y - 1), &up_x, &up_y, &up_z);
    const auto ax = hn::Sub(down_x, up_x), ay = hn::Sub(down_y, up_y), az = hn::Sub(down_z, up_z);
    const auto bx = hn::Sub(right_x, left_x), by = hn::Sub(right_y, left_y), bz = hn::Sub(right_z, left_z);
    const auto nx = hn::Sub(hn::Mul(ay, bz), hn::Mul(az, by)), ny = hn::Sub(hn::Mul(az, bx), hn::Mul(ax, bz)),
               nz = hn::Sub(hn::Mul(ax, by), hn::Mul(ay, bx));
    const auto length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(nx, nx), hn::Mul(ny, ny)), hn::Mul(nz, nz)));
    const auto positive = hn::Gt(length, hn::Zero(df));
    const auto supported = hn::And(hn::Ne(centre, zero_i), hn::And(hn::Or(left, right), hn::Or(up, down)));
    const auto one = hn::Set(df, 1.0f);
    const auto scale = hn::Div(one, hn::IfThenElse(positive, length, one));  // a zero vector stays as it is
    const auto use = hn::RebindMask(df, supported);
    *normal_x = hn::IfThenElseZero(use, hn::Mul(nx, scale));
    *normal_y = hn::IfThenElseZero(use, hn::Mul(ny, scale));
    *normal_z = hn::IfThenElseZero(use, hn::Mul(nz, scale));
}

void NormalsRow(const DepthRow& in, const RayModel& rays, int y, float* normals) {
    const DF df;
    const int lanes = static_cast<int>(hn::Lanes(df));
    VF nx, ny, nz;
    int x = 0;
    for (; x + lanes <= in.width; x += lanes) {
        NormalsAt(in, rays, x, y, &nx, &ny, &nz);
        hn::StoreInterleaved3(nx, ny, nz, df, normals + 3 * x);
    }
    if (x == in.width) return;
    NormalsAt(in, rays, x, y, &nx, &ny, &nz);
    alignas(64) float rest[3 * 16];
    hn::StoreInterleaved3(nx, ny, nz, df, rest);
    std::copy_n(rest, 3 * (in.width - x), normals + 3 * x);
}

void WeightsRow(const DepthRow& in, const RayModel& rays, int y, const WeightModel& model,
                std::uint16_t* weights) {
    const DF df;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto unit = hn::Set(df, in.unit_m), most = hn::Set(df, 4.0f * model.one), one = hn::Set(df, 1.0f);
    for (int x = 0; x < in.width; x += lanes) {
        const auto centre = Depths(in.pixels + x);
        const auto there = hn::Ne(centre, hn::Zero(di));
        auto w = hn::Set(df, model.one);
        if (model.inverse_z2) {
            const auto z =
                hn::IfThenElse(hn::RebindMask(df, there), hn::Mul(hn::ConvertTo(df, centre), unit), one);
            w = hn::Min(hn::Div(w, hn::Mul(z, z)), most);
        }
        if (model.angle) {
            VF nx, ny, nz;
            NormalsAt(in, rays, x, y, &nx, &ny, &nz);
            const auto ray_x = hn::Mul(hn::Sub(hn::ConvertTo(df, hn::Iota(di, x)), hn::Set(df, rays.cx)),
                                       hn::Set(df, rays.inverse_fx));
            const auto ray_y = hn::Set(df, (static_cast<float>(y) - rays.cy) * rays.inverse_fy);
            const auto dot = hn::Add(hn::Add(hn::Mul(nx, ray_x), hn::Mul(ny, ray_y)), nz);
            const auto square = hn::Add(hn::Add(hn::Mul(ray_x, ray_x), hn::Mul(ray_y, ray_y)), one);
            const auto cosine = hn::Div(hn::Neg(dot), hn::Sqrt(square));
            w = hn::Mul(w, hn::Max(cosine, hn::Set(df, 0.1f)));
        }
        const auto rounded = hn::Max(hn::NearestInt(w), hn::Set(di, 1));
        StoreFirst(hn::IfThenElseZero(there, rounded), weights + x, in.width - x);
    }
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(BilateralRow);
HWY_EXPORT(RemoveEdgesRow);
HWY_EXPORT(NormalsRow);
HWY_EXPORT(WeightsRow);

void bilateral_row(const DepthRow& in, int above, int below, std::uint16_t* out) {
    if (scalar_selected()) return scalar::bilateral_row(in, above, below, out);
    BURIN_DISPATCH(BilateralRow)(in, above, below, out);
}

void remove_edges_row(const DepthRow& in, std::uint16_t* out) {
    if (scalar_selected()) return scalar::remove_edges_row(in, out);
    BURIN_DISPATCH(RemoveEdgesRow)(in, out);
}

void normals_row(const DepthRow& in, const RayModel& rays, int y, float* normals) {
    if (scalar_selected()) return scalar::normals_row(in, rays, y, normals);
    BURIN_DISPATCH(NormalsRow)(in, rays, y, normals);
}

void weights_row(const DepthRow& in, const RayModel& rays, int y, const WeightModel& model,
                 std::uint16_t* weights) {
    if (scalar_selected()) return scalar::weights_row(in, rays, y, model, weights);
    BURIN_DISPATCH(WeightsRow)(in, rays, y, model, weights);
}

}  // namespace burin::simd
#endif
