// SPDX-License-Identifier: MIT
// A benchmark once a target, the specification last: its time over the others' is what the vectors gain.
#pragma once

#include <benchmark/benchmark.h>

#include <string>

#include "simd/targets.h"

namespace burin {

template <class Body>
void bench_every_target(const std::string& name, Body body) {
    for (const std::string& target : simd::target_names())
        benchmark::RegisterBenchmark((name + "/" + target).c_str(), [target, body](benchmark::State& state) {
            if (!simd::select_target(target)) state.SkipWithError("no such target");
            body(state);
        })->Unit(benchmark::kMicrosecond);
}

inline int run_benchmarks(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}

}  // namespace burin
