#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The layer of planes: cost a frame, how still it holds the surface, candidates beside RANSAC on the mesh, both ways to
# new planes: ./dev bench planes [--quick] [--hypotheses N] [--every N] [DATASET...]. Without a data set: the room and
# the desk of burin synth, rendered once and kept. --quick takes 60 frames of each. Leaves rows in
# bench/results/MACHINE.csv and tables, out/bench/planes/table.md.
set -euo pipefail
build=${BURIN_BUILD:?run this through ./dev bench}
results=${BURIN_RESULTS:?run this through ./dev bench}
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
burin=$build/src/cli/burin
ours=$build/bench/planes/bench_planes
kind=planes frames=1000000 datasets=() arguments=()
while [[ $# -gt 0 ]]; do
    case $1 in
        --quick) kind=planes-quick frames=60 ;;
        --hypotheses | --every) arguments+=("$1" "${2:?$1 needs a number}"); shift ;;
        -*) printf 'planes: unknown argument %s\n' "$1" >&2; exit 2 ;;
        *) datasets+=("${1%/}") ;;
    esac
    shift
done
. "$source/bench/support/machine.sh"

if [[ ${#datasets[@]} == 0 ]]; then
    for scene in room desk; do
        folder=$results/rendered/$scene
        if [[ ! -f $folder/rendered ]]; then
            rm -rf "$folder"
            mkdir -p "$(dirname "$folder")"
            printf 'rendering the %s (kept in %s)\n' "$scene" "$folder" >&2
            "$burin" synth "$scene" --no-truth-images --no-truth-mesh --quiet -o "$folder"
            touch "$folder/rendered"
        fi
        datasets+=("$folder")
    done
fi

rows=$results/rows.csv table=$results/table.md
: >"$rows"
get() { cmake -DFILE="$1" -DKEYS="$2" -P "$source/cmake/JsonGet.cmake"; }
# figures FILE KEY...: one row a figure.
figures() {
    local file=$1 key values
    shift
    IFS=, read -ra values < <(get "$file" "$(IFS=';'; echo "$*")")
    for key in "$@"; do
        [[ ${values[0]} == - ]] || printf '%s,%s,%s,%s,bench_planes,5,1,0,%s,%s\n' "$machine" "$commit" "$kind" "$name" "$key" \
            "$(awk -v v="${values[0]}" 'BEGIN { printf "%.4g", v }')" >>"$rows"
        values=("${values[@]:1}")
    done
}
# line FILE KEY...: a row of the table; fractions in 4 digits.
line() {
    local file=$1
    shift
    get "$file" "$(IFS=';'; echo "$*")" | awk -F, -v name="$name" '{
        printf "| %s |", name
        for (i = 1; i <= NF; ++i) if ($i ~ /^[0-9]+$/) printf " %s |", $i; else if ($i ~ /^-?[0-9]/) printf " %.4g |", $i; else printf " %s |", $i
        printf "\n" }'
}
cost=$results/cost.md candidates=$results/candidates.md merging=$results/merging.md
printf '| sequence | frames | planes ms mean | p50 | p95 | integrate ms mean | planes | refresh ms | with um | without um | ratio | of means | refreshed: with um | without um | ratio | of means |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n' >"$cost"
printf '| sequence | chunks | us | found | on planes | angle p50 | p95 | mm p50 | p95 | RANSAC us | mesh us | found | on planes | angle p50 | p95 | mm p50 | p95 |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n' >"$candidates"
printf '| sequence | way | planes ms | refresh ms | recall | precision | angle p50 | worst | mm p50 | worst |\n|---|---|---|---|---|---|---|---|---|---|\n' >"$merging"
for dataset in "${datasets[@]}"; do
    [[ -d $dataset ]] || { echo "planes: $dataset is not there" >&2; exit 1; }
    name=$(basename "$dataset") out=$results/$(basename "$dataset").json
    "$ours" "$dataset" --json --last "$frames" ${arguments[@]+"${arguments[@]}"} >"$out"
    stability=(stability.with_p50_um stability.without_p50_um stability.ratio_p50 stability.ratio_mean
        stability_refreshed.with_p50_um stability_refreshed.without_p50_um stability_refreshed.ratio_p50
        stability_refreshed.ratio_mean)
    main=(merge_ransac.planes_ms.mean merge_ransac.planes_ms.p50 merge_ransac.planes_ms.p95 merge_ransac.integrate_ms.mean
        merge_ransac.planes merge_ransac.refresh_ms)
    line "$out" frames "${main[@]}" "${stability[@]}" >>"$cost"
    fits=() keys=(frames "${main[@]}" "${stability[@]}")
    for way in least_squares ransac; do
        fits+=("candidates.$way.us_per_chunk")
        [[ $way == least_squares ]] || fits+=(candidates.mesh_us_per_chunk)
        fits+=("candidates.$way.found" "candidates.$way.on_planes" "candidates.$way.angle_deg.p50"
            "candidates.$way.angle_deg.p95" "candidates.$way.distance_mm.p50" "candidates.$way.distance_mm.p95")
    done
    line "$out" candidates.chunks "${fits[@]}" >>"$candidates"
    keys+=("${fits[@]}")
    for way in merge_ransac merge_growing; do
        quality=("$way.planes_ms.mean" "$way.refresh_ms" "$way.recall" "$way.precision" "$way.angle_deg.p50"
            "$way.angle_deg.worst" "$way.offset_mm.p50" "$way.offset_mm.worst")
        line "$out" "${quality[@]}" | sed "s/^| $name |/| $name | ${way#merge_} |/" >>"$merging"
        keys+=("${quality[@]}")
    done
    figures "$out" "${keys[@]}"
done
{
    printf 'Machine `%s`, commit %s, %s, one thread, 5 mm voxels; load %s at the end.\n\n' "$machine" "$commit" "$kind" \
        "$(cut -d' ' -f1 /proc/loadavg)"
    cat "$cost"; echo; cat "$candidates"; echo; cat "$merging"
} | tee "$table"

keep_rows "$rows" "$results"
printf 'rows in %s, tables in %s\n' "$csv" "$table"
