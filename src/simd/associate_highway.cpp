// SPDX-License-Identifier: MIT
// The kernel of associate.h, up to 16 points at a time: the same operations in the same order a lane.
#include <limits>

#include "simd/associate.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/associate_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

void AssociateKernel(const SurfaceGrid& grid, const Association& by, const OrientedPoints& points, int count,
                     float* distance, float* const* gradient) {
    scalar::associate(grid, by, points, count, distance, gradient);
}

#else

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;

// a . b, from left to right.
HWY_INLINE VF Dot(VF ax, VF ay, VF az, VF bx, VF by, VF bz) {
    return hn::Add(hn::Add(hn::Mul(ax, bx), hn::Mul(ay, by)), hn::Mul(az, bz));
}
HWY_INLINE VF Row(const float* r, VF x, VF y, VF z) {
    const DF df;
    return Dot(hn::Set(df, r[0]), hn::Set(df, r[1]), hn::Set(df, r[2]), x, y, z);
}

void AssociateKernel(const SurfaceGrid& grid, const Association& by, const OrientedPoints& points, int count,
                     float* distance, float* const* gradient) {
    const DF df;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto zero = hn::Zero(df), none = hn::Set(df, std::numeric_limits<float>::quiet_NaN()),
               most = hn::Set(df, by.most_m), most_squared = hn::Set(df, by.most_m * by.most_m),
               cx = hn::Set(df, grid.cx + 0.5f), cy = hn::Set(df, grid.cy + 0.5f),
               width = hn::Set(df, static_cast<float>(grid.width)),
               height = hn::Set(df, static_cast<float>(grid.height));
    const float* R = by.R;
    for (int i = 0; i < kSampleBatch; i += lanes) {
        auto valid = hn::FirstN(df, static_cast<std::size_t>(i < count ? count - i : 0));
        VF d = none, nx = zero, ny = zero, nz = zero;
        if (i < count) {
            const auto x = hn::LoadU(df, points.x + i), y = hn::LoadU(df, points.y + i),
                       z = hn::LoadU(df, points.z + i);
            const auto qx = hn::Add(Row(R, x, y, z), hn::Set(df, by.t[0]));
            const auto qy = hn::Add(Row(R + 3, x, y, z), hn::Set(df, by.t[1]));
            const auto qz = hn::Add(Row(R + 6, x, y, z), hn::Set(df, by.t[2]));
            const auto u = hn::Add(hn::Div(hn::Mul(hn::Set(df, grid.fx), qx), qz), cx);
            const auto v = hn::Add(hn::Div(hn::Mul(hn::Set(df, grid.fy), qy), qz), cy);
            valid = hn::And(valid, hn::Gt(qz, hn::Set(df, by.nearest_m)));
            valid = hn::And(valid, hn::And(hn::Ge(u, zero), hn::Lt(u, width)));
            valid = hn::And(valid, hn::And(hn::Ge(v, zero), hn::Lt(v, height)));
            if (!hn::AllFalse(df, valid)) {
                const auto column = hn::ConvertTo(di, hn::IfThenElseZero(valid, u)),
                           row = hn::ConvertTo(di, hn::IfThenElseZero(valid, v));
                const auto cell = hn::Add(hn::Mul(row, hn::Set(di, grid.width)), column);
                const auto dx = hn::Sub(qx, hn::GatherIndex(df, grid.point[0], cell)),
                           dy = hn::Sub(qy, hn::GatherIndex(df, grid.point[1], cell)),
                           dz = hn::Sub(qz, hn::GatherIndex(df, grid.point[2], cell));
                nx = hn::GatherIndex(df, grid.normal[0], cell);
                ny = hn::GatherIndex(df, grid.normal[1], cell);
                nz = hn::GatherIndex(df, grid.normal[2], cell);
                d = Dot(nx, ny, nz, dx, dy, dz);
                valid = hn::And(valid, hn::Lt(Dot(dx, dy, dz, dx, dy, dz), most_squared));
                valid = hn::And(valid, hn::Lt(hn::Abs(d), most));
                const auto px = hn::LoadU(df, points.nx + i), py = hn::LoadU(df, points.ny + i),
                           pz = hn::LoadU(df, points.nz + i);
                const auto cosine =
                    Dot(nx, ny, nz, Row(R, px, py, pz), Row(R + 3, px, py, pz), Row(R + 6, px, py, pz));
                const auto bare = hn::And(hn::Eq(px, zero), hn::And(hn::Eq(py, zero), hn::Eq(pz, zero)));
                valid = hn::And(valid, hn::Or(bare, hn::Ge(cosine, hn::Set(df, by.least_cos))));
            }
        }
        hn::StoreU(hn::IfThenElse(valid, d, none), df, distance + i);
        hn::StoreU(hn::IfThenElseZero(valid, nx), df, gradient[0] + i);
        hn::StoreU(hn::IfThenElseZero(valid, ny), df, gradient[1] + i);
        hn::StoreU(hn::IfThenElseZero(valid, nz), df, gradient[2] + i);
    }
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(AssociateKernel);

void associate(const SurfaceGrid& grid, const Association& by, const OrientedPoints& points, int count,
               float* distance, float* const* gradient) {
    if (scalar_selected()) return scalar::associate(grid, by, points, count, distance, gradient);
    BURIN_DISPATCH(AssociateKernel)(grid, by, points, count, distance, gradient);
}

}  // namespace burin::simd
#endif
