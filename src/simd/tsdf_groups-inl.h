// SPDX-License-Identifier: MIT
// observe_groups of tsdf.h, a vector of 16 bits at a time. Included by tsdf_observe_highway.cpp, once a
// target.
#if defined(BURIN_SIMD_TSDF_GROUPS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BURIN_SIMD_TSDF_GROUPS_INL_H_
#undef BURIN_SIMD_TSDF_GROUPS_INL_H_
#else
#define BURIN_SIMD_TSDF_GROUPS_INL_H_
#endif

#include "simd/tsdf_groups.h"
#include "simd/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {
#if HWY_TARGET != HWY_SCALAR

// Whole vectors of 16 bits beside DF; eight lanes where vectors have no size known to the compiler.
#if HWY_HAVE_SCALABLE
using DG = hn::CappedTag<std::int16_t, 8>;
#else
using DG = hn::Repartition<std::int16_t, DF>;
#endif
using DGU = hn::RebindToUnsigned<DG>;

// Of all groups, each value twice in 32 bits, so that one load fills a vector of 16 bits with it.
struct Middles {
    alignas(64) std::int32_t u[kGroups], v[kGroups], across[kGroups], shear_u[kGroups], shear_v[kGroups];
    alignas(64) std::int32_t depth[kGroups], rest[kGroups], corner[kGroups];
};

HWY_INLINE hn::Vec<DI> Twice(hn::Vec<DI> v) {
    const DI di;
    return hn::Or(hn::And(v, hn::Set(di, 0xffff)), hn::ShiftLeft<16>(v));
}

template <Pixels kPixels>
HWY_INLINE void FindMiddles(const DepthProjection& frame, const ProjectedChunk& chunk,
                            const GroupScale& scale, Middles* middles) {
    const DF df;
    const DI di;
    const GroupOffsets& groups = frame.groups;
    constexpr int kSide = window_side(kPixels);
    constexpr float kSteps = pixel_steps(kPixels);
    const auto one = hn::Set(df, 1.0f), zero = hn::Zero(df), steps = hn::Set(df, kSteps),
               half = hn::Set(df, 0.5f);
    const auto back = hn::Set(df, 0.5f * kSide - 0.5f);
    const auto last_column = hn::Set(df, static_cast<float>(frame.width + 2 - kSide)),
               last_row = hn::Set(df, static_cast<float>(frame.height + 2 - kSide));
    const auto centre_u = hn::Set(df, groups.centre_u), centre_v = hn::Set(df, groups.centre_v);
    const auto most_across = hn::Set(df, groups.most_across * kSteps),
               most_z = hn::Set(df, groups.most_z * kSteps);
    const auto unit = hn::Set(df, scale.unit), inverse_unit = hn::Set(df, 1.0f / scale.unit);
    const auto to_half = hn::Set(df, scale.half_unit * (1.0f / scale.unit));
    for (int g = 0; g < kGroups; g += static_cast<int>(hn::Lanes(df))) {
        const auto z = hn::Add(hn::Set(df, chunk.z), hn::Load(df, groups.middle_z + g));
        const auto inverse_z = hn::Div(one, z);
        const auto u = hn::Mul(hn::Add(hn::Set(df, chunk.u), hn::Load(df, groups.middle_u + g)), inverse_z);
        const auto v = hn::Mul(hn::Add(hn::Set(df, chunk.v), hn::Load(df, groups.middle_v + g)), inverse_z);
        const auto column = RoundInRange(hn::Min(hn::Max(hn::Sub(u, back), zero), last_column));
        const auto row = RoundInRange(hn::Min(hn::Max(hn::Sub(v, back), zero), last_row));
        hn::Store(hn::Add(hn::Mul(row, hn::Set(di, frame.stride)), column), di, middles->corner + g);
        const auto inside = [&](auto at, auto corner) HWY_ATTR {
            return Twice(RoundInRange(hn::Mul(hn::Add(hn::Sub(at, hn::ConvertTo(df, corner)), half), steps)));
        };
        hn::Store(inside(u, column), di, middles->u + g);
        hn::Store(inside(v, row), di, middles->v + g);
        hn::Store(Twice(RoundInRange(hn::Mul(most_across, inverse_z))), di, middles->across + g);
        const auto shear = [&](auto centre, auto at) HWY_ATTR {
            return Twice(RoundInRange(hn::Mul(hn::Mul(hn::Sub(centre, at), most_z), inverse_z)));
        };
        hn::Store(shear(centre_u, u), di, middles->shear_u + g);
        hn::Store(shear(centre_v, v), di, middles->shear_v + g);
        const auto depth = RoundInRange(hn::Min(hn::Mul(z, inverse_unit), hn::Set(df, 65535.0f)));
        const auto lacks = hn::Mul(hn::Sub(hn::Mul(hn::ConvertTo(df, depth), unit), z), to_half);
        const auto rest =
            RoundInRange(hn::Min(hn::Max(lacks, hn::Set(df, -32767.0f)), hn::Set(df, 16000.0f)));
        // Readings and depths are compared as numbers with sign.
        hn::Store(Twice(hn::Xor(depth, hn::Set(di, 0x8000))), di, middles->depth + g);
        hn::Store(Twice(rest), di, middles->rest + g);
    }
}

