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

void FootprintsRow(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
                   const Footprints& out) {
    scalar::footprints_row(depth, width, y, rays, by, out);
}
void CellsRow(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
              std::int32_t* cell, std::uint16_t* depth_there) {
    scalar::cells_row(depth, width, y, rays, by, cell, depth_there);
}
void SplatRow(const Footprints& row, int width, const Reprojection& by, std::uint16_t* target) {
    scalar::splat_row(row, width, by, target);
}
void AddOne(std::uint16_t* values, int count) { scalar::add_one(values, count); }

#else

namespace hn = hwy::HWY_NAMESPACE;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using MF = hn::Mask<DF>;

// land() of reproject.cpp.
template <bool kDistorted>
HWY_INLINE void Land(VI depth, VF x, VF y, VF span, const Reprojection& by, VF* u_out, VF* v_out, VF* extent,
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
    auto valid = hn::AndNot(hn::RebindMask(df, none),
                            hn::And(hn::Ge(Z, hn::Set(df, by.nearest)), hn::Lt(Z, hn::Set(df, 65534.5f))));
    const auto i = hn::Div(hn::Set(df, 1.0f), Z);
    auto u = hn::Mul(U, i), v = hn::Mul(V, i), e = hn::Mul(hn::Mul(z, i), span);
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
        e = hn::Mul(e, hn::Max(hn::Max(radial, slope), hn::Zero(df)));
        const auto p1 = hn::Set(df, by.p1), p2 = hn::Set(df, by.p2);
        const auto du = hn::Add(hn::Mul(u, radial),
                                hn::Add(hn::Mul(p1, two_xy), hn::Mul(p2, hn::Add(r2, hn::Mul(two, xx)))));
        const auto dv = hn::Add(hn::Mul(v, radial),
                                hn::Add(hn::Mul(p1, hn::Add(r2, hn::Mul(two, yy))), hn::Mul(p2, two_xy)));
        u = hn::Add(hn::Mul(hn::Set(df, by.fx), du), hn::Set(df, by.cx));
        v = hn::Add(hn::Mul(hn::Set(df, by.fy), dv), hn::Set(df, by.cy));
    }
    *u_out = u;
    *v_out = v;
    *extent = e;
    *Z_out = Z;
    *valid_out = valid;
}

using D16x = hn::Repartition<std::int16_t, DF>;

// Two of 16 bits in each lane of 32: u low, v high.
HWY_INLINE hn::Vec<D16x> Pairs(VI u, VI v) {
    const D16x d;
    return hn::OddEven(hn::BitCast(d, hn::ShiftLeft<16>(v)), hn::BitCast(d, u));
}

// u + v * pitch of such pairs, plus a constant.
HWY_INLINE VI CellOf(hn::Vec<D16x> pairs, VI pitch_and_one, int pitch, VI constant) {
    const DI di;
#if BURIN_HAVE_PACK
    static_cast<void>(pitch);
    return hn::Add(MultiplyAddPairs(pairs, hn::BitCast(D16x(), pitch_and_one)), constant);
#else
    static_cast<void>(pitch_and_one);
    const auto both = hn::BitCast(di, pairs);
    const auto u = hn::ShiftRight<16>(hn::ShiftLeft<16>(both)), v = hn::ShiftRight<16>(both);
    return hn::Add(hn::Add(hn::Mul(v, hn::Set(di, pitch)), u), constant);
#endif
}

// Rays of a vector of pixels, and depth: whole vectors of the row, or copies of its end.
struct RowView {
    const std::uint16_t* depth;
    RayRow rays;
};

template <bool kRays, bool kDistorted>
HWY_INLINE void LandAt(const RowView& row, int i, VF column, VF line, const Reprojection& by, VF* u, VF* v,
                       VF* extent, VF* Z, MF* valid) {
    const DF df;
    const DI di;
    const DU16 du16;
    const auto depth = hn::PromoteTo(di, hn::LoadU(du16, row.depth + i));
    if constexpr (kRays)
        Land<kDistorted>(depth, hn::LoadU(df, row.rays.x + i), hn::LoadU(df, row.rays.y + i),
                         hn::LoadU(df, row.rays.span + i), by, u, v, extent, Z, valid);
    else
        Land<kDistorted>(depth, column, line, hn::Set(df, 1.0f), by, u, v, extent, Z,
                         valid);  // times 1 is exact
}

