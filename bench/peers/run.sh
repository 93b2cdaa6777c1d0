#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Burin beside Open3D on the same frames: times, peak memory, and how much of either surface lies within one voxel of
# the other. Called by ./dev bench peers [--voxel M] [--frames A:B] [DATASET...]; without a data set, one recorded and
# one with a sensor's noise rendered onto it are taken from BURIN_DATA.
set -euo pipefail
build=${BURIN_BUILD:?run this through ./dev bench}
results=${BURIN_RESULTS:?run this through ./dev bench}
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
burin=$build/src/cli/burin
peer=$build/bench/peers/open3d_fuse
voxel=0.01 frames='' datasets=()
while [[ $# -gt 0 ]]; do
    case $1 in
        --voxel) voxel=${2:?--voxel needs a length in metres}; shift ;;
        --frames) frames=${2:?--frames needs A:B}; shift ;;
        -*) printf 'peers: unknown argument %s\n' "$1" >&2; exit 2 ;;
        *) datasets+=("$1") ;;
    esac
    shift
done
if [[ ${#datasets[@]} == 0 ]]; then
    for name in icl_office_kt3_noisy tum_fr3_structure_notexture_far; do datasets+=("$BURIN_DATA/$name"); done
fi
[[ -x $peer ]] || { echo "peers: $peer was not built; is Open3D installed?" >&2; exit 1; }

get() { cmake -DFILE="$1" -DKEYS="$2" -P "$source/cmake/JsonGet.cmake"; }
ply_count() { head -c 1000 "$1" | sed -n "s/^element $2 \([0-9]*\).*/\1/p" | head -n 1; }
row() { printf '%s,%s,%s,%s,%s,%s,%s\n' "$name" "$voxel" "$1" "$threads" "$2" "$machine" "$commit" >>"$csv"; }

csv=$results/results.csv
machine=$(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1 | tr ',' ' ')
columns=dataset,voxel_m,program,threads,frames,depth_mean_ms,integrate_p50_ms,integrate_mean_ms,integrate_p95_ms,extract_ms
printf '%s,peak_rss_bytes,vertices,triangles,machine,commit\n' "$columns" >"$csv"
commit=$(git -C "$source" rev-parse --short HEAD 2>/dev/null || echo unknown)

for dataset in "${datasets[@]}"; do
    [[ -d $dataset ]] || { echo "peers: $dataset is not there; set BURIN_DATA or name a data set" >&2; exit 1; }
    name=$(basename "$dataset")
    common=(--voxel "$voxel" --truncation 4 --max-depth 4)
    [[ -z $frames ]] || common+=(--frames "$frames")
    for threads in 1 2; do
        for kind in scalable vbg; do
            out=$results/$name-open3d-$kind-$threads
            flags=()
            [[ $kind == vbg ]] && flags=(--vbg)
            "$peer" "$dataset" "${common[@]}" --threads "$threads" ${flags[@]+"${flags[@]}"} -o "$out.ply" >"$out.json"
            row "open3d-$kind" "$(get "$out.json" 'frames;none;integrate_p50_ms;integrate_mean_ms;integrate_p95_ms;extract_ms;peak_rss_bytes;vertices;triangles')"
        done
        out=$results/$name-burin-$threads
        # Like Open3D: distances along the viewing ray, no filter, voxels seen once count, no limit to jumps, all components stay. Carving is on: Open3D
        # clears space too, in every voxel of the 16^3 blocks it touches.
        "$burin" fuse "$dataset" -o "$out" "${common[@]}" --threads "$threads" --no-colour --truncation-along ray \
            --min-weight 1 --max-jump 100 --min-component 0 --budget "${BURIN_PEERS_BUDGET:-1GiB}" --quiet
        row burin "$(get "$out/report.json" 'tracked;stages.depth.mean_ms;stages.integrate.p50_ms;stages.integrate.mean_ms;stages.integrate.p95_ms;stages.mesh.mean_ms;memory.peak_rss_bytes'),$(ply_count "$out/mesh.ply" vertex),$(ply_count "$out/mesh.ply" face)"
    done
    agreement=$results/$name-agreement.json
    "$burin" eval mesh "$results/$name-burin-1/mesh.ply" "$results/$name-open3d-scalable-1.ply" --threshold "$voxel" --json >"$agreement"
    IFS=, read -r ours theirs < <(get "$agreement" 'scores.0.precision;scores.0.completeness_ratio')
    printf '%s, voxel %s m: within one voxel of the other surface: %s of ours, %s of ScalableTSDFVolume'"'"'s\n' \
        "$name" "$voxel" "$ours" "$theirs"
done
column -s, -t <"$csv" 2>/dev/null || cat "$csv"
printf 'figures in %s\n' "$csv"
