// SPDX-License-Identifier: MIT
// classify.h, up to 32 voxels a vector.
#include "simd/classify.h"
#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/classify_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

void ClassifyChunk(const std::int16_t* HWY_RESTRICT sdf, const std::uint16_t* HWY_RESTRICT weight, int planes,
                   CellLimits limits, ChunkBits* HWY_RESTRICT bits) {
#if HWY_TARGET == HWY_SCALAR
    scalar::classify_chunk(sdf, weight, planes, limits, bits);
#else
    namespace hn = hwy::HWY_NAMESPACE;
#if HWY_HAVE_SCALABLE
    const hn::CappedTag<std::int16_t, 8> di;
#else
    const hn::CappedTag<std::int16_t, 32> di;
#endif
    const hn::RebindToUnsigned<decltype(di)> du;
    const int lanes = static_cast<int>(hn::Lanes(di));
    const auto least = hn::Set(du, limits.min_weight);
    const auto zero = hn::Zero(di), deep = hn::Set(di, limits.deep), high = hn::Set(di, limits.high);
    // Bit i of a word is in byte i / 8: little-endian machines only, as the map file.
    auto* known = reinterpret_cast<std::uint8_t*>(bits->known);
    auto* inside = reinterpret_cast<std::uint8_t*>(bits->inside);
    auto* far_below = reinterpret_cast<std::uint8_t*>(bits->deep);
    auto* far_above = reinterpret_cast<std::uint8_t*>(bits->high);
    for (int i = 0; i < 64 * planes; i += lanes) {
        const auto w = hn::Load(du, weight + i);
        const auto s = hn::Load(di, sdf + i);
        // w >= least, as max(w, least) == w: not every target compares unsigned lanes by order.
        hn::StoreMaskBits(du, hn::Eq(hn::Max(w, least), w), known + i / 8);
        hn::StoreMaskBits(di, hn::Lt(s, zero), inside + i / 8);
        hn::StoreMaskBits(di, hn::Lt(s, deep), far_below + i / 8);
        hn::StoreMaskBits(di, hn::Gt(s, high), far_above + i / 8);
    }
#endif
}

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(ClassifyChunk);

void classify_chunk(const std::int16_t* sdf, const std::uint16_t* weight, int planes, CellLimits limits,
                    ChunkBits* bits) {
    if (scalar_selected()) return scalar::classify_chunk(sdf, weight, planes, limits, bits);
    BURIN_DISPATCH(ClassifyChunk)(sdf, weight, planes, limits, bits);
}

}  // namespace burin::simd
#endif
