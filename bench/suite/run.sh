#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The whole bench (docs/bench.md): ./dev bench [--quick] [--json FILE] [--dataset DIR]... [--rounds N] [--nice N].
# Without recorded sequences a rendered room is used.
set -euo pipefail
build=${BURIN_BUILD:?run this through ./dev bench}
results=${BURIN_RESULTS:?run this through ./dev bench}
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
arguments=("$@") quick='' given=''
for argument in "$@"; do
    case $argument in
        --quick) quick=1 ;;
        --dataset | --dataset=*) given=1 ;;
    esac
done

# Rendered once and kept: 11 frames for --quick, 30 for the whole.
room() {
    local frames=30
    [[ -z $quick ]] || frames=11
    local folder=$results/rendered-$frames/room
    if [[ ! -f $folder/associations.txt ]]; then
        rm -rf "$folder"
        mkdir -p "$(dirname "$folder")"
        printf 'rendering %d frames of a room (kept in %s)\n' "$frames" "$folder" >&2
        "$build/src/cli/burin" synth room -o "$folder" --frames "$frames" --no-truth-images --no-truth-mesh --quiet
    fi
    arguments+=(--dataset "$folder")
}

if [[ -z $given ]]; then
    recorded=(tum_fr3_structure_notexture_far)
    [[ -n $quick ]] || recorded+=(icl_office_kt3_noisy)
    found=''
    for name in "${recorded[@]}"; do
        [[ -d ${BURIN_DATA:-}/$name ]] || continue
        arguments+=(--dataset "$BURIN_DATA/$name")
        found=1
    done
    [[ -n $found ]] || printf 'no recorded sequences at BURIN_DATA=%s: the rendered room has to do\n' "${BURIN_DATA:-}" >&2
    [[ -n $found && -n $quick ]] || room
fi
if [[ -x $build/bench/peers/open3d_fuse ]]; then
    arguments+=(--open3d)
else
    echo 'Open3D is not there: the ratios against it stay empty (./dev deps --peers, then again)' >&2
fi

. "$source/bench/support/machine.sh"
exec "$build/bench/suite/bench_suite" --build "$build" --results "$results" --machine "$machine" --commit "$commit" \
    --spent "$SECONDS" "${arguments[@]}"