HWY_INLINE hn::Vec<DG> Everywhere(const std::int32_t* twice) {
    const DG dg;
    const hn::Repartition<std::int32_t, DG> d32;
    return hn::BitCast(dg, hn::Set(d32, *twice));
}

// Rows and columns in the window, as whole numbers, of the voxels from lane `at` on.
template <Pixels kPixels>
HWY_INLINE void FindPixels(const GroupOffsets& groups, const Middles& middles, int g, int at,
                           hn::Vec<DGU>* column, hn::Vec<DGU>* row) {
    const DG dg;
    const DGU dgu;
    const auto z = hn::Load(dg, groups.z + at), across = Everywhere(middles.across + g);
    const auto place = [&](const std::int16_t* offsets, const std::int32_t* middle,
                           const std::int32_t* shear) HWY_ATTR {
        const auto moved = hn::Add(hn::MulFixedPoint15(hn::Load(dg, offsets + at), across),
                                   hn::MulFixedPoint15(z, Everywhere(shear + g)));
        return hn::ShiftRight<pixel_bits(kPixels)>(hn::BitCast(dgu, hn::Add(Everywhere(middle + g), moved)));
    };
    *column = place(groups.across_u, middles.u, middles.shear_u);
    *row = place(groups.across_v, middles.v, middles.shear_v);
}

// Distances from readings.
HWY_INLINE hn::Vec<DG> GroupDistances(const GroupOffsets& groups, const Middles& middles,
                                      const GroupScale& scale, int g, int at, hn::Vec<DGU> readings) {
    const DG dg;
    const auto set = [dg](int v) HWY_ATTR { return hn::Set(dg, static_cast<std::int16_t>(v)); };
    const auto raw = hn::Xor(hn::BitCast(dg, readings), set(-32768));
    const auto limit = set(scale.limit);
    const auto steps =
        hn::Min(hn::Max(hn::SaturatedSub(raw, Everywhere(middles.depth + g)), set(-scale.limit)), limit);
    const auto deeper = hn::SaturatedSub(hn::MulFixedPoint15(hn::Load(dg, groups.z + at), set(scale.slope)),
                                         Everywhere(middles.rest + g));
    const auto far =
        hn::Add(hn::Mul(steps, set(scale.whole)), hn::MulFixedPoint15(steps, set(scale.fraction)));
    const auto half = hn::SaturatedSub(far, deeper);
    return hn::SaturatedAdd(half, half);
}

// Left and right groups to rows of the chunk, at = 8 y within the group.
HWY_INLINE void StoreGroups(hn::Vec<DG> left, hn::Vec<DG> right, int g, int at, std::int16_t* distances) {
    const DG dg;
    const hn::Repartition<std::uint64_t, DG> d64;
    const auto l = hn::BitCast(d64, left), r = hn::BitCast(d64, right);
    std::int16_t* to = distances + 128 * (g >> 2) + 32 * (g >> 1 & 1) + at;
    hn::Store(hn::BitCast(dg, hn::InterleaveLower(d64, l, r)), dg, to);
    hn::Store(hn::BitCast(dg, hn::InterleaveUpper(d64, l, r)), dg, to + 64);
}

#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86

// A window of pixels in registers, as tables of 64.
template <Pixels kPixels>
struct Window;

template <>
struct Window<Pixels::narrow> {
    __m512i table[2];

    HWY_INLINE Window(const std::uint16_t* from, std::ptrdiff_t stride) {
        for (int i = 0; i < 2; ++i, from += 4 * stride) {
            const auto two = [stride](const std::uint16_t* q) HWY_ATTR {
                return _mm256_inserti128_si256(
                    _mm256_castsi128_si256(_mm_loadu_si128(reinterpret_cast<const __m128i*>(q))),
                    _mm_loadu_si128(reinterpret_cast<const __m128i*>(q + stride)), 1);
            };
            table[i] = _mm512_inserti64x4(_mm512_castsi256_si512(two(from)), two(from + 2 * stride), 1);
        }
    }
    HWY_INLINE __m512i operator()(__m512i column, __m512i row) const {
        return _mm512_permutex2var_epi16(table[0], _mm512_or_si512(_mm512_slli_epi16(row, 3), column),
                                         table[1]);
    }
};

