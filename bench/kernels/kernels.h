// SPDX-License-Identifier: MIT
// Benchmarks of src/simd: one file a family, one line in CMakeLists.txt, and in the file
//     const bool registered = on_every_target("my_kernel", [](benchmark::State& state) { ... });
// Every kernel then runs on every target of this build and machine: my_kernel/avx2, my_kernel/scalar, ...
#pragma once

#include <benchmark/benchmark.h>

#include <string>

#include "simd/targets.h"

namespace burin::bench {

template <class Body>
bool on_every_target(const std::string& name, Body body) {
    for (const std::string& target : simd::target_names())
        benchmark::RegisterBenchmark((name + "/" + target).c_str(), [target, body](benchmark::State& state) {
            if (!simd::select_target(target)) state.SkipWithError("target not available");
            body(state);
            simd::select_target("");
        });
    return true;
}

}  // namespace burin::bench
