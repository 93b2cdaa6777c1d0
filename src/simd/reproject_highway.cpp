// SPDX-License-Identifier: MIT
// The kernels of reproject.h, up to 16 pixels at a time: the same operations in the same order a lane.
#include <algorithm>

#include "simd/reproject.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/reproject_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"
#include "simd/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

void FootprintsRow(const std::uint16_t* depth, int width, int y, const float* ray_x, const float* ray_y,
                   const Reprojection& by, const Footprints& out) {
    scalar::footprints_row(depth, width, y, ray_x, ray_y, by, out);
}
void CellsRow(const std::uint16_t* depth, int width, int y, const float* ray_x, const float* ray_y,
              const Reprojection& by, std::int32_t* cell, std::uint16_t* depth_there) {
    scalar::cells_row(depth, width, y, ray_x, ray_y, by, cell, depth_there);
}
void AddOne(std::uint16_t* values, int count) { scalar::add_one(values, count); }

#else

namespace hn = hwy::HWY_NAMESPACE;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using MF = hn::Mask<DF>;

// land() of reproject.cpp.
template <bool kDistorted>
HWY_INLINE void Land(VI depth, VF x, VF y, const Reprojection& by, VF* u_out, VF* v_out, VF* extent,
                     VF* Z_out, MF* valid_out) {
    const DF df;
    const DI di;
    const float* h = by.h;
    const auto sum = [&](int row) {
        const auto across = hn::Add(hn::Mul(hn::Set(df, h[3 * row + 1]), y), hn::Set(df, h[3 * row + 2]));
        return hn::Add(hn::Mul(hn::Set(df, h[3 * row]), x), across);
    };
    const auto z = hn::ConvertTo(df, depth);
    const auto U = hn::Add(hn::Mul(sum(0), z), hn::Set(df, by.t[0]));
    const auto V = hn::Add(hn::Mul(sum(1), z), hn::Set(df, by.t[1]));
    const auto Z = hn::Add(hn::Mul(sum(2), z), hn::Set(df, by.t[2]));
    const auto none = hn::Or(hn::Eq(depth, hn::Zero(di)), hn::Eq(depth, hn::Set(di, 65535)));
    const auto half = hn::Set(df, 0.5f);
    auto valid = hn::AndNot(
        hn::RebindMask(df, none),
        hn::And(hn::Ge(Z, hn::Set(df, by.nearest)), hn::Lt(hn::Add(Z, half), hn::Set(df, 65535.0f))));
    const auto i = hn::Div(hn::Set(df, 1.0f), Z);
    auto u = hn::Mul(U, i), v = hn::Mul(V, i), e = hn::Mul(z, i);
    if constexpr (kDistorted) {
        const auto one = hn::Set(df, 1.0f), two = hn::Set(df, 2.0f);
        const auto xx = hn::Mul(u, u), yy = hn::Mul(v, v), two_xy = hn::Mul(two, hn::Mul(u, v)),
                   r2 = hn::Add(xx, yy);
        valid = hn::And(valid, hn::Le(r2, hn::Set(df, by.most_r2)));
        const auto polynomial = [&](float a, float b, float c) {
            return hn::Add(
                one, hn::Mul(r2, hn::Add(hn::Set(df, a),
                                         hn::Mul(r2, hn::Add(hn::Set(df, b), hn::Mul(r2, hn::Set(df, c)))))));
        };
        const auto radial = polynomial(by.k1, by.k2, by.k3);
        const auto slope = polynomial(3.0f * by.k1, 5.0f * by.k2, 7.0f * by.k3);
        e = hn::Mul(e, hn::Max(radial, slope));
        const auto p1 = hn::Set(df, by.p1), p2 = hn::Set(df, by.p2);
        const auto du = hn::Add(hn::Mul(u, radial),
                                hn::Add(hn::Mul(p1, two_xy), hn::Mul(p2, hn::Add(r2, hn::Mul(two, xx)))));
        const auto dv = hn::Add(hn::Mul(v, radial),
                                hn::Add(hn::Mul(p1, hn::Add(r2, hn::Mul(two, yy))), hn::Mul(p2, two_xy)));
        u = hn::Add(hn::Mul(hn::Set(df, by.fx), du), hn::Set(df, by.cx));
        v = hn::Add(hn::Mul(hn::Set(df, by.fy), dv), hn::Set(df, by.cy));
    }
    // What is not valid may be anything: 0 from here on.
    *u_out = hn::IfThenElseZero(valid, u);
    *v_out = hn::IfThenElseZero(valid, v);
    *extent = hn::IfThenElseZero(valid, e);
    *Z_out = hn::IfThenElseZero(valid, Z);
    *valid_out = valid;
}

