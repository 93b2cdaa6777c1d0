#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Every kernel on every target of this build and machine; arguments go to Google benchmark (--benchmark_filter=...).
set -euo pipefail
"${BURIN_BUILD:?run this through ./dev bench}/bench/kernels/bench_kernels" --benchmark_counters_tabular=true \
    --benchmark_out="${BURIN_RESULTS:?}/kernels.json" --benchmark_out_format=json "$@"
