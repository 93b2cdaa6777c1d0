// SPDX-License-Identifier: MIT
#include "roofline/vectors.h"

#if defined(BURIN_SCALAR_ONLY)

namespace burin::bench {

void increment(std::uint32_t* array, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) ++array[i];
}

double multiply_and_add(int steps) {
    float x[8] = {1, 2, 3, 4, 5, 6, 7, 8};
    volatile float a = 0.5f, b = 1;
    const float factor = a, term = b;
    for (int i = 0; i < steps; ++i)
        for (float& value : x) value = value * factor + term;
    for (const float value : x) a = a + value;
    return 16.0 * steps;
}

}  // namespace burin::bench

#else

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "roofline/vectors.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"

HWY_BEFORE_NAMESPACE();
namespace burin::bench::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void Increment(std::uint32_t* HWY_RESTRICT array, std::size_t count) {
    const hn::CappedTag<std::uint32_t, 16> d;
    const auto one = hn::Set(d, 1u);
    for (std::size_t i = 0; i < count; i += hn::Lanes(d))
        hn::Store(hn::Add(hn::Load(d, array + i), one), d, array + i);
}

double MultiplyAndAdd(int steps) {
    const hn::CappedTag<float, 16> d;
    // Ten chains: latency (3 to 4 cycles each for the two operations) times throughput (2 a cycle at most),
    // and few enough for 16 registers.
    volatile float start = 1, factor = 0.5f;
    const auto a = hn::Set(d, factor), b = hn::Set(d, start);
    auto x0 = b, x1 = a, x2 = b, x3 = a, x4 = b, x5 = a, x6 = b, x7 = a, x8 = b, x9 = a;
    for (int i = 0; i < steps; ++i) {
        x0 = hn::Add(hn::Mul(x0, a), b), x1 = hn::Add(hn::Mul(x1, a), b);
        x2 = hn::Add(hn::Mul(x2, a), b), x3 = hn::Add(hn::Mul(x3, a), b);
        x4 = hn::Add(hn::Mul(x4, a), b), x5 = hn::Add(hn::Mul(x5, a), b);
        x6 = hn::Add(hn::Mul(x6, a), b), x7 = hn::Add(hn::Mul(x7, a), b);
        x8 = hn::Add(hn::Mul(x8, a), b), x9 = hn::Add(hn::Mul(x9, a), b);
    }
    const auto sum = hn::Add(hn::Add(hn::Add(x0, x1), hn::Add(x2, x3)),
                             hn::Add(hn::Add(hn::Add(x4, x5), hn::Add(x6, x7)), hn::Add(x8, x9)));
    start = hn::GetLane(sum);  // keeps the loop
    return 20.0 * static_cast<double>(hn::Lanes(d)) * steps;
}

}  // namespace burin::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::bench {

HWY_EXPORT(Increment);
HWY_EXPORT(MultiplyAndAdd);

void increment(std::uint32_t* array, std::size_t count) { BURIN_DISPATCH(Increment)(array, count); }
double multiply_and_add(int steps) { return BURIN_DISPATCH(MultiplyAndAdd)(steps); }

}  // namespace burin::bench
#endif

#endif
