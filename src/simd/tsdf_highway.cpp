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
                  std::int16_t* sdf, std::uint16_t* weight_sum) {
    return scalar::fuse_distances(distances, weights, max_weight, sdf, weight_sum);
}
int CarveDistances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                   std::uint16_t max_weight, std::int16_t* sdf, std::uint16_t* weight_sum) {
    return scalar::carve_distances(distances, weights, times, max_weight, sdf, weight_sum);
}
void FuseColours(const std::int16_t* distances, const ColourWindow& window, const ColourOffsets& offsets,
                 ProjectiveBase base, const ColourModel& model, std::uint8_t* colours) {
    scalar::fuse_colours(distances, window, offsets, base, model, colours);
}

#else

#if BURIN_HAVE_PACK

// The common case, every observation weighing kWeightOne: sums and minima in 16 bits; 64 (distance - sdf) by one
// multiply-add of interleaved pairs.
int FuseConstant(const std::int16_t* HWY_RESTRICT distances, std::uint16_t max_weight,
                 std::int16_t* HWY_RESTRICT sdf, std::uint16_t* HWY_RESTRICT weight_sum) {
    const DF df;
    const DI di;
    const DFull16 d16;
    const DFullU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(d16));
    const auto unseen = hn::Set(d16, kUnseen), zero = hn::Zero(d16);
    const auto one = hn::Set(du16, kWeightOne), most = hn::Set(du16, max_weight);
    const auto pair = hn::BitCast(d16, hn::Set(di, (-kWeightOne) * 65536 + kWeightOne));  // (64, -64) a pair
    auto least = hn::Set(du16, 32767);
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
        hn::Store(hn::IfThenElse(hn::RebindMask(du16, hidden), sum, hn::Min(total, most)), du16, weight_sum + i);
        const auto size = hn::BitCast(du16, hn::Abs(after));
        least = hn::Min(least, hn::Or(size, hn::BitCast(du16, hn::VecFromMask(d16, hidden))));
    }
    return LeastLane(least);
}

#endif  // BURIN_HAVE_PACK

template <bool kWeighted>
int Fuse(const std::int16_t* HWY_RESTRICT distances, const std::uint16_t* HWY_RESTRICT weights,
         std::uint16_t max_weight_sum, std::int16_t* HWY_RESTRICT sdf, std::uint16_t* HWY_RESTRICT weight_sum) {
    const DF df;
    const DI di;
    const D16 d16;
    const DU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto unseen = hn::Set(d16, kUnseen);
    const auto max_weight = hn::Set(di, max_weight_sum), free_i = hn::Set(di, kFree);
    auto least = free_i;
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
        const auto after = hn::IfThenElse(seen, hn::Add(before, RoundInRange(step)), before);
        const auto sum_after = hn::IfThenElse(seen, hn::Min(total, max_weight), sum);
        hn::Store(hn::DemoteTo(d16, after), d16, sdf + i);
        hn::Store(hn::DemoteTo(du16, sum_after), du16, weight_sum + i);
        least = hn::Min(least, hn::IfThenElse(seen, hn::Abs(after), free_i));
    }
    return hn::GetLane(hn::MinOfLanes(di, least));
}

int FuseDistances(const std::int16_t* distances, const std::uint16_t* weights, std::uint16_t max_weight,
                  std::int16_t* sdf, std::uint16_t* weight_sum) {
    if (weights) return Fuse<true>(distances, weights, max_weight, sdf, weight_sum);
#if BURIN_HAVE_PACK
    return FuseConstant(distances, max_weight, sdf, weight_sum);
#else
    return Fuse<false>(distances, weights, max_weight, sdf, weight_sum);
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
        const auto carved_16 = hn::And(hn::Eq(d_16, free_16), hn::Not(hn::Or(empty, hn::Eq(value_16, free_16))));
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
            hn::Store(hn::IfThenElse(hn::RebindMask(du16, carved_16), sum_after, sum_16), du16, weight_sum + i);
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

// Four bytes at base + offset a lane; offsets need no alignment.
HWY_INLINE hn::Vec<DI> GatherBytes(const std::uint8_t* base, hn::Vec<DI> offsets) {
    const DI di;
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3
    return hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(base),
                            offsets);  // the instruction takes any address
#else
    alignas(64) std::int32_t at[16], value[16];
    hn::Store(offsets, di, at);
    for (std::size_t k = 0; k < hn::Lanes(di); ++k) std::memcpy(&value[k], base + at[k], 4);
    return hn::Load(di, value);
#endif
}

