#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The roof over integration: ./dev bench roofline [--frames A:B] [--voxel M]... [DATASET]
set -euo pipefail
build=${BURIN_BUILD:?run this through ./dev bench}
dataset=${BURIN_DATA:-}/tum_fr3_structure_notexture_far
arguments=()
while [[ $# -gt 0 ]]; do
    case $1 in
        -*) arguments+=("$1" "${2:?$1 needs a value}"); shift ;;
        *) dataset=$1 ;;
    esac
    shift
done
[[ -d $dataset ]] || { printf 'roofline: %s is not there; name a data set (burin synth makes one)\n' "$dataset" >&2; exit 1; }
[[ " ${arguments[*]-} " == *" --frames "* ]] || arguments+=(--frames 40:70)
exec "$build/bench/roofline/bench_roofline" "$dataset" --json "${BURIN_RESULTS:?}/roofline.json" "${arguments[@]}"