HWY_INLINE VI Cells(VF edge, VF count) {
    const DF df;
    return TruncateInRange(hn::Ceil(hn::Min(hn::Max(edge, hn::Zero(df)), count)));
}

// Rays of a vector of pixels, and depth: whole vectors of the row, or copies of its end.
struct RowView {
    const std::uint16_t* depth;
    const float *x, *y;
};

template <bool kRays, bool kDistorted>
HWY_INLINE void LandAt(const RowView& row, int i, VF column, VF line, const Reprojection& by, VF* u, VF* v,
                       VF* extent, VF* Z, MF* valid) {
    const DF df;
    const DI di;
    const DU16 du16;
    const auto depth = hn::PromoteTo(di, hn::LoadU(du16, row.depth + i));
    if constexpr (kRays)
        Land<kDistorted>(depth, hn::LoadU(df, row.x + i), hn::LoadU(df, row.y + i), by, u, v, extent, Z,
                         valid);
    else
        Land<kDistorted>(depth, column, line, by, u, v, extent, Z, valid);
}

template <bool kRays, bool kDistorted>
void FootprintsOf(const RowView& row, int first, int count, int y, const Reprojection& by,
                  const Footprints& out) {
    const DF df;
    const DI di;
    const DU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto half_u = hn::Set(df, by.half_u), half_v = hn::Set(df, by.half_v),
               width = hn::Set(df, static_cast<float>(by.width)),
               height = hn::Set(df, static_cast<float>(by.height)), line = hn::Set(df, static_cast<float>(y));
    const auto pitch = hn::Set(di, by.pitch), most = hn::Set(di, kMostCells), one = hn::Set(di, 0x101),
               nowhere = hn::Set(di, 65535);
    for (int i = 0; i < count; i += lanes) {
        const auto column = hn::ConvertTo(df, hn::Iota(di, first + i));
        VF u, v, e, Z;
        MF valid;
        LandAt<kRays, kDistorted>(row, i, column, line, by, &u, &v, &e, &Z, &valid);
        const auto hu = hn::Mul(half_u, e), hv = hn::Mul(half_v, e);
        const auto left = Cells(hn::Sub(u, hu), width), right = Cells(hn::Add(u, hu), width);
        const auto top = Cells(hn::Sub(v, hv), height), bottom = Cells(hn::Add(v, hv), height);
        const auto columns = hn::Min(hn::Sub(right, left), most), rows = hn::Min(hn::Sub(bottom, top), most);
        const auto lands = hn::And(hn::RebindMask(di, valid),
                                   hn::And(hn::Gt(columns, hn::Zero(di)), hn::Gt(rows, hn::Zero(di))));
        const auto cell = hn::Add(hn::Mul(top, pitch), left);
        const auto less_one = hn::Sub(TruncateInRange(hn::Add(Z, hn::Set(df, 0.5f))), hn::Set(di, 1));
        const auto size = hn::Or(columns, hn::ShiftLeft<8>(rows));
        hn::StoreU(hn::IfThenElseZero(lands, cell), di, out.cell + i);
        hn::StoreU(hn::DemoteTo(du16, hn::IfThenElse(lands, less_one, nowhere)), du16, out.less_one + i);
        hn::StoreU(hn::DemoteTo(du16, hn::IfThenElse(lands, size, one)), du16, out.size + i);
    }
}

template <bool kRays, bool kDistorted>
void CellsOf(const RowView& row, int first, int count, int y, const Reprojection& by, std::int32_t* cell_out,
             std::uint16_t* depth_there) {
    const DF df;
    const DI di;
    const DU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto half = hn::Set(df, 0.5f), zero = hn::Zero(df),
               width = hn::Set(df, static_cast<float>(by.width)),
               height = hn::Set(df, static_cast<float>(by.height)), line = hn::Set(df, static_cast<float>(y));
    for (int i = 0; i < count; i += lanes) {
        const auto column = hn::ConvertTo(df, hn::Iota(di, first + i));
        VF u, v, e, Z;
        MF valid;
        LandAt<kRays, kDistorted>(row, i, column, line, by, &u, &v, &e, &Z, &valid);
        u = hn::Add(u, half);
        v = hn::Add(v, half);
        valid = hn::And(valid, hn::And(hn::Ge(u, zero), hn::Lt(u, width)));
        valid = hn::And(valid, hn::And(hn::Ge(v, zero), hn::Lt(v, height)));
        const auto cell =
            hn::Add(hn::Mul(TruncateInRange(hn::IfThenElseZero(valid, v)), hn::Set(di, by.pitch)),
                    TruncateInRange(hn::IfThenElseZero(valid, u)));
        const auto lands = hn::RebindMask(di, valid);
        hn::StoreU(hn::IfThenElse(lands, cell, hn::Set(di, -1)), di, cell_out + i);
        hn::StoreU(hn::DemoteTo(du16, hn::IfThenElseZero(lands, TruncateInRange(hn::Add(Z, half)))), du16,
                   depth_there + i);
    }
}