template <>
struct Window<Pixels::wide> {
    __m512i table[8];

    HWY_INLINE Window(const std::uint16_t* from, std::ptrdiff_t stride) {
        for (int i = 0; i < 8; ++i, from += 2 * stride)
            table[i] = _mm512_inserti64x4(
                _mm512_castsi256_si512(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from))),
                _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from + stride)), 1);
    }
    HWY_INLINE __m512i operator()(__m512i column, __m512i row) const {
        const __m512i index = _mm512_or_si512(_mm512_slli_epi16(row, 4), column);  // 8 bits
        const __mmask32 second = _mm512_test_epi16_mask(index, _mm512_set1_epi16(64)),
                        upper = _mm512_test_epi16_mask(index, _mm512_set1_epi16(128));
        const auto look_up = [&](int i) HWY_ATTR {
            return _mm512_permutex2var_epi16(table[i], index, table[i + 1]);
        };
        const __m512i low = _mm512_mask_mov_epi16(look_up(0), second, look_up(2));
        const __m512i high = _mm512_mask_mov_epi16(look_up(4), second, look_up(6));
        return _mm512_mask_mov_epi16(low, upper, high);
    }
};

#endif

template <Pixels kPixels>
Observation Groups(const DepthProjection& frame, const ProjectedChunk& chunk,
                   std::int16_t* HWY_RESTRICT distances, const char* ahead) {
    const DG dg;
    const DGU dgu;
    const GroupOffsets& groups = frame.groups;
    const GroupScale scale(frame, chunk.along);
    const int lanes = static_cast<int>(hn::Lanes(dg));
    Middles middles;
    FindMiddles<kPixels>(frame, chunk, scale, &middles);
    // d + 1 wraps kFree to -32768 and takes kUnseen to -32767: only the band lies above.
    auto band = hn::Set(dg, -32768), most = band;
    const auto one = hn::Set(dg, 1);
    const auto put = [&](hn::Vec<DG> left, hn::Vec<DG> right, int g, int at) HWY_ATTR {
        band = hn::Max(band, hn::Max(hn::Add(left, one), hn::Add(right, one)));
        most = hn::Max(most, hn::Max(left, right));
        StoreGroups(left, right, g, at, distances);
    };
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
    static_assert(hn::MaxLanes(DG()) == kGroupVoxels);
    (void)lanes;
    (void)dgu;
    const auto distances_of = [&](int g) HWY_ATTR {
        hn::Vec<DGU> column, row;
        FindPixels<kPixels>(groups, middles, g, 0, &column, &row);
        const Window<kPixels> window(frame.pixels + middles.corner[g], frame.stride);
        return GroupDistances(groups, middles, scale, g, 0, hn::Vec<DGU>{window(column.raw, row.raw)});
    };
    for (int g = 0; g < kGroups; g += 2) {
        AskFor(ahead + 128 * g);
        AskFor(ahead + 128 * g + 128);
        const auto left = distances_of(g), right = distances_of(g + 1);
        put(left, right, g, 0);
    }
#else
    alignas(64) std::uint16_t offset[kChunkVoxels], reading[kChunkVoxels];
    const auto stride = hn::Set(dgu, static_cast<std::uint16_t>(frame.stride));
    for (int g = 0; g < kGroups; ++g) {
        AskFor(ahead + 128 * g);
        for (int at = 0; at < kGroupVoxels; at += lanes) {
            auto column = hn::Zero(dgu), row = column;
            FindPixels<kPixels>(groups, middles, g, at, &column, &row);
            hn::Store(hn::Add(hn::Mul(row, stride), column), dgu, offset + kGroupVoxels * g + at);
        }
    }
    for (int g = 0; g < kGroups; ++g)
        for (int i = kGroupVoxels * g; i < kGroupVoxels * (g + 1); i += 4)
            LookUp4(frame.pixels + middles.corner[g], offset + i, reading + i);
    for (int g = 0; g < kGroups; g += 2)
        for (int at = 0; at < kGroupVoxels; at += lanes) {
            const auto distances_of = [&](int side) HWY_ATTR {
                return GroupDistances(groups, middles, scale, side, at,
                                      hn::Load(dgu, reading + kGroupVoxels * side + at));
            };
            put(distances_of(g), distances_of(g + 1), g, at);
        }
#endif
    return {!hn::AllFalse(dg, hn::Gt(band, hn::Set(dg, -32767))),
            !hn::AllFalse(dg, hn::Eq(most, hn::Set(dg, kFree)))};
}

#endif  // HWY_SCALAR
}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
