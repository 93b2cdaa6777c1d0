#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
#     tests/rig/host/chain.mesh.sh FOLDER
#
# FOLDER/scan is what `burin scan` made in a guest of the emulated sensor's view of the room: its mesh against the room itself. One
# line; fails when it is not that room, or hardly any of it.
set -euo pipefail
burin=build/release/src/cli/burin
build/release/tests/rig/rig_room place "$1/scan/mesh.ply" build/rig/room "$1/placed.ply"
# The voxels have 20 mm, the sensor the noise of structured light: 4.0 mm and 0.994 were measured on amd64. One frame too many or
# too few at the beginning moves everything by about 15 mm.
"$burin" eval mesh "$1/placed.ply" --scene room --dataset build/rig/room --frames 0:4 --threshold 0.02 --samples 50000 --json >"$1/eval.json"
mean=$(sed 's/.*"accuracy":{[^}]*"mean_m":\([0-9.e-]*\).*/\1/' "$1/eval.json")
precision=$(sed 's/.*"precision":\([0-9.e-]*\).*/\1/' "$1/eval.json")
complete=$(sed 's/.*"completeness_ratio":\([0-9.e-]*\).*/\1/' "$1/eval.json")
printf 'mean error %s m, %s of the mesh within 20 mm of the room, %s of what the first frames saw\n' "$mean" "$precision" "$complete"
awk -v mean="$mean" -v precision="$precision" -v complete="$complete" 'BEGIN { exit !(mean > 0 && mean < 0.008 && precision > 0.97 && complete > 0.9) }'
