// SPDX-License-Identifier: MIT
// classify.h, a row of eight voxels a vector.
#include "simd/classify.h"
#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/classify_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

void ClassifyRows(const std::int16_t* sdf, const std::uint16_t* weight, int first, int step, int count,
                  std::uint16_t min_weight, std::uint8_t* known, std::uint8_t* inside) {
#if HWY_TARGET == HWY_SCALAR
    scalar::classify_rows(sdf, weight, first, step, count, min_weight, known, inside);
#else
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::FixedTag<std::int16_t, 8> di;
    const hn::FixedTag<std::uint16_t, 8> du;
    const auto least = hn::Set(du, min_weight);
    const auto zero = hn::Zero(di);
    for (int i = 0; i < count; ++i) {
        const int row = 8 * (first + i * step);
        const auto w = hn::Load(du, weight + row);
        // w >= least, as max(w, least) == w: not every target compares unsigned lanes by order.
        std::uint8_t bits[8];
        hn::StoreMaskBits(du, hn::Eq(hn::Max(w, least), w), bits);
        known[i] = bits[0];
        hn::StoreMaskBits(di, hn::Lt(hn::Load(di, sdf + row), zero), bits);
        inside[i] = bits[0];
    }
#endif
}

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(ClassifyRows);

void classify_rows(const std::int16_t* sdf, const std::uint16_t* weight, int first, int step, int count,
                   std::uint16_t min_weight, std::uint8_t* known, std::uint8_t* inside) {
    if (scalar_selected())
        return scalar::classify_rows(sdf, weight, first, step, count, min_weight, known, inside);
    BURIN_DISPATCH(ClassifyRows)(sdf, weight, first, step, count, min_weight, known, inside);
}

}  // namespace burin::simd
#endif
