// SPDX-License-Identifier: MIT
// observe_chunk of tsdf.h, many lanes at a time. Bit for bit what tsdf.cpp computes: the same operations in
// the same order a lane, no fused multiply-add, no approximate reciprocal.
//
// Chunks projected by groups, most of them: tsdf_groups-inl.h. For the others there are two ways to the same
// result. `Careful` follows the specification to the letter. Chunks farther away than the truncation need no
// test for missing depth, since a missing reading (0) fails the band test by itself: `Simple`.
#include <cstring>

#include "simd/tsdf.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/tsdf_observe_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"
#include "simd/tsdf_groups-inl.h"
#include "simd/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

Observation ObserveChunk(const DepthProjection& frame, const ProjectedChunk& chunk, std::int16_t* distances,
                         std::uint16_t* weights, const void*) {
    return scalar::observe_chunk(frame, chunk, distances, weights);
}

#else

// The vectors of SVE have no size known to the compiler: none is a member or an element of an array here, but
// where only other targets compile it.

// The nearest pixels of `lanes` voxels of a block, and their depths. kClip: clipped to the border; else all
// fall into the image. For chunks that are `far`.
template <bool kClip>
HWY_INLINE void Project(const DepthProjection& frame, const ProjectedChunk& chunk, int block, int at,
                        hn::Vec<DI>* column, hn::Vec<DI>* row, hn::Vec<DF>* z_out) {
    const DF df;
    const ProjectiveOffsets::Block& offsets = frame.offsets.block[block];
    const auto z = hn::Add(hn::Set(df, chunk.z), hn::Load(df, offsets.z + at));
    const auto inverse_z = hn::Div(hn::Set(df, 1.0f), z);
    auto u = hn::Mul(hn::Add(hn::Set(df, chunk.u), hn::Load(df, offsets.u + at)), inverse_z);
    auto v = hn::Mul(hn::Add(hn::Set(df, chunk.v), hn::Load(df, offsets.v + at)), inverse_z);
    if constexpr (kClip) {
        u = hn::Min(hn::Max(u, hn::Zero(df)), hn::Set(df, static_cast<float>(frame.width) + 1.0f));
        v = hn::Min(hn::Max(v, hn::Zero(df)), hn::Set(df, static_cast<float>(frame.height) + 1.0f));
    }
    *column = RoundInRange(u);
    *row = RoundInRange(v);
    *z_out = z;
}

// What the band test finds, over whole rows in 16 bits.
#if BURIN_HAVE_PACK
struct Found {
    hn::Vec<DFull16> band, most;
    HWY_INLINE Found() : band(hn::Set(DFull16(), -32768)), most(band) {}
    HWY_INLINE void Add(hn::Vec<DFull16> d) {
        // d + 1 wraps kFree to -32768 and takes kUnseen to -32767: only the band lies above.
        band = hn::Max(band, hn::Add(d, hn::Set(DFull16(), 1)));
        most = hn::Max(most, d);
    }
    HWY_INLINE void Add(hn::Vec<DI> left, hn::Vec<DI> right) { Add(PackRows(left, right)); }
    HWY_INLINE Observation Get() const {
        const DFull16 d;
        return {!hn::AllFalse(d, hn::Gt(band, hn::Set(d, -32767))),
                !hn::AllFalse(d, hn::Eq(most, hn::Set(d, kFree)))};
    }
};
#elif HWY_HAVE_SCALABLE
struct Found {
    Observation seen{false, false};
    HWY_INLINE void Add(hn::Vec<DI> d) {
        const DI di;
        seen.touched |=
            !hn::AllFalse(di, hn::And(hn::Gt(d, hn::Set(di, kUnseen)), hn::Lt(d, hn::Set(di, kFree))));
        seen.free |= !hn::AllFalse(di, hn::Gt(d, hn::Set(di, kFree - 1)));
    }
    HWY_INLINE void Add(hn::Vec<DI> left, hn::Vec<DI> right) {
        Add(left);
        Add(right);
    }
    HWY_INLINE Observation Get() const { return seen; }
};
#else
struct Found {
    hn::Vec<DI> band, most;
    HWY_INLINE Found() : band(hn::Set(DI(), -32768)), most(band) {}
    HWY_INLINE void Add(hn::Vec<DI> d) {
        band = hn::Max(band, hn::IfThenElse(hn::Gt(hn::Set(DI(), kFree), d), d, hn::Set(DI(), kUnseen)));
        most = hn::Max(most, d);
    }
    HWY_INLINE void Add(hn::Vec<DI> left, hn::Vec<DI> right) {
        const auto low = hn::Set(DI(), kUnseen), high = hn::Set(DI(), kFree);
        Add(hn::Min(hn::Max(left, low), high));
        Add(hn::Min(hn::Max(right, low), high));
    }
    HWY_INLINE Observation Get() const {
        const DI d;
        return {!hn::AllFalse(d, hn::Gt(band, hn::Set(d, kUnseen))),
                !hn::AllFalse(d, hn::Eq(most, hn::Set(d, kFree)))};
    }
};
#endif