template <bool kRays, bool kDistorted>
void FootprintsOf(const RowView& row, int first, int count, int y, const Reprojection& reprojection,
                  const Footprints& out) {
    const DF df;
    const DI di;
    const D16x d16;
    const Reprojection by = reprojection;  // which the stores below cannot change
    const int lanes = static_cast<int>(hn::Lanes(df));
    // Made once: Iota is lanes written one by one.
    const auto numbers = hn::ConvertTo(df, hn::Iota(di, 0));
    const auto half_u = hn::Set(df, by.half_u), half_v = hn::Set(df, by.half_v),
               most_half = hn::Set(df, kMostHalf), line = hn::Set(df, static_cast<float>(y));
    // span_of() of reproject.cpp, for u and v in one vector from where they are integers.
    const int away_u = by.width + 32, away_v = by.height + 32;
    const auto k_u = hn::Set(df, static_cast<float>(away_u)), k_v = hn::Set(df, static_cast<float>(away_v)),
               most = hn::Set(df, -16.0f), least_u = hn::Set(df, -static_cast<float>(away_u) - 16.0f),
               least_v = hn::Set(df, -static_cast<float>(away_v) - 16.0f);
    const auto pair = [](int low, int high) {
        return static_cast<std::int32_t>(static_cast<std::uint32_t>(low & 0xffff) |
                                         static_cast<std::uint32_t>(high) << 16);
    };
    const auto border_low = hn::BitCast(d16, hn::Set(di, pair(-away_u, -away_v))),
               border_high = hn::BitCast(d16, hn::Set(di, pair(-32, -32)));
    const auto pitch_and_one = hn::Set(di, pair(1, by.pitch)),
               origin = hn::Set(di, away_v * by.pitch + away_u);
    const auto ones = hn::Set(di, 0x00010001), signs = hn::Set(di, static_cast<std::int32_t>(0x80008000u)),
               nowhere = hn::Set(di, static_cast<std::int32_t>(kNowhere));
    for (int i = 0; i < count; i += lanes) {
        const auto column = hn::Add(numbers, hn::Set(df, static_cast<float>(first + i)));  // exact
        VF u, v, e, Z;
        MF valid;
        LandAt<kRays, kDistorted>(row, i, column, line, by, &u, &v, &e, &Z, &valid);
        const auto hu = hn::Min(hn::Mul(half_u, e), most_half), hv = hn::Min(hn::Mul(half_v, e), most_half);
        const auto cu = hn::Min(hn::Max(hn::Sub(u, k_u), least_u), most),
                   cv = hn::Min(hn::Max(hn::Sub(v, k_v), least_v), most);
        auto low = Pairs(TruncateInRange(hn::Sub(cu, hu)), TruncateInRange(hn::Sub(cv, hv)));
        auto high = Pairs(TruncateInRange(hn::Add(cu, hu)), TruncateInRange(hn::Add(cv, hv)));
        low = hn::Min(hn::Max(low, border_low), border_high);
        high = hn::Min(hn::Max(high, border_low), border_high);
        const auto size = hn::BitCast(di, hn::Sub(high, low));  // neither is negative; with none, 1 less is
        const auto covers = hn::Eq(hn::And(hn::Sub(size, ones), signs), hn::Zero(di));
        const auto lands = hn::And(hn::RebindMask(di, valid), covers);
        const auto less_one = TruncateInRange(hn::Sub(Z, hn::Set(df, 0.5f)));
        const auto what = hn::BitCast(di, Pairs(hn::Or(size, hn::ShiftRight<8>(size)), less_one));
        const auto cell = CellOf(low, pitch_and_one, by.pitch, origin);
        hn::StoreU(hn::IfThenElseZero(lands, cell), di, out.cell + i);
        hn::StoreU(hn::IfThenElse(lands, what, nowhere), di, reinterpret_cast<std::int32_t*>(out.what + i));
    }
}

template <bool kRays, bool kDistorted>
void CellsOf(const RowView& row, int first, int count, int y, const Reprojection& reprojection,
             std::int32_t* cell_out, std::uint16_t* depth_there) {
    const DF df;
    const DI di;
    const DU16 du16;
    const Reprojection by = reprojection;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto numbers = hn::ConvertTo(df, hn::Iota(di, 0));
    const auto half = hn::Set(df, 0.5f), zero = hn::Zero(df),
               width = hn::Set(df, static_cast<float>(by.width)),
               height = hn::Set(df, static_cast<float>(by.height)), line = hn::Set(df, static_cast<float>(y));
    for (int i = 0; i < count; i += lanes) {
        const auto column = hn::Add(numbers, hn::Set(df, static_cast<float>(first + i)));  // exact
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
        hn::StoreU(hn::IfThenElseZero(lands, cell), di, cell_out + i);
        hn::StoreU(hn::DemoteTo(du16, hn::IfThenElseZero(
                                          lands, hn::Add(TruncateInRange(hn::Sub(Z, half)), hn::Set(di, 1)))),
                   du16, depth_there + i);
    }
}

// body(row, first pixel, pixels) for the whole batches of a row and, out of a copy, the last one.
template <class Body>
HWY_INLINE void EachBatch(const std::uint16_t* depth, int width, const RayRow* rays, Body&& body) {
    const int whole = width / kFootprintBatch * kFootprintBatch;
    if (whole > 0) body(RowView{depth, rays ? *rays : RayRow{}}, 0, whole);
    if (whole == width) return;
    std::uint16_t rest[kFootprintBatch] = {};
    float x[kFootprintBatch] = {}, y[kFootprintBatch] = {}, span[kFootprintBatch] = {};
    std::copy_n(depth + whole, width - whole, rest);
    if (rays) {
        std::copy_n(rays->x + whole, width - whole, x);
        std::copy_n(rays->y + whole, width - whole, y);
        std::copy_n(rays->span + whole, width - whole, span);
    }
    body(RowView{rest, {x, y, span}}, whole, kFootprintBatch);
}

