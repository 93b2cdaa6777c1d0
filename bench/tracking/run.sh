#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Both trackers, with and without colour and, where a sequence has an IMU, the gyroscope, and Open3D's RGB-D odometry on
# the first frames: ./dev bench tracking [--quick] [--threads N] [--frames N] [--peer-frames N] [DATASET...]. Without a
# data set: the recorded ones of BURIN_DATA and a room rendered along ICL-NUIM's living-room tracks. --quick takes 200
# frames of each. Leaves rows in bench/results/MACHINE.csv and a table, out/bench/tracking/table.md.
set -euo pipefail
build=${BURIN_BUILD:?run this through ./dev bench}
results=${BURIN_RESULTS:?run this through ./dev bench}
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
burin=$build/src/cli/burin
ours=$build/bench/tracking/bench_tracking
peer=$build/bench/peers/open3d_odometry
# Open3D needs some 0.6 s a frame: a hundred frames of it are a minute.
frames=0 peer_frames=100 threads=2 kind=tracking datasets=()
while [[ $# -gt 0 ]]; do
    case $1 in
        --quick) kind=tracking-quick frames=200 ;;
        --threads) threads=${2:?--threads needs a number}; shift ;;
        --frames) frames=${2:?--frames needs a number}; shift ;;
        --peer-frames) peer_frames=${2:?--peer-frames needs a number, 0 for no Open3D}; shift ;;
        -*) printf 'tracking: unknown argument %s\n' "$1" >&2; exit 2 ;;
        *) datasets+=("${1%/}") ;;
    esac
    shift
done
[[ $frames != 0 ]] || frames=1000000
. "$source/bench/support/machine.sh"

