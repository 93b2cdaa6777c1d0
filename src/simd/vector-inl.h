// SPDX-License-Identifier: MIT
// Vector helpers that several kernel files share. Included after <hwy/highway.h>, once a target.
#if defined(BURIN_SIMD_VECTOR_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BURIN_SIMD_VECTOR_INL_H_
#undef BURIN_SIMD_VECTOR_INL_H_
#else
#define BURIN_SIMD_VECTOR_INL_H_
#endif

#include <cstdint>
#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {
#if HWY_TARGET != HWY_SCALAR

namespace hn = hwy::HWY_NAMESPACE;

// At most 16 lanes of 32 bits. On targets whose vectors have no fixed size (SVE) four, so that the layouts in
// tsdf.h and small arrays fit.
#if HWY_HAVE_SCALABLE
using DF = hn::CappedTag<float, 4>;
#else
using DF = hn::CappedTag<float, 16>;
#endif
using DI = hn::RebindToSigned<DF>;
using DU = hn::RebindToUnsigned<DF>;
using D16 = hn::Rebind<std::int16_t, DF>;
using DU16 = hn::Rebind<std::uint16_t, DF>;

// Nearest integer, ties to even, for |v| < 2^31: hn::NearestInt without its care for larger ones.
HWY_INLINE hn::Vec<DI> RoundInRange(hn::Vec<DF> v) {
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
    return hn::Vec<DI>{_mm512_cvtps_epi32(v.raw)};
#elif HWY_TARGET == HWY_AVX2
    return hn::Vec<DI>{_mm256_cvtps_epi32(v.raw)};
#elif HWY_TARGET == HWY_SSE4
    return hn::Vec<DI>{_mm_cvtps_epi32(v.raw)};
#else
    return hn::NearestInt(v);
#endif
}

// Whole numbers of 0 <= v < 2^31, rounded down.
HWY_INLINE hn::Vec<DI> TruncateInRange(hn::Vec<DF> v) {
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
    return hn::Vec<DI>{_mm512_cvttps_epi32(v.raw)};
#elif HWY_TARGET == HWY_AVX2
    return hn::Vec<DI>{_mm256_cvttps_epi32(v.raw)};
#elif HWY_TARGET == HWY_SSE4
    return hn::Vec<DI>{_mm_cvttps_epi32(v.raw)};
#else
    return hn::ConvertTo(DI(), v);
#endif
}

#undef BURIN_HAVE_PACK
#if HWY_ARCH_X86 && HWY_TARGET != HWY_EMU128
#define BURIN_HAVE_PACK 1
using DFull16 = hn::Repartition<std::int16_t, DF>;
using DFullU16 = hn::Repartition<std::uint16_t, DF>;
// Left halves (x 0..3) and right halves (x 4..7) of rows of eight, saturated to 16 bits, as whole rows.
HWY_INLINE hn::Vec<DFull16> PackRows(hn::Vec<DI> left, hn::Vec<DI> right) {
    return hn::ReorderDemote2To(DFull16(), left, right);
}

// Sums of products of neighbouring pairs of 16 bits.
HWY_INLINE hn::Vec<DI> MultiplyAddPairs(hn::Vec<DFull16> a, hn::Vec<DFull16> b) {
#if HWY_TARGET <= HWY_AVX3
    return hn::Vec<DI>{_mm512_madd_epi16(a.raw, b.raw)};
#elif HWY_TARGET == HWY_AVX2
    return hn::Vec<DI>{_mm256_madd_epi16(a.raw, b.raw)};
#else
    return hn::Vec<DI>{_mm_madd_epi16(a.raw, b.raw)};
#endif
}

HWY_INLINE int LeastLane(hn::Vec<DFullU16> v) {
#if HWY_TARGET <= HWY_AVX3
    const __m256i half = _mm256_min_epu16(_mm512_castsi512_si256(v.raw), _mm512_extracti64x4_epi64(v.raw, 1));
#elif HWY_TARGET == HWY_AVX2
    const __m256i half = v.raw;
#endif
#if HWY_TARGET <= HWY_AVX2
    const __m128i quarter = _mm_min_epu16(_mm256_castsi256_si128(half), _mm256_extracti128_si256(half, 1));
#else
    const __m128i quarter = v.raw;
#endif
    return _mm_extract_epi16(_mm_minpos_epu16(quarter), 0);
}
using DFull16Part = DFull16;
#else
#define BURIN_HAVE_PACK 0
using DFull16Part = D16;
#endif

// The same, stored to `to` (two vectors' worth of rows; aligned to their size).
HWY_INLINE void StoreRows(hn::Vec<DI> left, hn::Vec<DI> right, std::int16_t* to) {
#if BURIN_HAVE_PACK
    hn::Store(PackRows(left, right), DFull16(), to);
#else
    const D16 d16;
    static_assert(hn::MaxLanes(DF()) == 4);
    hn::Store(hn::DemoteTo(d16, left), d16, to);
    hn::Store(hn::DemoteTo(d16, right), d16, to + 4);
#endif
}

// A share of what is wanted next, asked for piece by piece.
HWY_INLINE void AskFor(const char* bytes) {
    __builtin_prefetch(bytes, 1, 3);
    __builtin_prefetch(bytes + 64, 1, 3);
}

// Four lookups at a time: `at` holds four indices of 32 bits, the results go to `to` as four of 16.
HWY_INLINE void LookUp4(const std::uint16_t* HWY_RESTRICT table, const std::int32_t* HWY_RESTRICT at,
                        std::uint16_t* HWY_RESTRICT to) {
    std::uint64_t a, b;
    std::memcpy(&a, at, 8);
    std::memcpy(&b, at + 2, 8);
    const std::uint64_t four =
        std::uint64_t{table[static_cast<std::uint32_t>(a)]} | std::uint64_t{table[a >> 32]} << 16 |
        std::uint64_t{table[static_cast<std::uint32_t>(b)]} << 32 | std::uint64_t{table[b >> 32]} << 48;
    std::memcpy(to, &four, 8);
}

// The same with indices of 16 bits.
HWY_INLINE void LookUp4(const std::uint16_t* HWY_RESTRICT table, const std::uint16_t* HWY_RESTRICT at,
                        std::uint16_t* HWY_RESTRICT to) {
    std::uint64_t four;
    std::memcpy(&four, at, 8);
    four = std::uint64_t{table[four & 0xffff]} | std::uint64_t{table[four >> 16 & 0xffff]} << 16 |
           std::uint64_t{table[four >> 32 & 0xffff]} << 32 | std::uint64_t{table[four >> 48]} << 48;
    std::memcpy(to, &four, 8);
}

#endif  // HWY_SCALAR
}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