template <bool kDistorted>
void Colours(const std::int16_t* HWY_RESTRICT distances, const ColourWindow& window,
             const ColourOffsets& offsets, ProjectiveBase base, const ColourModel& model,
             std::uint8_t* colours) {
    const DF df;
    const DI di;
    const D16 d16;
    const int lanes = static_cast<int>(hn::Lanes(df));
    auto* packed = reinterpret_cast<std::int32_t*>(colours);
    const auto band = hn::Set(di, model.band);
    const auto one = hn::Set(df, 1.0f), two = hn::Set(df, 2.0f), half = hn::Set(df, 0.5f),
               zero = hn::Zero(df), least_z = hn::Set(df, kLeastZ);
    const auto width = hn::Set(df, static_cast<float>(window.width)),
               height = hn::Set(df, static_cast<float>(window.height));
    const auto last =
        hn::Set(di, static_cast<std::int32_t>((window.height - 1) * window.stride + 3 * window.width - 4));
    const auto stride = hn::Set(di, static_cast<std::int32_t>(window.stride));
    const auto low_byte = hn::Set(di, 255);
    const auto frame_threshold = hn::Set(di, static_cast<std::int32_t>(model.frame * 101u & 255u));
    for (int i = 0; i < kChunkVoxels; i += lanes) {
        const auto d = hn::PromoteTo(di, hn::Load(d16, distances + i));
        auto wanted = hn::Not(hn::Gt(hn::Abs(d), band));
        if (hn::AllFalse(di, wanted)) continue;
        const auto z = hn::Add(hn::Set(df, base.z), hn::Load(df, offsets.z + i));
        const auto inverse_z = hn::Div(one, hn::Max(z, least_z));
        auto u = hn::Mul(hn::Add(hn::Set(df, base.u), hn::Load(df, offsets.u + i)), inverse_z);
        auto v = hn::Mul(hn::Add(hn::Set(df, base.v), hn::Load(df, offsets.v + i)), inverse_z);
        if constexpr (kDistorted) {
            const auto fx = hn::Set(df, window.fx), fy = hn::Set(df, window.fy), cx = hn::Set(df, window.cx),
                       cy = hn::Set(df, window.cy);
            const auto p1 = hn::Set(df, window.p1), p2 = hn::Set(df, window.p2);
            const auto x = hn::Div(hn::Sub(u, cx), fx), y = hn::Div(hn::Sub(v, cy), fy);
            const auto xx = hn::Mul(x, x), yy = hn::Mul(y, y), r2 = hn::Add(xx, yy),
                       two_xy = hn::Mul(two, hn::Mul(x, y));
            const auto inner = hn::Add(hn::Set(df, window.k2), hn::Mul(r2, hn::Set(df, window.k3)));
            const auto radial =
                hn::Add(one, hn::Mul(r2, hn::Add(hn::Set(df, window.k1), hn::Mul(r2, inner))));
            const auto tangent_x = hn::Add(hn::Mul(p1, two_xy), hn::Mul(p2, hn::Add(r2, hn::Mul(two, xx))));
            const auto tangent_y = hn::Add(hn::Mul(p1, hn::Add(r2, hn::Mul(two, yy))), hn::Mul(p2, two_xy));
            u = hn::Add(hn::Mul(fx, hn::Add(hn::Mul(x, radial), tangent_x)), cx);
            v = hn::Add(hn::Mul(fy, hn::Add(hn::Mul(y, radial), tangent_y)), cy);
        }
        u = hn::Add(u, half);
        v = hn::Add(v, half);
        const auto inside = hn::And(hn::And(hn::Gt(z, least_z), hn::And(hn::Ge(u, zero), hn::Ge(v, zero))),
                                    hn::And(hn::Lt(u, width), hn::Lt(v, height)));
        const auto column = hn::ConvertTo(di, hn::IfThenElseZero(inside, u)),
                   row = hn::ConvertTo(di, hn::IfThenElseZero(inside, v));
        const auto offset = hn::Add(hn::Mul(row, stride), hn::Add(column, hn::Add(column, column)));
        wanted = hn::And(wanted, hn::And(hn::RebindMask(di, inside), hn::Not(hn::Gt(offset, last))));
        const auto reading = GatherBytes(window.rgb, hn::IfThenElseZero(wanted, offset));

        const auto colour = hn::Load(di, packed + i);
        const auto count = hn::And(hn::ShiftRight<24>(colour), low_byte);
        const auto scale = hn::Div(hn::Set(df, 256.0f), hn::ConvertTo(df, hn::Add(count, hn::Set(di, 1))));
        const auto threshold =
            hn::And(hn::Add(hn::Mul(hn::Iota(di, i), hn::Set(di, 167)), frame_threshold), low_byte);
        const auto mean = [&](auto c, auto r) {
            const auto sum = hn::Add(hn::Mul(hn::And(c, low_byte), count), hn::And(r, low_byte));
            const auto scaled = hn::ConvertTo(di, hn::Mul(hn::ConvertTo(df, sum), scale));
            return hn::Min(hn::ShiftRight<8>(hn::Add(scaled, threshold)), low_byte);
        };
        const auto red = mean(colour, reading);
        const auto green = mean(hn::ShiftRight<8>(colour), hn::ShiftRight<8>(reading));
        const auto blue = mean(hn::ShiftRight<16>(colour), hn::ShiftRight<16>(reading));
        const auto more = hn::Min(hn::Add(count, hn::Set(di, 1)), hn::Set(di, kColourMemory));
        const auto result = hn::Or(hn::Or(red, hn::ShiftLeft<8>(green)),
                                   hn::Or(hn::ShiftLeft<16>(blue), hn::ShiftLeft<24>(more)));
        hn::Store(hn::IfThenElse(wanted, result, colour), di, packed + i);
    }
}

