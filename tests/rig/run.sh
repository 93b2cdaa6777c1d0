#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
#     tests/rig/run.sh [amd64] [arm64]        both without arguments; the same as ./dev rig
#
# Installs and builds what is missing, boots one guest an architecture, and looks for the result of each check of each stage
# (stages/*.sh). Fails when one is FAIL, or missing. RIG_STAGES="20 30" takes only those stages. README.md says the rest.
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
    [[ -n ${RIG_STAGES:-} && " $RIG_STAGES " != *" $number "* ]] || stages+=("$stage")
done
[[ ${#stages[@]} -gt 0 ]] || fail "no stage of those in RIG_STAGES='$RIG_STAGES'"

mkdir -p build/rig out/rig
SECONDS=0
for architecture in "${architectures[@]}"; do
    (flock 9 && "$here/fetch.sh" "$architecture" "build/rig/$architecture") 9>"build/rig/$architecture.lock" &
done
./dev deps --rig >out/rig/deps.log 2>&1 || { tail -n 20 out/rig/deps.log >&2; fail "packages (above)"; }

# guest ARCHITECTURE: builds, packs and boots; the console goes to out/rig/ARCHITECTURE.log.
guest() {
    local architecture=$1 preset sysroot triple files=() program
    case $architecture in
        amd64) preset=release sysroot='' triple=x86_64-linux-gnu ;;
        arm64) preset=aarch64 sysroot=$PWD/build/sysroot/aarch64 triple=aarch64-linux-gnu ;;
    esac
    for program in build/"$preset"/tests/rig/rig_* build/"$preset"/src/cli/burin; do [[ -f $program && -x $program ]] && files+=("$program"); done
    for program in "${stages[@]}"; do files+=("$program:/stages/$(basename "$program")"); done
    files+=("$sysroot/usr/lib/$triple/OpenNI2/Drivers/libPS1080.so.0:/lib/OpenNI2/Drivers/libPS1080.so.0")
    "$here/initramfs.sh" "$architecture" "build/rig/$architecture" "$sysroot" "build/rig/$architecture.cpio.gz" "${files[@]}" &&
        "$here/boot.sh" "$architecture" "build/rig/$architecture" "build/rig/$architecture.cpio.gz" "$seconds"
}

for architecture in "${architectures[@]}"; do
    preset=release
    [[ $architecture == amd64 ]] || preset=aarch64
    ./dev build --preset "$preset" burin_rig >"out/rig/build-$architecture.log" 2>&1 ||
        { tail -n 40 "out/rig/build-$architecture.log" >&2; fail "the build for $architecture (above)"; }
done
wait
printf 'rig: installed and built after %d s\n' "$SECONDS"
for architecture in "${architectures[@]}"; do
    (guest "$architecture" >"out/rig/$architecture.log" 2>&1; echo "rig: guest ended after $SECONDS s" >>"out/rig/$architecture.log") &
done
wait

# What the stages promise, and what came.
expected=$(sed -n 's/^ *check\(_not\)\{0,1\} \([a-z0-9._]*\) .*/\2/p' "${stages[@]}"; echo kernel.quiet)
failed=0
for architecture in "${architectures[@]}"; do
    log=out/rig/$architecture.log good=0 bad=0
    while read -r name; do
        line=$(tr -d '\r' <"$log" | grep -a "^RIG $name " | tail -n 1) || true
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
