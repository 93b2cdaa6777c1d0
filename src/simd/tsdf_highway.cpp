// SPDX-License-Identifier: MIT
// The kernels of tsdf.h, many lanes at a time. Bit for bit what tsdf.cpp computes: the same operations in the
// same order a lane, no fused multiply-add, no approximate reciprocal, no sums across lanes.
#include <array>
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

// Shares of an observation (tsdf.h) beside sums of weights, those without weight aside.
HWY_INLINE hn::Vec<DFull16> Shares(hn::Vec<DFullU16> sum) {
    const DF df;
    const DI di;
    const DFull16 d16;
    const DFullU16 du16;
#if HWY_TARGET <= HWY_AVX3
    // While every sum is a whole number of up to 63 observations, from a table.
    alignas(64) static constexpr auto kTable = [] {
        std::array<std::int16_t, 64> table{};  // [0] is for none
        for (int n = 1; n < 64; ++n) {         // to nearest, ties to even: only 32768 / 2^k has none
            const int doubled = 65536 / (n + 1);
            table[static_cast<std::size_t>(n)] = static_cast<std::int16_t>((doubled + 1) / 2);
        }
        return table;
    }();
    if (HWY_LIKELY(_mm512_test_epi16_mask(
                       sum.raw, _mm512_set1_epi16(static_cast<std::int16_t>(~(63 * kWeightOne)))) == 0))
        return hn::Vec<DFull16>{_mm512_permutex2var_epi16(_mm512_load_si512(kTable.data()),
                                                          _mm512_srli_epi16(sum.raw, 6),
                                                          _mm512_load_si512(kTable.data() + 32))};
#endif
    const auto total = hn::Add(sum, hn::Set(du16, kWeightOne));
    const auto share = [&](hn::Vec<DFullU16> wide) HWY_ATTR {
        return RoundInRange(
            hn::Div(hn::Set(df, 32768.0f * kWeightOne), hn::ConvertTo(df, hn::BitCast(di, wide))));
    };
    const auto zero = hn::Zero(du16);
    return hn::ReorderDemote2To(d16, share(hn::InterleaveLower(du16, total, zero)),
                                share(hn::InterleaveUpper(du16, total, zero)));
}

// The common case, every observation weighing kWeightOne, in 16 bits.
int FuseConstant(const std::int16_t* HWY_RESTRICT distances, std::uint16_t max_weight,
                 std::int16_t* HWY_RESTRICT sdf, std::uint16_t* HWY_RESTRICT weight_sum, std::uint16_t near,
                 std::uint16_t* moved) {
    const DFull16 d16;
    const DFullU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(d16));
    const auto unseen = hn::Set(d16, kUnseen);
    const auto one = hn::Set(du16, kWeightOne), heaviest = hn::Set(du16, max_weight);
    const auto close = hn::Set(du16, near), nothing = hn::Zero(du16), all = hn::Set(du16, 65535);
    auto least = hn::Set(du16, 32767), most = nothing;
    for (int i = 0; i < kChunkVoxels; i += lanes) {
        const auto d = hn::Load(d16, distances + i);
        const auto seen = hn::Ne(d, unseen);
        if (hn::AllFalse(d16, seen)) continue;
        const auto seen_u = hn::RebindMask(du16, seen);
        const auto before = hn::Load(d16, sdf + i);
        const auto sum = hn::Load(du16, weight_sum + i);
        const auto fresh = hn::Eq(sum, nothing);
        const auto share = Shares(sum);
        const auto step = hn::SaturatedSub(hn::MulFixedPoint15(d, share), hn::MulFixedPoint15(before, share));
        const auto after = hn::IfThenElse(hn::RebindMask(d16, fresh), d, hn::Add(before, step));
        hn::Store(hn::IfThenElse(seen, after, before), d16, sdf + i);
        hn::Store(hn::IfThenElse(seen_u, hn::Min(hn::Add(sum, one), heaviest), sum), du16, weight_sum + i);
        const auto size = hn::BitCast(du16, hn::Abs(after));
        least = hn::IfThenElse(seen_u, hn::Min(least, size), least);
        // Of a voxel without weight, only where it arrives counts, and the step is 65535.
        const auto nearest = hn::IfThenElse(fresh, size, hn::Min(size, hn::BitCast(du16, hn::Abs(before))));
        const auto step_size = hn::IfThenElse(fresh, all, hn::BitCast(du16, hn::Abs(step)));
        const auto counts = hn::And(seen_u, hn::Eq(hn::Min(nearest, close), nearest));
        most = hn::IfThenElse(counts, hn::Max(most, step_size), most);
    }
    if (moved) *moved = static_cast<std::uint16_t>(65535 - LeastLane(hn::Not(most)));
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
        const auto fresh = hn::Eq(sum, nothing);
        auto whole = hn::Zero(di);
        if constexpr (kWeighted) {
            whole = RoundInRange(
                hn::Div(hn::ConvertTo(df, hn::Mul(w, hn::Sub(d, before))), hn::ConvertTo(df, total)));
        } else {
            const auto share =
                RoundInRange(hn::Div(hn::Set(df, 32768.0f * kWeightOne), hn::ConvertTo(df, total)));
            const auto scaled = [&](hn::Vec<DI> v) HWY_ATTR {
                return hn::ShiftRight<15>(hn::Add(hn::Mul(v, share), hn::Set(di, 16384)));
            };
            const auto step = hn::Sub(scaled(d), scaled(before));
            whole = hn::IfThenElse(fresh, hn::Sub(d, before),
                                   hn::Min(hn::Max(step, hn::Set(di, -32768)), hn::Set(di, 32767)));
        }
        const auto after = hn::IfThenElse(seen, hn::Add(before, whole), before);
        const auto sum_after = hn::IfThenElse(seen, hn::Min(total, max_weight), sum);
        hn::Store(hn::DemoteTo(d16, after), d16, sdf + i);
        hn::Store(hn::DemoteTo(du16, sum_after), du16, weight_sum + i);
        const auto size = hn::Abs(after);
        least = hn::Min(least, hn::IfThenElse(seen, size, free_i));
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
    // Not over the lanes in memory: of such a loop GCC 12 makes one that, with SVE vectors of 512 bits,
    // returns too much.
    return hn::GetLane(hn::MinOfLanes(di, hn::PromoteTo(di, least)));
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
