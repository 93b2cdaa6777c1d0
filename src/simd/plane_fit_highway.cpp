// SPDX-License-Identifier: MIT
// plane_fit.h, a row of eight voxels (or half of one) a vector.
#include "simd/kernel_targets.h"
#include "simd/plane_fit.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/plane_fit_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR
int ChooseVoxels(const std::int16_t* sdf, const std::uint16_t* weight, std::uint16_t min_weight,
                 std::int16_t band, std::uint8_t* weights) {
    return scalar::choose_voxels(sdf, weight, min_weight, band, weights);
}
void SumOctants(const std::int16_t* sdf, const std::uint8_t* weights, PlaneSums* sums) {
    scalar::sum_octants(sdf, weights, sums);
}
void PlaneResiduals(const std::int16_t* sdf, const PlaneModel& model, std::uint16_t* residuals) {
    scalar::plane_residuals(sdf, model, residuals);
}
int TukeyWeights(const std::uint16_t* residuals, const std::uint8_t* chosen, float cut,
                 std::uint8_t* weights) {
    return scalar::tukey_weights(residuals, chosen, cut, weights);
}
void PullToPlanes(const std::int16_t* sdf, const std::uint16_t* weight, const Pull* pulls, int count,
                  std::int16_t* out) {
    scalar::pull_to_planes(sdf, weight, pulls, count, out);
}
#else
namespace hn = hwy::HWY_NAMESPACE;
#if HWY_HAVE_SCALABLE
using D32 = hn::CappedTag<std::int32_t, 4>;
#else
using D32 = hn::CappedTag<std::int32_t, 8>;
#endif
using DFloat = hn::RebindToFloat<D32>;
using DU32 = hn::RebindToUnsigned<D32>;
using D16 = hn::Rebind<std::int16_t, D32>;
using DU16 = hn::Rebind<std::uint16_t, D32>;
using DU8 = hn::Rebind<std::uint8_t, D32>;

HWY_INLINE hn::Vec<D32> LoadSdf(const std::int16_t* p) { return hn::PromoteTo(D32(), hn::LoadU(D16(), p)); }
HWY_INLINE hn::Vec<D32> LoadU16(const std::uint16_t* p) { return hn::PromoteTo(D32(), hn::LoadU(DU16(), p)); }
HWY_INLINE hn::Vec<D32> LoadU8(const std::uint8_t* p) { return hn::PromoteTo(D32(), hn::LoadU(DU8(), p)); }
// u of the voxels from x on in a row.
HWY_INLINE hn::Vec<D32> Across(int x) {
    const D32 d;
    return hn::Sub(hn::ShiftLeft<1>(hn::Iota(d, x)), hn::Set(d, 7));
}

int ChooseVoxels(const std::int16_t* HWY_RESTRICT sdf, const std::uint16_t* HWY_RESTRICT weight,
                 std::uint16_t min_weight, std::int16_t band, std::uint8_t* HWY_RESTRICT weights) {
    const D32 d;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const auto least = hn::Set(d, min_weight - 1), most = hn::Set(d, band + 1),
               full = hn::Set(d, kFullWeight);
    auto count = hn::Zero(d);
    for (int i = 0; i < 512; i += lanes) {
        const auto chosen =
            hn::And(hn::Gt(LoadU16(weight + i), least), hn::Lt(hn::Abs(LoadSdf(sdf + i)), most));
        const auto w = hn::IfThenElseZero(chosen, full);
        count = hn::Add(count, w);
        hn::StoreU(hn::DemoteTo(DU8(), w), DU8(), weights + i);
    }
    return hn::GetLane(hn::SumOfLanes(d, count)) / kFullWeight;
}

