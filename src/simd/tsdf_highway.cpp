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

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

Observation ObserveChunk(const DepthWindow& window, const ProjectiveOffsets& offsets, ProjectiveBase base,
                         const TruncationModel& truncation, std::int16_t* distances, std::uint16_t* weights) {
    return scalar::observe_chunk(window, offsets, base, truncation, distances, weights);
}
int FuseDistances(const std::int16_t* distances, const std::uint16_t* weights, const FuseModel& model,
                  std::int16_t* sdf, std::uint16_t* weight_sum) {
    return scalar::fuse_distances(distances, weights, model, sdf, weight_sum);
}
int CarveDistances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                   const FuseModel& model, std::int16_t* sdf, std::uint16_t* weight_sum) {
    return scalar::carve_distances(distances, weights, times, model, sdf, weight_sum);
}
void FuseColours(const std::int16_t* distances, const ColourWindow& window, const ProjectiveOffsets& offsets,
                 ProjectiveBase base, const ColourModel& model, std::uint8_t* colours) {
    scalar::fuse_colours(distances, window, offsets, base, model, colours);
}

#else

namespace hn = hwy::HWY_NAMESPACE;
// At most 16 lanes, so that wider machines (SVE) keep the small arrays below small too.
using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using DU = hn::RebindToUnsigned<DF>;
using D16 = hn::Rebind<std::int16_t, DF>;
using DU16 = hn::Rebind<std::uint16_t, DF>;

template <bool kQuadratic>
Observation Observe(const DepthWindow& window, const ProjectiveOffsets& offsets, ProjectiveBase base,
                    const TruncationModel& truncation, std::int16_t* HWY_RESTRICT distances,
                    std::uint16_t* weights) {
    const DF df;
    const DI di;
    const D16 d16;
    const DU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(df));
    alignas(64) std::int32_t pixel[kChunkVoxels];
    alignas(64) std::uint16_t raw[kChunkVoxels];

    const auto zero = hn::Zero(df), one = hn::Set(df, 1.0f), half = hn::Set(df, 1.5f),
               least_z = hn::Set(df, kLeastZ);
    const auto u_max = hn::Set(df, static_cast<float>(window.width) + 1.0f);
    const auto v_max = hn::Set(df, static_cast<float>(window.height) + 1.0f);
    const auto base_u = hn::Set(df, base.u), base_v = hn::Set(df, base.v), base_z = hn::Set(df, base.z);
    const auto stride = hn::Set(di, window.stride);
    for (int i = 0; i < kChunkVoxels; i += lanes) {
        const auto z = hn::Add(base_z, hn::Load(df, offsets.z + i));
        const auto inverse_z = hn::Div(one, hn::Max(z, least_z));
        const auto u = hn::Add(hn::Mul(hn::Add(base_u, hn::Load(df, offsets.u + i)), inverse_z), half);
        const auto v = hn::Add(hn::Mul(hn::Add(base_v, hn::Load(df, offsets.v + i)), inverse_z), half);
        const auto column = hn::ConvertTo(di, hn::Min(hn::Max(u, zero), u_max));
        const auto row = hn::ConvertTo(di, hn::Min(hn::Max(v, zero), v_max));
        hn::Store(hn::Add(hn::Mul(row, stride), column), di, pixel + i);
    }
    // Plain loads: faster than a hardware gather on Zen 3, as fast elsewhere.
    for (int i = 0; i < kChunkVoxels; ++i) raw[i] = window.pixels[pixel[i]];
    if (weights)
        for (int i = 0; i < kChunkVoxels; ++i) weights[i] = window.weights[pixel[i]];

    const auto unit = hn::Set(df, window.unit_m);
    const auto truncation_m = hn::Set(df, truncation.truncation_m);
    const auto to_units = hn::Set(df, 32767.0f / truncation.truncation_m);
    const auto free_f = hn::Set(df, 32767.0f);
    const auto free_i = hn::Set(di, kFree), unseen_i = hn::Set(di, kUnseen);
    auto most = unseen_i;  // largest distance: kFree tells of free voxels
    auto in_band = hn::MaskFromVec(hn::Zero(di));
    for (int i = 0; i < kChunkVoxels; i += lanes) {
        const auto z = hn::Add(base_z, hn::Load(df, offsets.z + i));
        const auto reading = hn::PromoteTo(di, hn::Load(du16, raw + i));
        const auto depth_m = hn::Mul(hn::ConvertTo(df, reading), unit);
        auto tau = truncation_m;
        if constexpr (kQuadratic) {
            const auto a = hn::Set(df, truncation.a), b = hn::Set(df, truncation.b),
                       c = hn::Set(df, truncation.c);
            const auto noise = hn::Add(hn::Mul(hn::Add(hn::Mul(a, depth_m), b), depth_m), c);
            tau = hn::Max(hn::Set(df, truncation.floor_m), noise);
        }
        const auto s = hn::Sub(depth_m, z);
        const auto hit = hn::And(hn::And(hn::Ne(depth_m, zero), hn::Gt(s, hn::Neg(tau))), hn::Gt(z, least_z));
        const auto rounded = hn::NearestInt(hn::Min(hn::Mul(s, to_units), free_f));
        const auto distance = hn::IfThenElse(hn::RebindMask(di, hit), rounded, unseen_i);
        hn::Store(hn::DemoteTo(d16, distance), d16, distances + i);
        most = hn::Max(most, distance);
        auto band = hn::And(hn::RebindMask(di, hit), hn::Ne(distance, free_i));
        if constexpr (kQuadratic) band = hn::And(band, hn::RebindMask(di, hn::Lt(s, tau)));
        in_band = hn::Or(in_band, band);
    }
    return {!hn::AllFalse(di, in_band), !hn::AllFalse(di, hn::Eq(most, free_i))};
}

