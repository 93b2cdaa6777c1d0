// SPDX-License-Identifier: MIT
// The kernels of tsdf.h, many lanes at a time. Bit for bit what tsdf.cpp computes: the same operations in the
// same order a lane, no fused multiply-add, no approximate reciprocal, no sums across lanes.
#include <cstring>

#include "simd/tsdf.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/tsdf_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"
#include "simd/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

int FuseDistances(const std::int16_t* distances, const std::uint16_t* weights, std::uint16_t max_weight,
                  std::int16_t* sdf, std::uint16_t* weight_sum, std::uint16_t near, std::uint16_t* moved) {
    return scalar::fuse_distances(distances, weights, max_weight, sdf, weight_sum, near, moved);
}
int CarveDistances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                   std::uint16_t max_weight, std::int16_t* sdf, std::uint16_t* weight_sum) {
    return scalar::carve_distances(distances, weights, times, max_weight, sdf, weight_sum);
}

#else

#if BURIN_HAVE_PACK

// The common case, every observation weighing kWeightOne: sums and minima in 16 bits; 64 (distance - sdf) by
// one multiply-add of interleaved pairs.
int FuseConstant(const std::int16_t* HWY_RESTRICT distances, std::uint16_t max_weight,
                 std::int16_t* HWY_RESTRICT sdf, std::uint16_t* HWY_RESTRICT weight_sum, std::uint16_t near,
                 std::uint16_t* moved) {
    const DF df;
    const DI di;
    const DFull16 d16;
    const DFullU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(d16));
    const auto unseen = hn::Set(d16, kUnseen), zero = hn::Zero(d16);
    const auto one = hn::Set(du16, kWeightOne), most = hn::Set(du16, max_weight);
    const auto pair = hn::BitCast(d16, hn::Set(di, (-kWeightOne) * 65536 + kWeightOne));  // (64, -64) a pair
    const auto close = hn::Set(du16, near), nothing = hn::Zero(du16);
    auto least = hn::Set(du16, 32767);
    auto still = hn::Set(du16, 65535);  // 65535 - the largest step
    for (int i = 0; i < kChunkVoxels; i += lanes) {
        const auto d = hn::Load(d16, distances + i);
        const auto hidden = hn::Eq(d, unseen);
        if (hn::AllTrue(d16, hidden)) continue;
        const auto before = hn::Load(d16, sdf + i);
        const auto sum = hn::Load(du16, weight_sum + i);
        const auto total = hn::Add(sum, one);
        const auto step = [&](auto pairs, auto wide_total) {
            const auto product = hn::ConvertTo(df, MultiplyAddPairs(pairs, pair));
            return RoundInRange(hn::Div(product, hn::ConvertTo(df, hn::BitCast(di, wide_total))));
        };
        const auto left = step(hn::InterleaveLower(d16, d, before),
                               hn::InterleaveLower(d16, hn::BitCast(d16, total), zero));
        const auto right = step(hn::InterleaveUpper(d16, d, before),
                                hn::InterleaveUpper(d16, hn::BitCast(d16, total), zero));
        const auto after = hn::Add(before, hn::IfThenZeroElse(hidden, PackRows(left, right)));
        hn::Store(after, d16, sdf + i);
        hn::Store(hn::IfThenElse(hn::RebindMask(du16, hidden), sum, hn::Min(total, most)), du16,
                  weight_sum + i);
        const auto size = hn::BitCast(du16, hn::Abs(after));
        const auto out = hn::BitCast(du16, hn::VecFromMask(d16, hidden));
        least = hn::Min(least, hn::Or(size, out));
        // Steps up to 65534, as differences without sign; 65535 for voxels without weight.
        const auto fresh = hn::VecFromMask(du16, hn::Eq(sum, nothing));
        const auto nearest = hn::Min(size, hn::Or(hn::BitCast(du16, hn::Abs(before)), fresh));
        const auto step_size =
            hn::Or(hn::BitCast(du16, hn::Sub(hn::Max(after, before), hn::Min(after, before))), fresh);
        const auto counts = hn::Eq(hn::Min(nearest, close), nearest);
        still =
            hn::Min(still, hn::Or(hn::Or(hn::Not(step_size), out), hn::Not(hn::VecFromMask(du16, counts))));
    }
    if (moved) *moved = static_cast<std::uint16_t>(65535 - LeastLane(still));
    return LeastLane(least);
}

#endif  // BURIN_HAVE_PACK