# The furnished room with a sensor's noise and an IMU, rendered once and kept.
room() {
    local track=$BURIN_DATA/trajectories/icl_livingroom_kt$1.txt
    local folder=$results/rendered-$kind/room_kt$1 limit=()
    [[ -f $track ]] || { echo "tracking: no $track, without room_kt$1" >&2; return; }
    [[ $kind == tracking ]] || limit=(--frames "$frames")
    if [[ ! -f $folder/rendered ]]; then
        rm -rf "$folder"
        mkdir -p "$(dirname "$folder")"
        printf 'rendering the room along kt%d (kept in %s)\n' "$1" "$folder" >&2
        "$burin" synth room --trajectory "$track" ${limit[@]+"${limit[@]}"} --imu --no-truth-images --no-truth-mesh \
            --threads "$threads" --quiet -o "$folder"
        touch "$folder/rendered"
    fi
    datasets+=("$folder")
}
if [[ ${#datasets[@]} == 0 ]]; then
    for name in icl_office_kt3_noisy tum_fr3_structure_notexture_far tum_fr1_xyz_10; do
        if [[ -d ${BURIN_DATA:-}/$name ]]; then datasets+=("$BURIN_DATA/$name")
        else echo "tracking: no $name at BURIN_DATA=${BURIN_DATA:-}" >&2; fi
    done
    for track in 0 1 2 3; do room "$track"; done
fi
[[ ${#datasets[@]} -gt 0 ]] || { echo 'tracking: no sequence; name one or set BURIN_DATA' >&2; exit 1; }
[[ -x $peer ]] || { echo 'Open3D is not there: nothing beside ours (./dev deps --peers, then again)' >&2; peer_frames=0; }

get() { cmake -DFILE="$1" -DKEYS="$2" -P "$source/cmake/JsonGet.cmake"; }
rounded() { awk -v v="$1" -v d="$2" 'BEGIN { if (v ~ /^-?[0-9]/) printf "%.*f", d, v; else printf "%s", v == "-" ? "" : v }'; }
rows=$results/rows.csv table=$results/table.md
: >"$rows"
# figures FILE PROGRAM COLOUR KEY...: one row a figure.
figures() {
    local file=$1 program=$2 colour=$3 key values
    shift 3
    IFS=, read -ra values < <(get "$file" "$(IFS=';'; echo "$*")")
    for key in "$@"; do
        printf '%s,%s,%s,%s,%s,5,%s,%s,%s,%s\n' "$machine" "$commit" "$kind" "$name" "$program" "$threads" "$colour" "$key" \
            "$(awk -v v="${values[0]}" 'BEGIN { printf "%.4g", v }')" >>"$rows"
        values=("${values[@]:1}")
    done
}
track() { "$ours" "$dataset" --json --threads "$threads" "$@"; }

{
    printf 'Machine `%s`, commit %s, %s, %s threads, 5 mm voxels; load %s at the start.\n\n' "$machine" "$commit" "$kind" \
        "$threads" "$(cut -d' ' -f1 /proc/loadavg)"
    printf '| sequence | frames | tracker | colour | gyro | ATE mm | unaligned mm | track ms | whole frame, cpu ms | evaluations | weak | lost | 50 mm off from |\n'
    printf '|---|---|---|---|---|---|---|---|---|---|---|---|---|\n'
} >"$table"
beside=$results/beside.md
printf '\n| sequence | frames | ours: ATE mm | track ms | whole frame, cpu ms | Open3D: ATE mm | ms | cpu ms | failures | times faster |\n|---|---|---|---|---|---|---|---|---|---|\n' >"$beside"
for dataset in "${datasets[@]}"; do
    [[ -d $dataset ]] || { echo "tracking: $dataset is not there" >&2; exit 1; }
    name=$(basename "$dataset")
    gyros=(0)
    [[ ! -f $dataset/imu.txt ]] || gyros=(0 1)
    for tracker in sdf icp; do
        for gyro in "${gyros[@]}"; do
            for colour in 0 1; do
                program=$tracker
                [[ $gyro == 0 ]] || program+=-gyro
                out=$results/$name-$program-$colour.json
                track --tracker "$tracker" --colour "$colour" --gyro "$gyro" --last "$frames" >"$out"
                figures "$out" "$program" "$colour" frames ate_mm unaligned_mm track_p50_ms scan_cpu_p50_ms evaluations_p50 weak lost
                IFS=, read -r n ate unaligned ms cpu evaluations weak lost off < <(get "$out" \
                    'frames;ate_mm;unaligned_mm;track_p50_ms;scan_cpu_p50_ms;evaluations_p50;weak;lost;first_off')
                printf '| %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s |\n' "$name" "$n" "$tracker" "$colour" \
                    "$gyro" "$(rounded "$ate" 2)" "$(rounded "$unaligned" 1)" "$(rounded "$ms" 1)" \
                    "$(rounded "$cpu" 1)" "$(rounded "$evaluations" 0)" "$weak" "$lost" "$(rounded "$off" 0)" | tee -a "$table"
            done
        done
    done
    [[ $peer_frames != 0 ]] || continue
    # One right after the other, on the same frames, so that a busy machine is busy for both.
    last=$((frames < peer_frames ? frames : peer_frames))
    track --last "$last" >"$results/$name-first.json"
    "$peer" "$dataset" --frames "0:$last" --threads "$threads" >"$results/$name-open3d.json"
    figures "$results/$name-first.json" sdf-first 1 frames ate_mm unaligned_mm track_p50_ms scan_cpu_p50_ms
    figures "$results/$name-open3d.json" open3d-odometry 1 frames ate_mm unaligned_mm track_p50_ms track_p50_cpu_ms failures
    IFS=, read -r n ate ms cpu < <(get "$results/$name-first.json" 'frames;ate_mm;track_p50_ms;scan_cpu_p50_ms')
    IFS=, read -r their_ate their_ms their_cpu failures < <(get "$results/$name-open3d.json" \
        'ate_mm;track_p50_ms;track_p50_cpu_ms;failures')
    printf '| %s | %s | %s | %s | %s | %s | %s | %s | %s | %s |\n' "$name" "$n" "$(rounded "$ate" 2)" "$(rounded "$ms" 1)" \
        "$(rounded "$cpu" 1)" "$(rounded "$their_ate" 2)" "$(rounded "$their_ms" 0)" "$(rounded "$their_cpu" 0)" "$failures" \
        "$(awk -v a="$their_ms" -v b="$ms" 'BEGIN { printf "%.1f", a / b }')" | tee -a "$beside"
done
[[ $peer_frames == 0 ]] || cat "$beside" >>"$table"

keep_rows "$rows" "$results"
printf 'rows in %s, table in %s\n' "$csv" "$table"