// Pixel indices of all voxels, in processing order, clipped to the border.
HWY_INLINE void ClippedPixels(const DepthProjection& frame, const ProjectedChunk& chunk, float least_z,
                              std::int32_t* pixel) {
    const DF df;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto zero = hn::Zero(df), one = hn::Set(df, 1.0f);
    const auto u_max = hn::Set(df, static_cast<float>(frame.width) + 1.0f);
    const auto v_max = hn::Set(df, static_cast<float>(frame.height) + 1.0f);
    const auto stride = hn::Set(di, frame.stride);
    for (const ProjectiveOffsets::Block& block : frame.offsets.block)
        for (int at = 0; at < kBlockVoxels; at += lanes) {
            const auto z = hn::Add(hn::Set(df, chunk.z), hn::Load(df, block.z + at));
            const auto inverse_z = hn::Div(one, hn::Max(z, hn::Set(df, least_z)));
            const auto u = hn::Mul(hn::Add(hn::Set(df, chunk.u), hn::Load(df, block.u + at)), inverse_z);
            const auto v = hn::Mul(hn::Add(hn::Set(df, chunk.v), hn::Load(df, block.v + at)), inverse_z);
            const auto column = RoundInRange(hn::Min(hn::Max(u, zero), u_max));
            const auto row = RoundInRange(hn::Min(hn::Max(v, zero), v_max));
            hn::Store(hn::Add(hn::Mul(row, stride), column), di, pixel);
            pixel += lanes;
        }
}

// drop_factor of tsdf.cpp.
HWY_INLINE hn::Vec<DI> DropFactor(Drop drop, hn::Vec<DF> behind, hn::Vec<DF> start, hn::Vec<DF> tau) {
    const DF df;
    const auto one = hn::Set(df, 1.0f);
    const auto x = hn::Mul(hn::Sub(behind, start), hn::Div(one, hn::Sub(tau, start)));
    auto y = hn::Sub(one, x);
    if (drop == Drop::exponential) {
        y = hn::Sub(one, hn::Mul(hn::Mul(hn::Set(df, 5.0f / 16.0f), x), x));
        y = hn::Mul(y, y);
        y = hn::Mul(y, y);
        y = hn::Mul(y, y);
        y = hn::Mul(y, y);
    }
    return RoundInRange(hn::Mul(hn::Set(df, 256.0f), y));
}