template <bool kWeighted>
int Fuse(const std::int16_t* HWY_RESTRICT distances, const std::uint16_t* HWY_RESTRICT weights,
         std::uint16_t max_weight_sum, std::int16_t* HWY_RESTRICT sdf, std::uint16_t* HWY_RESTRICT weight_sum,
         std::uint16_t near, std::uint16_t* moved) {
    const DF df;
    const DI di;
    const D16 d16;
    const DU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto unseen = hn::Set(d16, kUnseen);
    const auto max_weight = hn::Set(di, max_weight_sum), free_i = hn::Set(di, kFree);
    const auto close = hn::Set(di, near), nothing = hn::Zero(di);
    auto least = free_i, most = nothing;
    for (int i = 0; i < kChunkVoxels; i += lanes) {
        const auto d_16 = hn::Load(d16, distances + i);
        if (hn::AllTrue(d16, hn::Eq(d_16, unseen))) continue;
        const auto d = hn::PromoteTo(di, d_16);
        auto w = hn::Set(di, kWeightOne);
        if constexpr (kWeighted) w = hn::PromoteTo(di, hn::Load(du16, weights + i));
        const auto seen = hn::Ne(d, hn::Set(di, kUnseen));
        const auto before = hn::PromoteTo(di, hn::Load(d16, sdf + i));
        const auto sum = hn::PromoteTo(di, hn::Load(du16, weight_sum + i));
        const auto total = hn::Add(sum, w);
        const auto step =
            hn::Div(hn::ConvertTo(df, hn::Mul(w, hn::Sub(d, before))), hn::ConvertTo(df, total));
        auto whole = RoundInRange(step);
        if constexpr (!kWeighted) whole = hn::Min(hn::Max(whole, hn::Set(di, -32768)), hn::Set(di, 32767));
        const auto after = hn::IfThenElse(seen, hn::Add(before, whole), before);
        const auto sum_after = hn::IfThenElse(seen, hn::Min(total, max_weight), sum);
        hn::Store(hn::DemoteTo(d16, after), d16, sdf + i);
        hn::Store(hn::DemoteTo(du16, sum_after), du16, weight_sum + i);
        const auto size = hn::Abs(after);
        least = hn::Min(least, hn::IfThenElse(seen, size, free_i));
        const auto fresh = hn::Eq(sum, nothing);
        const auto nearest = hn::IfThenElse(fresh, size, hn::Min(size, hn::Abs(before)));
        const auto step_size = hn::IfThenElse(fresh, hn::Set(di, 65535), hn::Abs(hn::Sub(after, before)));
        most = hn::Max(most, hn::IfThenElseZero(hn::And(seen, hn::Not(hn::Gt(nearest, close))), step_size));
    }
    if (moved) *moved = static_cast<std::uint16_t>(hn::GetLane(hn::MaxOfLanes(di, most)));
    return hn::GetLane(hn::MinOfLanes(di, least));
}

int FuseDistances(const std::int16_t* distances, const std::uint16_t* weights, std::uint16_t max_weight,
                  std::int16_t* sdf, std::uint16_t* weight_sum, std::uint16_t near, std::uint16_t* moved) {
    if (weights) return Fuse<true>(distances, weights, max_weight, sdf, weight_sum, near, moved);
#if BURIN_HAVE_PACK
    return FuseConstant(distances, max_weight, sdf, weight_sum, near, moved);
#else
    return Fuse<false>(distances, weights, max_weight, sdf, weight_sum, near, moved);
#endif
}

// Rows in 16 bits tell where there is something to carve; only there is it computed.
int CarveDistances(const std::int16_t* HWY_RESTRICT distances, const std::uint16_t* HWY_RESTRICT weights,
                   int times, std::uint16_t max_weight, std::int16_t* HWY_RESTRICT sdf,
                   std::uint16_t* HWY_RESTRICT weight_sum) {
    const DF df;
    const DI di;
    const D16 d16;
    const DU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto free_16 = hn::Set(d16, kFree), none_16 = hn::Zero(d16);
    const auto free_i = hn::Set(di, kFree), most = hn::Set(di, max_weight);
    auto least = free_16;
    bool changed = false;
    for (int i = 0; i < kChunkVoxels; i += lanes) {
        const auto sum_16 = hn::Load(du16, weight_sum + i);
        const auto empty = hn::Eq(hn::BitCast(d16, sum_16), none_16);
        auto value_16 = hn::Load(d16, sdf + i);
        const auto d_16 = hn::Load(d16, distances + i);
        const auto carved_16 =
            hn::And(hn::Eq(d_16, free_16), hn::Not(hn::Or(empty, hn::Eq(value_16, free_16))));
        if (!hn::AllFalse(d16, carved_16)) {
            changed = true;
            const auto value = hn::PromoteTo(di, value_16), sum = hn::PromoteTo(di, sum_16);
            auto w = hn::Set(di, kWeightOne);
            if (weights) w = hn::PromoteTo(di, hn::Load(du16, weights + i));
            w = hn::Mul(w, hn::Set(di, times));
            const auto total = hn::Add(sum, w);
            const auto step =
                hn::Div(hn::ConvertTo(df, hn::Mul(w, hn::Sub(free_i, value))), hn::ConvertTo(df, total));
            const auto after = hn::DemoteTo(d16, hn::Add(value, RoundInRange(step)));
            const auto sum_after = hn::DemoteTo(du16, hn::Min(total, most));
            value_16 = hn::IfThenElse(carved_16, after, value_16);
            hn::Store(value_16, d16, sdf + i);
            hn::Store(hn::IfThenElse(hn::RebindMask(du16, carved_16), sum_after, sum_16), du16,
                      weight_sum + i);
        }
        least = hn::Min(least, hn::IfThenElse(empty, free_16, hn::Abs(value_16)));
    }
    if (!changed) return -1;
    alignas(64) std::int16_t values[hn::MaxLanes(d16)];
    hn::Store(least, d16, values);
    int result = kFree;
    for (int i = 0; i < lanes; ++i) result = values[i] < result ? values[i] : result;
    return result;
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(FuseDistances);
HWY_EXPORT(CarveDistances);

int fuse_distances(const std::int16_t* distances, const std::uint16_t* weights, std::uint16_t max_weight,
                   std::int16_t* sdf, std::uint16_t* weight_sum, std::uint16_t near, std::uint16_t* moved) {
    if (scalar_selected())
        return scalar::fuse_distances(distances, weights, max_weight, sdf, weight_sum, near, moved);
    return BURIN_DISPATCH(FuseDistances)(distances, weights, max_weight, sdf, weight_sum, near, moved);
}

int carve_distances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                    std::uint16_t max_weight, std::int16_t* sdf, std::uint16_t* weight_sum) {
    if (scalar_selected())
        return scalar::carve_distances(distances, weights, times, max_weight, sdf, weight_sum);
    return BURIN_DISPATCH(CarveDistances)(distances, weights, times, max_weight, sdf, weight_sum);
}

}  // namespace burin::simd
#endif
