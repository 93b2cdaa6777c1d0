// SPDX-License-Identifier: MIT
// The loops behind machine.h in the vectors that the kernels use.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin::bench {

// array[i] += 1. `count` a multiple of 64, the array aligned to 64.
void increment(std::uint32_t* array, std::size_t count);

// x = x a + b in independent registers, `steps` times; returns how many operations that was.
double multiply_and_add(int steps);

}  // namespace burin::bench
