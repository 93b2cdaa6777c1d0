// SPDX-License-Identifier: MIT
#include "roofline/machine.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "roofline/vectors.h"
#include "support/frames.h"

namespace burin::bench {
namespace {

// Far above the last-level cache of anything this runs on (32 MiB here, 96 MiB on the largest desktops).
constexpr std::size_t kBytes = std::size_t{256} << 20;
constexpr int kPasses = 8;

std::uint32_t* big_array() {
    static std::uint32_t* array = [] {
        void* memory =
            mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
        return memory == MAP_FAILED ? nullptr : static_cast<std::uint32_t*>(memory);
    }();
    return array;
}

}  // namespace

double inplace_bytes_per_second() {
    std::uint32_t* array = big_array();
    if (!array) return 0;
    double best_ms = 1e30;
    for (int i = 0; i < kPasses; ++i) {
        const double start = cpu_ms();
        increment(array, kBytes / sizeof *array);
        best_ms = std::min(best_ms, cpu_ms() - start);
    }
    return 2e3 * static_cast<double>(kBytes) / best_ms;
}

double float_operations_per_second() {
    constexpr int kSteps = 1 << 20;
    double best = 0;
    for (int i = 0; i < kPasses; ++i) {
        const double start = cpu_ms();
        const double operations = multiply_and_add(kSteps);
        best = std::max(best, operations / (cpu_ms() - start));
    }
    return 1e3 * best;
}

void evict_caches() {
    std::uint32_t* array = big_array();
    if (array) increment(array, kBytes / 2 / sizeof *array);
}

}  // namespace burin::bench