void SumOctants(const std::int16_t* HWY_RESTRICT sdf, const std::uint8_t* HWY_RESTRICT weights,
                PlaneSums* HWY_RESTRICT sums) {
    const D32 d;
    const int lanes = static_cast<int>(hn::Lanes(d));
    for (int half = 0; half < 4;
         ++half)  // y and z halves; both halves of x at a time, or one after the other
        for (int x0 = 0; x0 < 8; x0 += lanes) {
            auto w = hn::Zero(d), wy = w, wz = w, wyy = w, wyz = w, wzz = w, f = w, fy = w, fz = w;
            for (int row = 0; row < 16; ++row) {
                const int y = 4 * (half & 1) + (row & 3), z = 4 * (half >> 1) + (row >> 2);
                const int at = 64 * z + 8 * y + x0;
                const auto uy = hn::Set(d, 2 * y - 7), uz = hn::Set(d, 2 * z - 7);
                const auto weight = LoadU8(weights + at), distance = hn::Mul(weight, LoadSdf(sdf + at));
                const auto along_y = hn::Mul(weight, uy), along_z = hn::Mul(weight, uz);
                w = hn::Add(w, weight);
                wy = hn::Add(wy, along_y);
                wz = hn::Add(wz, along_z);
                wyy = hn::Add(wyy, hn::Mul(along_y, uy));
                wyz = hn::Add(wyz, hn::Mul(along_y, uz));
                wzz = hn::Add(wzz, hn::Mul(along_z, uz));
                f = hn::Add(f, distance);
                fy = hn::Add(fy, hn::Mul(distance, uy));
                fz = hn::Add(fz, hn::Mul(distance, uz));
            }
            const auto ux = Across(x0), wx = hn::Mul(w, ux);
            static_assert(sizeof(PlaneSums) == 14 * sizeof(std::int32_t));
            alignas(64) std::int32_t lane[8];
            const auto put = [&](int k, hn::Vec<D32> term) HWY_ATTR {
                hn::Store(term, d, lane);
                for (int side = x0 / 4; side < (x0 + lanes) / 4; ++side) {
                    const std::int32_t* four = lane + 4 * side - x0;
                    reinterpret_cast<std::int32_t*>(sums + (side | half << 1))[k] =
                        (four[0] + four[1]) + (four[2] + four[3]);
                }
            };
            // In the order of PlaneSums. No array of vectors: those of SVE have no size known to the
            // compiler.
            put(0, w), put(1, wx), put(2, wy), put(3, wz);
            put(4, hn::Mul(wx, ux)), put(5, hn::Mul(wy, ux)), put(6, hn::Mul(wz, ux));
            put(7, wyy), put(8, wyz), put(9, wzz);
            put(10, f), put(11, hn::Mul(f, ux)), put(12, fy), put(13, fz);
        }
}

void PlaneResiduals(const std::int16_t* HWY_RESTRICT sdf, const PlaneModel& model,
                    std::uint16_t* HWY_RESTRICT residuals) {
    const DFloat d;
    const D32 di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const auto a0 = hn::Set(d, model.a[0]), most = hn::Set(d, 65535.0f), half = hn::Set(d, 0.5f);
    for (int row = 0; row < 64; ++row) {
        const float y = static_cast<float>(2 * (row & 7) - 7), z = static_cast<float>(2 * (row >> 3) - 7);
        const auto base = hn::Set(d, (model.a[1] * y + model.a[2] * z) + model.c);
        for (int x = 0; x < 8; x += lanes) {
            const auto at = hn::Add(base, hn::Mul(a0, hn::ConvertTo(d, Across(x))));
            const auto r = hn::Abs(hn::Sub(hn::ConvertTo(d, LoadSdf(sdf + 8 * row + x)), at));
            const auto whole = hn::ConvertTo(di, hn::Add(hn::IfThenElse(hn::Lt(r, most), r, most), half));
            hn::StoreU(hn::DemoteTo(DU16(), whole), DU16(), residuals + 8 * row + x);
        }
    }
}

int TukeyWeights(const std::uint16_t* HWY_RESTRICT residuals, const std::uint8_t* HWY_RESTRICT chosen,
                 float cut, std::uint8_t* HWY_RESTRICT weights) {
    const DFloat d;
    const D32 di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const auto per_cut = hn::Set(d, 1.0f / cut), one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f),
               full = hn::Set(d, static_cast<float>(kFullWeight));
    auto sum = hn::Zero(di);
    for (int i = 0; i < 512; i += lanes) {
        const auto t = hn::Mul(hn::ConvertTo(d, LoadU16(residuals + i)), per_cut);
        const auto q = hn::Sub(one, hn::Mul(t, t));
        const auto w = hn::ConvertTo(di, hn::Add(hn::Mul(full, hn::Mul(q, q)), half));
        const auto counts =
            hn::And(hn::RebindMask(di, hn::Gt(q, hn::Zero(d))), hn::Gt(LoadU8(chosen + i), hn::Zero(di)));
        const auto kept = hn::IfThenElseZero(counts, w);
        sum = hn::Add(sum, kept);
        hn::StoreU(hn::DemoteTo(DU8(), kept), DU8(), weights + i);
    }
    return hn::GetLane(hn::SumOfLanes(di, sum));
}

