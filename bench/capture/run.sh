#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Unpacking and registration of a Kinect's frame, beside libfreenect, and what capture adds in all: ./dev bench capture [--rounds N]. Beside it only
# when BURIN_FREENECT names a folder with libfreenect's sources (src/ and include/ of 0.6 or 0.7), since the library
# that is installed does not let out its unpacking; compiled with Debian's flags. Leaves rows in
# bench/results/MACHINE.csv.
set -euo pipefail
build=${BURIN_BUILD:?run this through ./dev bench}
results=${BURIN_RESULTS:?run this through ./dev bench}
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
. "$source/bench/support/machine.sh"
arguments=("$@")
peer=${BURIN_FREENECT:-}
if [[ -f $peer/src/cameras.c ]]; then
    gcc -g -O2 -fstack-protector-strong -shared -fPIC -w -I "$peer/src" -I "$peer/include" -I /usr/include/libusb-1.0 \
        "$source/bench/capture/freenect_peer.c" -o "$results/freenect_peer.so"
    arguments+=(--peer "$results/freenect_peer.so")
else
    echo "capture: BURIN_FREENECT=$peer has no src/cameras.c: nothing beside ours" >&2
fi
"$build/bench/capture/bench_capture" ${arguments[@]+"${arguments[@]}"} | tee "$results/capture.txt"
"$build/bench/capture/bench_capture_added" | tee -a "$results/capture.txt"
awk -v m="$machine" -v c="$commit" '$1 != "#" { printf "%s,%s,capture,kinect_vga,%s,,1,,%s,%s\n", m, c, $1, $2, $3 }' \
    "$results/capture.txt" >"$results/rows.csv"
keep_rows "$results/rows.csv" "$results"
printf 'rows in %s; load %s\n' "$csv" "$(cut -d' ' -f1 /proc/loadavg)"