void FuseColours(const std::int16_t* distances, const ColourWindow& window, const ColourOffsets& offsets,
                 ProjectiveBase base, const ColourModel& model, std::uint8_t* colours) {
    window.distorted ? Colours<true>(distances, window, offsets, base, model, colours)
                     : Colours<false>(distances, window, offsets, base, model, colours);
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(FuseDistances);
HWY_EXPORT(CarveDistances);
HWY_EXPORT(FuseColours);

int fuse_distances(const std::int16_t* distances, const std::uint16_t* weights, std::uint16_t max_weight,
                   std::int16_t* sdf, std::uint16_t* weight_sum) {
    if (scalar_selected()) return scalar::fuse_distances(distances, weights, max_weight, sdf, weight_sum);
    return BURIN_DISPATCH(FuseDistances)(distances, weights, max_weight, sdf, weight_sum);
}

int carve_distances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                    std::uint16_t max_weight, std::int16_t* sdf, std::uint16_t* weight_sum) {
    if (scalar_selected()) return scalar::carve_distances(distances, weights, times, max_weight, sdf, weight_sum);
    return BURIN_DISPATCH(CarveDistances)(distances, weights, times, max_weight, sdf, weight_sum);
}

void fuse_colours(const std::int16_t* distances, const ColourWindow& window, const ColourOffsets& offsets,
                  ProjectiveBase base, const ColourModel& model, std::uint8_t* colours) {
    if (scalar_selected()) return scalar::fuse_colours(distances, window, offsets, base, model, colours);
    BURIN_DISPATCH(FuseColours)(distances, window, offsets, base, model, colours);
}

}  // namespace burin::simd
#endif
