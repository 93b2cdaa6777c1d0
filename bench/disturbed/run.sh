#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# What goes wrong before a camera, and the way back: ./dev bench disturbed [--frames N] [--jobs N] [CASE=ARGUMENTS...]
# [DATASET...]. Every sequence is played forwards and backwards, undisturbed and in each case (below), and the mesh of the
# map is held against the true scene (rendered) or a map fused with the true poses (recorded). Without a data set: the
# recorded ones of BURIN_DATA and the room along ICL-NUIM's kt1 and kt2. Leaves rows in bench/results/MACHINE.csv and
# out/bench/disturbed/table.md.
set -euo pipefail
build=${BURIN_BUILD:?run this through ./dev bench}
results=${BURIN_RESULTS:?run this through ./dev bench}
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
burin=$build/src/cli/burin
ours=$build/bench/tracking/bench_tracking
frames=200 jobs=1 kind=disturbed datasets=() cases=()
while [[ $# -gt 0 ]]; do
    case $1 in
        --frames) frames=${2:?--frames needs a number}; shift ;;
        --jobs) jobs=${2:?--jobs needs a number}; shift ;;
        -*) printf 'disturbed: unknown argument %s\n' "$1" >&2; exit 2 ;;
        *=*) cases+=("$1") ;;
        *) datasets+=("${1%/}") ;;
    esac
    shift
done
# At 30 frames a second: from frame 60 on for 0.5, 1 and 3 s.
[[ ${#cases[@]} -gt 0 ]] || cases=('blank-0.5s=--blank 60:75' 'blank-1s=--blank 60:90' 'blank-3s=--blank 60:150' 'hand-1s=--hand 60:90'
    'plane-3s=--plane 60:150' 'twice-as-fast=--skip 2' 'four-times=--skip 4' 'dropout=--dropout 0.5')
cases=('undisturbed=--skip 1' "${cases[@]}")
. "$source/bench/support/machine.sh"

if [[ ${#datasets[@]} == 0 ]]; then
    for name in icl_office_kt3_noisy tum_fr3_structure_notexture_far; do
        if [[ -d ${BURIN_DATA:-}/$name ]]; then datasets+=("$BURIN_DATA/$name")
        else echo "disturbed: no $name at BURIN_DATA=${BURIN_DATA:-}" >&2; fi
    done
    for track in 1 2; do
        file=${BURIN_DATA:-}/trajectories/icl_livingroom_kt$track.txt folder=$results/rendered-$frames/room_kt$track
        [[ -f $file ]] || { echo "disturbed: no $file, without room_kt$track" >&2; continue; }
        if [[ ! -f $folder/rendered ]]; then
            rm -rf "$folder"
            mkdir -p "$(dirname "$folder")"
            printf 'rendering the room along kt%d (kept in %s)\n' "$track" "$folder" >&2
            "$burin" synth room --trajectory "$file" --frames "$frames" --no-truth-images --no-truth-mesh --quiet -o "$folder"
            touch "$folder/rendered"
        fi
        datasets+=("$folder")
    done
fi
[[ ${#datasets[@]} -gt 0 ]] || { echo 'disturbed: no sequence; name one or set BURIN_DATA' >&2; exit 1; }

# one DATASET CASE ARGUMENTS...: the run, and how far its mesh is from the truth.
one() {
    local dataset=$1 name out
    name=$(basename "$dataset")
    out=$results/$name-$2
    "$ours" "$dataset" --json --threads 1 --gyro 0 --back --mesh "$out.ply" "${@:3}" >"$out.json"
    if [[ -f $dataset/truth/scene.json ]]; then
        "$burin" eval mesh "$out.ply" --scene "$(cmake -DFILE="$dataset/truth/scene.json" -DKEYS=scene -P "$source/cmake/JsonGet.cmake")" \
            --dataset "$dataset" --max-depth 5 --threads 1 --json >"$out-mesh.json"
    else
        "$burin" eval mesh "$out.ply" "$results/$name-truth/mesh.ply" --threads 1 --json >"$out-mesh.json"
    fi
    rm -f "$out.ply"
}
export -f one
export results source burin ours
for dataset in "${datasets[@]}"; do
    truth=$results/$(basename "$dataset")-truth
    [[ -f $dataset/truth/scene.json || -f $truth/mesh.ply ]] ||
        "$burin" fuse "$dataset" -o "$truth" --voxel 0.005 --truncation 8 --max-depth 5 --bilateral --edge-removal \
            --budget 2GiB --quiet
    for c in "${cases[@]}"; do printf '%s %s %s\n' "$dataset" "${c%%=*}" "${c#*=}"; done
done | xargs -P "$jobs" -L 1 bash -c 'one "$@"' one

get() { cmake -DFILE="$1" -DKEYS="$2" -P "$source/cmake/JsonGet.cmake"; }
rounded() { awk -v v="$1" -v d="$2" 'BEGIN { if (v ~ /^-?[0-9]/) printf "%.*f", d, v; else printf "%s", v == "-" ? "" : v }'; }
rows=$results/rows.csv table=$results/table.md
: >"$rows"
{
    printf 'Machine `%s`, commit %s, 5 mm voxels.\n\n' "$machine" "$commit"
    printf '| sequence | case | ok | weak | lost | worst ok, mm | again ok | of | worst from before, mm | from the truth, mm | mesh, mm | to undisturbed |\n'
    printf '|---|---|---|---|---|---|---|---|---|---|---|---|\n'
} >"$table"
keys=(ok weak lost worst_ok_since_mm back_ok back_frames back_again_mm back_since_mm)
for dataset in "${datasets[@]}"; do
    name=$(basename "$dataset")
    base=$(get "$results/$name-undisturbed-mesh.json" accuracy.mean_m)
    for c in "${cases[@]}"; do
        program=${c%%=*}
        IFS=, read -ra values < <(get "$results/$name-$program.json" "$(IFS=';'; echo "${keys[*]}")")
        mesh=$(get "$results/$name-$program-mesh.json" accuracy.mean_m)
        values+=("$(awk -v m="$mesh" 'BEGIN { print 1000 * m }')" "$(awk -v m="$mesh" -v b="$base" 'BEGIN { print m / b }')")
        i=0
        for key in "${keys[@]}" mesh_mm mesh_ratio; do
            printf '%s,%s,%s,%s,%s,5,1,1,%s,%s\n' "$machine" "$commit" "$kind" "$name" "$program" "$key" \
                "$(awk -v v="${values[i]}" 'BEGIN { printf "%.4g", v }')" >>"$rows"
            i=$((i + 1))
        done
        printf '| %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s |\n' "$name" "$program" "${values[0]}" "${values[1]}" \
            "${values[2]}" "$(rounded "${values[3]}" 1)" "${values[4]}" "${values[5]}" "$(rounded "${values[6]}" 1)" \
            "$(rounded "${values[7]}" 1)" "$(rounded "${values[8]}" 2)" "$(rounded "${values[9]}" 3)" | tee -a "$table"
    done
done
keep_rows "$rows" "$results"
printf 'rows in %s, table in %s\n' "$csv" "$table"
