#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
#     tests/rig/run.sh [amd64] [arm64]        both without arguments; the same as ./dev rig
#
# Installs and builds what is missing, boots one guest an architecture, and looks for the result of each check of each stage
# (stages/*.sh). Fails when one is FAIL, or missing. RIG_STAGES="20 30" takes only those stages, RIG_BUILD=no the programs as they are, RIG_SECONDS
# the time of a guest. README.md says the rest.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "$here/../.."
fail() { printf 'rig: %s\n' "$*" >&2; exit 1; }
seconds=${RIG_SECONDS:-400}  # for a guest, all its stages; two guests on two idle cores take a quarter of that

architectures=("$@")
[[ $# -gt 0 ]] || architectures=(amd64 arm64)
for architecture in "${architectures[@]}"; do
    [[ $architecture == amd64 || $architecture == arm64 ]] || fail "expected amd64 or arm64, not '$architecture'"
done
stages=()
for stage in "$here"/stages/*.sh; do
    number=$(basename "$stage" | cut -d_ -f1)
    [[ -n ${RIG_STAGES:-} && " $RIG_STAGES " != *" $number "* ]] && continue
    # `# asked`: it takes long, and runs only when it is named.
    [[ -z ${RIG_STAGES:-} ]] && grep -q '^# asked$' "$stage" && continue
    stages+=("$stage")
done
[[ ${#stages[@]} -gt 0 ]] || fail "no stage of those in RIG_STAGES='$RIG_STAGES'"

mkdir -p build/rig out/rig
SECONDS=0
for architecture in "${architectures[@]}"; do
    (flock 9 && "$here/fetch.sh" "$architecture" "build/rig/$architecture") 9>"build/rig/$architecture.lock" &
done
./dev deps --rig >out/rig/deps.log 2>&1 || { tail -n 20 out/rig/deps.log >&2; fail "packages (above)"; }

# The whole chain plays a rendered room: its frames are the guests' first disk. What a guest has to hand out, it writes to its second,
# as a tar file.
room() {
    local burin=build/release/src/cli/burin frames=40 size=640x480
    if [[ $(cat build/rig/room/.made 2>/dev/null) != "$frames $size" ]]; then
        rm -rf build/rig/room
        "$burin" synth room -o build/rig/room --frames "$frames" --size "$size" --no-truth-images --no-truth-mesh --quiet || return
        build/release/tests/rig/rig_room frames build/rig/room build/rig/room.frames || return
        echo "$frames $size" >build/rig/room/.made
    fi
}

# A stage that says `# needs BACKEND` is left out of a build of Burin without it, and that is said.
with_backends() {
    local stage backend have
    have=$(build/release/src/cli/burin devices --json) || return
    for stage in "${stages[@]}"; do
        backend=$(sed -n 's/^# needs \([a-z0-9]*\)$/\1/p' "$stage")
        if [[ -z $backend || $have == *"\"name\":\"$backend\""* ]]; then kept+=("$stage"); else
            printf 'rig: LEFT OUT, this build has no back end %s: %s\n' "$backend" "$(basename "$stage")"; fi
    done
}

# A stage that says `# only ARCHITECTURE` runs there alone.
stages_of() {
    local stage only
    for stage in "${stages[@]}"; do
        only=$(sed -n 's/^# only \([a-z0-9]*\)$/\1/p' "$stage")
        [[ -n $only && $only != "$1" ]] || printf '%s\n' "$stage"
    done
}

# guest ARCHITECTURE: builds, packs and boots; the console goes to out/rig/ARCHITECTURE.log.
guest() {
    local architecture=$1 preset sysroot triple files=() program
    local stages_here
    mapfile -t stages_here < <(stages_of "$architecture")
    case $architecture in
        amd64) preset=release sysroot='' triple=x86_64-linux-gnu ;;
        arm64) preset=aarch64 sysroot=$PWD/build/sysroot/aarch64 triple=aarch64-linux-gnu ;;
    esac
    for program in build/"$preset"/tests/rig/rig_* build/"$preset"/src/cli/burin; do [[ -f $program && -x $program ]] && files+=("$program"); done
    for program in "${stages_here[@]}"; do files+=("$program:/stages/$(basename "$program")"); done
    files+=("$sysroot/usr/lib/$triple/OpenNI2/Drivers/libPS1080.so.0:/lib/OpenNI2/Drivers/libPS1080.so.0")
    rm -f "build/rig/$architecture.disk"
    truncate -s 64M "build/rig/$architecture.disk"
    "$here/initramfs.sh" "$architecture" "build/rig/$architecture" "$sysroot" "build/rig/$architecture.cpio.gz" "${files[@]}" &&
        "$here/boot.sh" "$architecture" "build/rig/$architecture" "build/rig/$architecture.cpio.gz" "$seconds" \
            -drive file=build/rig/room.frames,format=raw,if=virtio,readonly=on \
            -drive "file=build/rig/$architecture.disk,format=raw,if=virtio"
}

# Always for this machine too: it renders the room and measures what the guests made of it.
for preset in release $([[ " ${architectures[*]} " != *" arm64 "* ]] || echo aarch64); do
    targets=(burin_rig)
    # The command line takes long to cross-compile, and few stages use it.
    if [[ $preset == release ]]; then targets+=(burin_cli rig_room)
    elif grep -q '^[^#]* burin ' "${stages[@]}"; then targets+=(burin_cli); fi
    [[ ${RIG_BUILD:-yes} == yes ]] || continue
    ./dev build --preset "$preset" "${targets[@]}" >"out/rig/build-$preset.log" 2>&1 ||
        { tail -n 40 "out/rig/build-$preset.log" >&2; fail "the build for $preset (above)"; }
done
room || fail "no room rendered"
kept=()
with_backends || fail "burin devices failed"
stages=(${kept[@]+"${kept[@]}"})
[[ ${#stages[@]} -gt 0 ]] || fail "no stage is left"
wait
printf 'rig: installed and built after %d s\n' "$SECONDS"
for architecture in "${architectures[@]}"; do
    (guest "$architecture" >"out/rig/$architecture.log" 2>&1; echo "rig: guest ended after $SECONDS s" >>"out/rig/$architecture.log") &
done
wait

# What the stages promise, and what came.
failed=0
for architecture in "${architectures[@]}"; do
    log=out/rig/$architecture.log good=0 bad=0
    mapfile -t here_stages < <(stages_of "$architecture")
    expected=$(sed -n 's/^ *\(RIG_LIMIT=[0-9]* \)\{0,1\}\(check\|check_not\|hand_out\) \([a-z0-9._]*\) .*/\3/p' "${here_stages[@]}"; echo kernel.quiet)
    judged=$(sed -n 's/^ *hand_out \([a-z0-9._]*\) .*/\1/p' "${here_stages[@]}")
    for name in $judged; do
        # What the guest handed out is judged here.
        handed=out/rig/$architecture-$name
        rm -rf "$handed" && mkdir -p "$handed"
        if tar xf "build/rig/$architecture.disk" -C "$handed" 2>"$handed/log" && "$here/host/$name.sh" "$handed" >>"$handed/log" 2>&1
        then verdict=ok; else verdict=FAIL; fi
        printf 'RIG %s %s %s\n' "$name" "$verdict" "$(tail -n 1 "$handed/log")" >>"$log"
    done
    while read -r name; do
        # Of several with one name, as in a loop, all have to be ok.
        line=$(tr -d '\r' <"$log" | grep -a "^RIG $name " | sort -k 3,3 | head -n 1) || true
        case $line in
            "RIG $name ok"*) good=$((good + 1)) ;;
            '') bad=$((bad + 1)); printf '%s RIG %s FAIL no result\n' "$architecture" "$name" ;;
            *) bad=$((bad + 1)); printf '%s %s\n' "$architecture" "$line" ;;
        esac
    done <<<"$expected"
    printf 'rig: %s: %d of %d ok, %s\n' "$architecture" "$good" $((good + bad)) "$log"
    ((bad == 0)) || failed=1
done
printf 'rig: %d s in all\n' "$SECONDS"
exit "$failed"