void FootprintsRow(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
                   const Footprints& out) {
    EachBatch(depth, width, rays, [&](const RowView& row, int first, int count) {
        const Footprints to = {out.cell + first, out.what + first};
        if (rays)
            by.distorted ? FootprintsOf<true, true>(row, first, count, y, by, to)
                         : FootprintsOf<true, false>(row, first, count, y, by, to);
        else
            by.distorted ? FootprintsOf<false, true>(row, first, count, y, by, to)
                         : FootprintsOf<false, false>(row, first, count, y, by, to);
    });
}

void CellsRow(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
              std::int32_t* cell, std::uint16_t* depth_there) {
    EachBatch(depth, width, rays, [&](const RowView& row, int first, int count) {
        if (rays)
            by.distorted ? CellsOf<true, true>(row, first, count, y, by, cell + first, depth_there + first)
                         : CellsOf<true, false>(row, first, count, y, by, cell + first, depth_there + first);
        else
            by.distorted ? CellsOf<false, true>(row, first, count, y, by, cell + first, depth_there + first)
                         : CellsOf<false, false>(row, first, count, y, by, cell + first, depth_there + first);
    });
}

// 65535 from the columns' number on: the minimum with it leaves what is there.
constexpr int kEight = 8;
alignas(16) constexpr std::uint16_t kBeyond[2 * kEight] = {
    0, 0, 0, 0, 0, 0, 0, 0, 65535, 65535, 65535, 65535, 65535, 65535, 65535, 65535};

void SplatRow(const Footprints& row, int width, const Reprojection& by, std::uint16_t* target) {
    constexpr int kGroup = 4;
    const hn::CappedTag<std::uint16_t, kEight> eight;
    const std::int32_t* cell = row.cell;
    const std::uint32_t* what = row.what;
    const std::ptrdiff_t pitch = by.pitch;
    const std::ptrdiff_t last = (by.height - 1) * pitch + by.width - kEight;  // where eight still fit
    const bool packed = by.pitch == by.width;
    const int padded = (width + kFootprintBatch - 1) / kFootprintBatch * kFootprintBatch;
    for (int i = 0; i < padded; i += kGroup) {
        // Single cells all four: nearly always, where both views have one size. No byte of a size is 0.
        const std::uint32_t all = what[i] | what[i + 1] | what[i + 2] | what[i + 3];
        if ((all & 0xffff) == 0x101) {
            for (int k = i; k < i + kGroup; ++k) {
                const std::uint16_t before = target[cell[k]];
                target[cell[k]] = std::min(before, static_cast<std::uint16_t>(what[k] >> 16));
            }
            continue;
        }
        for (int k = i; k < i + kGroup; ++k) {
            const int columns = static_cast<int>(what[k] & 255), rows = static_cast<int>(what[k] >> 8 & 255);
            if (packed && columns <= kEight && cell[k] + (rows - 1) * pitch <= last) {
                // Eight at a time, whatever the number: no jumps that cannot be foretold.
                const auto value = hn::Or(hn::Set(eight, static_cast<std::uint16_t>(what[k] >> 16)),
                                          hn::LoadU(eight, kBeyond + kEight - columns));
                std::uint16_t* at = target + cell[k];
                for (int v = 0; v < rows; ++v, at += pitch)
                    hn::StoreU(hn::Min(hn::LoadU(eight, at), value), eight, at);
                continue;
            }
            const Footprints one = {row.cell + k, row.what + k};
            scalar::splat_row(one, 1, by, target);
        }
    }
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
HWY_EXPORT(SplatRow);
HWY_EXPORT(AddOne);

void footprints_row(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
                    const Footprints& out) {
    if (scalar_selected()) return scalar::footprints_row(depth, width, y, rays, by, out);
    BURIN_DISPATCH(FootprintsRow)(depth, width, y, rays, by, out);
}

void cells_row(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
               std::int32_t* cell, std::uint16_t* depth_there) {
    if (scalar_selected()) return scalar::cells_row(depth, width, y, rays, by, cell, depth_there);
    BURIN_DISPATCH(CellsRow)(depth, width, y, rays, by, cell, depth_there);
}

void splat_row(const Footprints& row, int width, const Reprojection& by, std::uint16_t* target) {
    if (scalar_selected()) return scalar::splat_row(row, width, by, target);
    BURIN_DISPATCH(SplatRow)(row, width, by, target);
}

void add_one(std::uint16_t* values, int count) {
    if (scalar_selected()) return scalar::add_one(values, count);
    BURIN_DISPATCH(AddOne)(values, count);
}

}  // namespace burin::simd
#endif