// body(row, first pixel, pixels) for the whole batches of a row and, out of a copy, the last one.
template <class Body>
HWY_INLINE void EachBatch(const std::uint16_t* depth, int width, const float* ray_x, const float* ray_y,
                          Body&& body) {
    const int whole = width / kFootprintBatch * kFootprintBatch;
    if (whole > 0) body(RowView{depth, ray_x, ray_y}, 0, whole);
    if (whole == width) return;
    std::uint16_t rest[kFootprintBatch] = {};
    float x[kFootprintBatch] = {}, y[kFootprintBatch] = {};
    std::copy_n(depth + whole, width - whole, rest);
    if (ray_x) std::copy_n(ray_x + whole, width - whole, x);
    if (ray_y) std::copy_n(ray_y + whole, width - whole, y);
    body(RowView{rest, x, y}, whole, kFootprintBatch);
}

void FootprintsRow(const std::uint16_t* depth, int width, int y, const float* ray_x, const float* ray_y,
                   const Reprojection& by, const Footprints& out) {
    EachBatch(depth, width, ray_x, ray_y, [&](const RowView& row, int first, int count) {
        const Footprints to = {out.cell + first, out.less_one + first, out.size + first};
        if (ray_x)
            by.distorted ? FootprintsOf<true, true>(row, first, count, y, by, to)
                         : FootprintsOf<true, false>(row, first, count, y, by, to);
        else
            by.distorted ? FootprintsOf<false, true>(row, first, count, y, by, to)
                         : FootprintsOf<false, false>(row, first, count, y, by, to);
    });
}

void CellsRow(const std::uint16_t* depth, int width, int y, const float* ray_x, const float* ray_y,
              const Reprojection& by, std::int32_t* cell, std::uint16_t* depth_there) {
    EachBatch(depth, width, ray_x, ray_y, [&](const RowView& row, int first, int count) {
        if (ray_x)
            by.distorted ? CellsOf<true, true>(row, first, count, y, by, cell + first, depth_there + first)
                         : CellsOf<true, false>(row, first, count, y, by, cell + first, depth_there + first);
        else
            by.distorted ? CellsOf<false, true>(row, first, count, y, by, cell + first, depth_there + first)
                         : CellsOf<false, false>(row, first, count, y, by, cell + first, depth_there + first);
    });
}

void AddOne(std::uint16_t* values, int count) {
    const hn::CappedTag<std::uint16_t, 32> d;
    const int lanes = static_cast<int>(hn::Lanes(d));
    int i = 0;
    for (; i + lanes <= count; i += lanes)
        hn::StoreU(hn::Add(hn::LoadU(d, values + i), hn::Set(d, 1)), d, values + i);
    scalar::add_one(values + i, count - i);
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(FootprintsRow);
HWY_EXPORT(CellsRow);
HWY_EXPORT(AddOne);

void footprints_row(const std::uint16_t* depth, int width, int y, const float* ray_x, const float* ray_y,
                    const Reprojection& by, const Footprints& out) {
    if (scalar_selected()) return scalar::footprints_row(depth, width, y, ray_x, ray_y, by, out);
    BURIN_DISPATCH(FootprintsRow)(depth, width, y, ray_x, ray_y, by, out);
}

void cells_row(const std::uint16_t* depth, int width, int y, const float* ray_x, const float* ray_y,
               const Reprojection& by, std::int32_t* cell, std::uint16_t* depth_there) {
    if (scalar_selected()) return scalar::cells_row(depth, width, y, ray_x, ray_y, by, cell, depth_there);
    BURIN_DISPATCH(CellsRow)(depth, width, y, ray_x, ray_y, by, cell, depth_there);
}

void add_one(std::uint16_t* values, int count) {
    if (scalar_selected()) return scalar::add_one(values, count);
    BURIN_DISPATCH(AddOne)(values, count);
}

}  // namespace burin::simd
#endif