Observation ObserveChunk(const DepthWindow& window, const ProjectiveOffsets& offsets, ProjectiveBase base,
                         const TruncationModel& truncation, std::int16_t* distances, std::uint16_t* weights) {
    return truncation.quadratic ? Observe<true>(window, offsets, base, truncation, distances, weights)
                                : Observe<false>(window, offsets, base, truncation, distances, weights);
}

// drop_factor of tsdf.cpp.
template <Drop kDrop>
HWY_INLINE hn::Vec<DI> DropFactor(hn::Vec<DF> behind, hn::Vec<DF> start, hn::Vec<DF> scale) {
    const DF df;
    const DI di;
    const auto one = hn::Set(df, 1.0f), full = hn::Set(df, 256.0f);
    const auto x = hn::Mul(hn::Sub(behind, start), scale);
    auto y = hn::Sub(one, x);
    if constexpr (kDrop == Drop::exponential) {
        y = hn::Sub(one, hn::Mul(hn::Mul(hn::Set(df, 5.0f / 16.0f), x), x));
        y = hn::Mul(y, y);
        y = hn::Mul(y, y);
        y = hn::Mul(y, y);
        y = hn::Mul(y, y);
    }
    const auto factor = hn::NearestInt(hn::Mul(full, y));
    return hn::IfThenElse(hn::RebindMask(di, hn::Le(behind, start)), hn::Set(di, 256), factor);
}

template <Drop kDrop, bool kWeighted>
int Fuse(const std::int16_t* HWY_RESTRICT distances, const std::uint16_t* HWY_RESTRICT weights,
         const FuseModel& model, std::int16_t* HWY_RESTRICT sdf, std::uint16_t* HWY_RESTRICT weight_sum) {
    const DF df;
    const DI di;
    const D16 d16;
    const DU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto start = hn::Set(df, model.drop_start), scale = hn::Set(df, model.drop_scale);
    const auto unseen = hn::Set(d16, kUnseen);
    const auto max_weight = hn::Set(di, model.max_weight), zero = hn::Zero(di), free_i = hn::Set(di, kFree);
    auto least = free_i;
    for (int i = 0; i < kChunkVoxels; i += lanes) {
        const auto d_16 = hn::Load(d16, distances + i);
        if (hn::AllTrue(d16, hn::Eq(d_16, unseen))) continue;
        const auto d = hn::PromoteTo(di, d_16);
        auto w = hn::Set(di, kWeightOne);
        if constexpr (kWeighted) w = hn::PromoteTo(di, hn::Load(du16, weights + i));
        if constexpr (kDrop != Drop::none) {
            const auto factor = DropFactor<kDrop>(hn::ConvertTo(df, hn::Neg(d)), start, scale);
            w = hn::ShiftRight<8>(hn::Mul(w, factor));
        }
        const auto seen = hn::And(hn::Ne(d, hn::Set(di, kUnseen)), hn::Gt(w, zero));
        const auto before = hn::PromoteTo(di, hn::Load(d16, sdf + i));
        const auto sum = hn::PromoteTo(di, hn::Load(du16, weight_sum + i));
        const auto total = hn::Add(sum, w);
        const auto step = hn::Div(hn::Mul(hn::ConvertTo(df, w), hn::ConvertTo(df, hn::Sub(d, before))),
                                  hn::ConvertTo(df, total));
        const auto after = hn::IfThenElse(seen, hn::Add(before, hn::NearestInt(step)), before);
        const auto sum_after = hn::IfThenElse(seen, hn::Min(total, max_weight), sum);
        hn::Store(hn::DemoteTo(d16, after), d16, sdf + i);
        hn::Store(hn::DemoteTo(du16, sum_after), du16, weight_sum + i);
        least = hn::Min(least, hn::IfThenElse(seen, hn::Abs(after), free_i));
    }
    return hn::GetLane(hn::MinOfLanes(di, least));
}