template <bool kQuadratic, bool kWeighted>
Observation Careful(const DepthProjection& frame, const ProjectedChunk& chunk,
                    std::int16_t* HWY_RESTRICT distances, std::uint16_t* HWY_RESTRICT weights) {
    const DF df;
    const DI di;
    const DU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const float to_units = frame.truncation.units_per_m(), least_z = kLeastZ * to_units;
    alignas(64) std::int32_t pixel[kChunkVoxels];
    alignas(64) std::uint16_t raw[kChunkVoxels], pixel_weight[kWeighted ? kChunkVoxels : 16];
    ClippedPixels(frame, chunk, least_z, pixel);
    for (int i = 0; i < kChunkVoxels; i += 4) LookUp4(frame.pixels, pixel + i, raw + i);
    if (kWeighted && frame.weights)
        for (int i = 0; i < kChunkVoxels; i += 4) LookUp4(frame.weights, pixel + i, pixel_weight + i);

    const auto zero = hn::Zero(df), unit = hn::Set(df, frame.unit_m * to_units),
               scale = hn::Set(df, 32767.0f), lowest = hn::Set(df, -32768.0f),
               scale_m = hn::Set(df, to_units), start = hn::Set(df, frame.drop_start_m * to_units),
               along = hn::Set(df, chunk.along);
    const auto free_i = hn::Set(di, kFree), unseen = hn::Set(di, kUnseen);
    Observation seen{false, false};
    for (int row = 0; row < kSlabs * kBlockVoxels;
         row += lanes) {  // of 4, through the left blocks of all slabs
        const int slab = row / kBlockVoxels, at = row % kBlockVoxels;
        const auto distance_of = [&](int half, hn::Vec<DI>* weight) HWY_ATTR {
            const int i = (2 * slab + half) * kBlockVoxels + at;
            const auto z =
                hn::Add(hn::Set(df, chunk.z), hn::Load(df, frame.offsets.block[2 * slab + half].z + at));
            const auto reading = hn::ConvertTo(df, hn::PromoteTo(di, hn::Load(du16, raw + i)));
            const auto s = hn::Mul(hn::Sub(hn::Mul(reading, unit), z), along);
            auto tau = scale;
            if constexpr (kQuadratic) {
                const TruncationModel& t = frame.truncation;
                const auto depth_m = hn::Mul(reading, hn::Set(df, frame.unit_m));
                const auto noise =
                    hn::Add(hn::Mul(hn::Add(hn::Mul(hn::Set(df, t.a), depth_m), hn::Set(df, t.b)), depth_m),
                            hn::Set(df, t.c));
                tau = hn::Mul(hn::Max(hn::Set(df, t.floor_m), noise), scale_m);
            }
            auto hit = hn::And(hn::Ne(reading, zero), hn::Gt(z, hn::Set(df, least_z)));
            if constexpr (kQuadratic) hit = hn::And(hit, hn::Gt(s, hn::Neg(tau)));
            const auto rounded = RoundInRange(hn::Min(hn::Max(s, lowest), scale));
            auto distance = hn::IfThenElse(hn::RebindMask(di, hit), rounded, unseen);
            auto band = hn::And(hn::Ne(distance, unseen), hn::Ne(distance, free_i));
            if constexpr (kQuadratic) band = hn::And(band, hn::RebindMask(di, hn::Lt(s, tau)));
            seen.touched |= !hn::AllFalse(di, band);
            seen.free |= !hn::AllFalse(di, hn::Eq(distance, free_i));
            if constexpr (kWeighted) {
                auto w = frame.weights ? hn::PromoteTo(di, hn::Load(du16, pixel_weight + i))
                                       : hn::Set(di, kWeightOne);
                if (frame.drop != Drop::none) {
                    const auto behind = hn::Neg(s);
                    const auto factor = DropFactor(frame.drop, behind, start, tau);
                    const auto dropped = hn::ShiftRight<8>(hn::Mul(w, factor));
                    const auto applies =
                        hn::And(hn::Ne(distance, unseen), hn::RebindMask(di, hn::Gt(behind, start)));
                    w = hn::IfThenElse(applies, dropped, w);
                }
                distance = hn::IfThenElse(hn::Eq(w, hn::Zero(di)), unseen, distance);
                *weight = w;
            }
            return distance;
        };
        auto left_weight = hn::Zero(di), right_weight = left_weight;
        const auto left = distance_of(0, &left_weight), right = distance_of(1, &right_weight);
        StoreRows(left, right, distances + 2 * row);
        if constexpr (kWeighted)  // below 2^15
            StoreRows(left_weight, right_weight, reinterpret_cast<std::int16_t*>(weights) + 2 * row);
    }
    return seen;
}