void PullToPlanes(const std::int16_t* HWY_RESTRICT sdf, const std::uint16_t* HWY_RESTRICT weight,
                  const Pull* HWY_RESTRICT pulls, int count, std::int16_t* HWY_RESTRICT out) {
    const DFloat d;
    const D32 di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const auto one = hn::Set(d, 1.0f);
    for (int row = 0; row < 64; ++row) {
        const float y = static_cast<float>(2 * (row & 7) - 7), z = static_cast<float>(2 * (row >> 3) - 7);
        for (int x = 0; x < 8; x += lanes) {
            const int i = 8 * row + x;
            const auto stored = LoadSdf(sdf + i), known = LoadU16(weight + i);
            const auto f = hn::ConvertTo(d, stored), u = hn::ConvertTo(d, Across(x));
            auto least = hn::Zero(d), strength = least, per_reach = least;
            for (int k = 0; k < count; ++k) {
                const PlaneModel& m = pulls[k].plane;
                const auto base = hn::Set(d, (m.a[1] * y + m.a[2] * z) + m.c);
                const auto r = hn::Sub(hn::Add(base, hn::Mul(hn::Set(d, m.a[0]), u)), f);
                const auto s = hn::Set(d, pulls[k].strength), p = hn::Set(d, 1.0f / pulls[k].reach);
                if (k == 0) {
                    least = r, strength = s, per_reach = p;
                    continue;
                }
                const auto nearer = hn::Lt(hn::Abs(r), hn::Abs(least));
                least = hn::IfThenElse(nearer, r, least);
                strength = hn::IfThenElse(nearer, s, strength);
                per_reach = hn::IfThenElse(nearer, p, per_reach);
            }
            const auto w = hn::ConvertTo(d, known);
            const auto seen =
                hn::Min(hn::Max(hn::Mul(w, hn::Set(d, 1.0f / kSeenOften)), hn::Set(d, kLeastSeen)), one);
            const auto t = hn::Mul(least, per_reach), q = hn::Sub(one, hn::Mul(hn::Mul(t, t), seen)),
                       s = hn::Mul(strength, hn::Mul(q, q));
            const auto moved = hn::Add(f, hn::Mul(least, hn::Div(s, hn::Add(w, s))));
            const auto moves =
                hn::And(hn::And(hn::RebindMask(di, hn::Gt(q, hn::Zero(d))), hn::Gt(known, hn::Zero(di))),
                        hn::Lt(hn::Abs(stored), hn::Set(di, kPullLimit + 1)));
            // Where nothing moves the value may be anything; within the reach it stays in range.
            const auto result = hn::IfThenElse(moves, hn::NearestInt(moved), stored);
            hn::StoreU(hn::DemoteTo(D16(), result), D16(), out + i);
        }
    }
}
#endif

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(ChooseVoxels);
HWY_EXPORT(SumOctants);
HWY_EXPORT(PlaneResiduals);
HWY_EXPORT(TukeyWeights);
HWY_EXPORT(PullToPlanes);

int choose_voxels(const std::int16_t* sdf, const std::uint16_t* weight, std::uint16_t min_weight,
                  std::int16_t band, std::uint8_t* weights) {
    if (scalar_selected()) return scalar::choose_voxels(sdf, weight, min_weight, band, weights);
    return BURIN_DISPATCH(ChooseVoxels)(sdf, weight, min_weight, band, weights);
}
void sum_octants(const std::int16_t* sdf, const std::uint8_t* weights, PlaneSums sums[8]) {
    if (scalar_selected()) return scalar::sum_octants(sdf, weights, sums);
    BURIN_DISPATCH(SumOctants)(sdf, weights, sums);
}
void plane_residuals(const std::int16_t* sdf, const PlaneModel& model, std::uint16_t* residuals) {
    if (scalar_selected()) return scalar::plane_residuals(sdf, model, residuals);
    BURIN_DISPATCH(PlaneResiduals)(sdf, model, residuals);
}
int tukey_weights(const std::uint16_t* residuals, const std::uint8_t* chosen, float cut,
                  std::uint8_t* weights) {
    if (scalar_selected()) return scalar::tukey_weights(residuals, chosen, cut, weights);
    return BURIN_DISPATCH(TukeyWeights)(residuals, chosen, cut, weights);
}
void pull_to_planes(const std::int16_t* sdf, const std::uint16_t* weight, const Pull* pulls, int count,
                    std::int16_t* out) {
    if (scalar_selected()) return scalar::pull_to_planes(sdf, weight, pulls, count, out);
    BURIN_DISPATCH(PullToPlanes)(sdf, weight, pulls, count, out);
}

}  // namespace burin::simd
#endif