int FuseDistances(const std::int16_t* distances, const std::uint16_t* weights, const FuseModel& model,
                  std::int16_t* sdf, std::uint16_t* weight_sum) {
    const auto with = [&](auto fuse_plain, auto fuse_weighted) {
        return weights ? fuse_weighted(distances, weights, model, sdf, weight_sum)
                       : fuse_plain(distances, weights, model, sdf, weight_sum);
    };
    switch (model.drop) {
        case Drop::linear:
            return with(Fuse<Drop::linear, false>, Fuse<Drop::linear, true>);
        case Drop::exponential:
            return with(Fuse<Drop::exponential, false>, Fuse<Drop::exponential, true>);
        case Drop::none:
            break;
    }
    return with(Fuse<Drop::none, false>, Fuse<Drop::none, true>);
}

int CarveDistances(const std::int16_t* HWY_RESTRICT distances, const std::uint16_t* HWY_RESTRICT weights,
                   int times, const FuseModel& model, std::int16_t* HWY_RESTRICT sdf,
                   std::uint16_t* HWY_RESTRICT weight_sum) {
    const DF df;
    const DI di;
    const D16 d16;
    const DU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto free_i = hn::Set(di, kFree), zero = hn::Zero(di), max_weight = hn::Set(di, model.max_weight);
    auto least = free_i;
    bool changed = false;
    for (int i = 0; i < kChunkVoxels; i += lanes) {
        const auto sum = hn::PromoteTo(di, hn::Load(du16, weight_sum + i));
        const auto observed = hn::Gt(sum, zero);
        if (hn::AllFalse(di, observed)) continue;
        auto value = hn::PromoteTo(di, hn::Load(d16, sdf + i));
        const auto d = hn::PromoteTo(di, hn::Load(d16, distances + i));
        const auto carved = hn::And(observed, hn::And(hn::Eq(d, free_i), hn::Ne(value, free_i)));
        if (!hn::AllFalse(di, carved)) {
            changed = true;
            auto w = hn::Set(di, kWeightOne);
            if (weights) w = hn::PromoteTo(di, hn::Load(du16, weights + i));
            w = hn::Mul(w, hn::Set(di, times));
            const auto total = hn::Add(sum, w);
            const auto step = hn::Div(hn::Mul(hn::ConvertTo(df, w), hn::ConvertTo(df, hn::Sub(d, value))),
                                      hn::ConvertTo(df, total));
            value = hn::IfThenElse(carved, hn::Add(value, hn::NearestInt(step)), value);
            const auto sum_after = hn::IfThenElse(carved, hn::Min(total, max_weight), sum);
            hn::Store(hn::DemoteTo(d16, value), d16, sdf + i);
            hn::Store(hn::DemoteTo(du16, sum_after), du16, weight_sum + i);
        }
        least = hn::Min(least, hn::IfThenElse(observed, hn::Abs(value), free_i));
    }
    return changed ? hn::GetLane(hn::MinOfLanes(di, least)) : -1;
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
             const ProjectiveOffsets& offsets, ProjectiveBase base, const ColourModel& model,
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

void FuseColours(const std::int16_t* distances, const ColourWindow& window, const ProjectiveOffsets& offsets,
                 ProjectiveBase base, const ColourModel& model, std::uint8_t* colours) {
    window.distorted ? Colours<true>(distances, window, offsets, base, model, colours)
                     : Colours<false>(distances, window, offsets, base, model, colours);
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(ObserveChunk);
HWY_EXPORT(FuseDistances);
HWY_EXPORT(CarveDistances);
HWY_EXPORT(FuseColours);

Observation observe_chunk(const DepthWindow& window, const ProjectiveOffsets& offsets, ProjectiveBase base,
                          const TruncationModel& truncation, std::int16_t* distances,
                          std::uint16_t* weights) {
    if (scalar_selected())
        return scalar::observe_chunk(window, offsets, base, truncation, distances, weights);
    return BURIN_DISPATCH(ObserveChunk)(window, offsets, base, truncation, distances, weights);
}

int fuse_distances(const std::int16_t* distances, const std::uint16_t* weights, const FuseModel& model,
                   std::int16_t* sdf, std::uint16_t* weight_sum) {
    if (scalar_selected()) return scalar::fuse_distances(distances, weights, model, sdf, weight_sum);
    return BURIN_DISPATCH(FuseDistances)(distances, weights, model, sdf, weight_sum);
}

int carve_distances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                    const FuseModel& model, std::int16_t* sdf, std::uint16_t* weight_sum) {
    if (scalar_selected()) return scalar::carve_distances(distances, weights, times, model, sdf, weight_sum);
    return BURIN_DISPATCH(CarveDistances)(distances, weights, times, model, sdf, weight_sum);
}

void fuse_colours(const std::int16_t* distances, const ColourWindow& window, const ProjectiveOffsets& offsets,
                  ProjectiveBase base, const ColourModel& model, std::uint8_t* colours) {
    if (scalar_selected()) return scalar::fuse_colours(distances, window, offsets, base, model, colours);
    BURIN_DISPATCH(FuseColours)(distances, window, offsets, base, model, colours);
}

}  // namespace burin::simd
#endif