// Distances, not yet narrowed, from readings and the voxels' own depths. kAlong false: along == 1.
template <bool kAlong>
HWY_INLINE hn::Vec<DI> Distance(hn::Vec<DI> reading, hn::Vec<DF> unit, hn::Vec<DF> z, hn::Vec<DF> along) {
    const auto s = hn::Sub(hn::Mul(hn::ConvertTo(DF(), reading), unit), z);
    return RoundInRange(kAlong ? hn::Mul(s, along) : s);
}

template <bool kAlong, bool kClip>
Observation Simple(const DepthProjection& frame, const ProjectedChunk& chunk,
                   std::int16_t* HWY_RESTRICT distances, const char* ahead) {
    const DF df;
    const DI di;
    const DU16 du16;
    const int lanes = static_cast<int>(hn::Lanes(df));
    alignas(64) std::int32_t pixel[kChunkVoxels];
    alignas(64) std::uint16_t raw[kChunkVoxels];
    const auto stride = hn::Set(di, frame.stride);
    std::int32_t* next = pixel;
    for (int block = 0; block < kBlocks; block += 2) {
        AskFor(ahead + 64 * block);
        for (int at = 0; at < kBlockVoxels; at += lanes)
            for (int half = 0; half < 2; ++half, next += lanes) {
                hn::Vec<DI> column, row;
                hn::Vec<DF> z;
                Project<kClip>(frame, chunk, block + half, at, &column, &row, &z);
                hn::Store(hn::Add(hn::Mul(row, stride), column), di, next);
            }
    }
    for (int i = 0; i < kChunkVoxels; i += 4) LookUp4(frame.pixels, pixel + i, raw + i);
    const auto unit = hn::Set(df, frame.unit_m * frame.truncation.units_per_m()),
               base_z = hn::Set(df, chunk.z), along = hn::Set(df, chunk.along);
    Found found;
    const std::uint16_t* reading = raw;
    for (int block = 0; block < kBlocks; block += 2)
        for (int at = 0; at < kBlockVoxels; at += lanes) {
            const auto distance_of = [&](int half) HWY_ATTR {
                const auto z = hn::Add(base_z, hn::Load(df, frame.offsets.block[block + half].z + at));
                return Distance<kAlong>(hn::PromoteTo(di, hn::Load(du16, reading + half * lanes)), unit, z,
                                        along);
            };
            const auto left = distance_of(0), right = distance_of(1);
            reading += 2 * lanes;
            found.Add(left, right);
            StoreRows(left, right, distances + block * kBlockVoxels + 2 * at);
        }
    return found.Get();
}

Observation ObserveChunk(const DepthProjection& frame, const ProjectedChunk& chunk, std::int16_t* distances,
                         std::uint16_t* weights, const void* ahead) {
    const bool quadratic = frame.truncation.quadratic, weighted = frame.weighted();
    if (weighted)
        return quadratic ? Careful<true, true>(frame, chunk, distances, weights)
                         : Careful<false, true>(frame, chunk, distances, weights);
    if (quadratic) return Careful<true, false>(frame, chunk, distances, weights);

    const auto* next = static_cast<const char*>(ahead ? ahead : distances);
    if (chunk.pixels == Pixels::narrow) return Groups<Pixels::narrow>(frame, chunk, distances, next);
    if (chunk.pixels == Pixels::wide) return Groups<Pixels::wide>(frame, chunk, distances, next);
    if (!chunk.far) return Careful<false, false>(frame, chunk, distances, weights);
    if (chunk.along != 1.0f)
        return chunk.inside ? Simple<true, false>(frame, chunk, distances, next)
                            : Simple<true, true>(frame, chunk, distances, next);
    return chunk.inside ? Simple<false, false>(frame, chunk, distances, next)
                        : Simple<false, true>(frame, chunk, distances, next);
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(ObserveChunk);

Observation observe_chunk(const DepthProjection& frame, const ProjectedChunk& chunk, std::int16_t* distances,
                          std::uint16_t* weights, const void* ahead) {
    if (scalar_selected()) return scalar::observe_chunk(frame, chunk, distances, weights, ahead);
    return BURIN_DISPATCH(ObserveChunk)(frame, chunk, distances, weights, ahead);
}

}  // namespace burin::simd
#endif
