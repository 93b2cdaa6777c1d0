#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Runs a command of the README on a Debian 12 that has nothing but a shell, git and root:
#
#     tests/fresh_machine.sh [./dev test | ./dev demo | .ci/run ...]          (default: ./dev test)
#
# The machine is a chroot made by debootstrap, the repository a clone of this one at HEAD. Needs root, and debootstrap
# (apt-get install debootstrap). BURIN_DATA, if there, is mounted read-only beside the clone. What is left: the whole
# machine under BURIN_FRESH_DIR (default /tmp/burin-fresh) in run/, its repository in run/root/burin. A packed base
# system is kept in base.tar for the next time.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
place=${BURIN_FRESH_DIR:-/tmp/burin-fresh}
data=${BURIN_DATA:-$root/../shared/data}
mirror=${BURIN_FRESH_MIRROR:-http://deb.debian.org/debian}
[[ $# -gt 0 ]] || set -- ./dev test

fail() { printf 'fresh_machine: %s\n' "$*" >&2; exit 1; }
[[ $(id -u) == 0 ]] || fail "needs root, for debootstrap and chroot"
command -v debootstrap >/dev/null || fail "needs debootstrap: apt-get install debootstrap"

# Mounts live in a namespace of their own: they are gone when this script is, however it ends.
if [[ ${BURIN_FRESH_INSIDE:-} != 1 ]]; then
    exec env BURIN_FRESH_INSIDE=1 unshare --mount --propagation private "$0" "$@"
fi

mkdir -p "$place"
exec 9>"$place/.lock"
flock 9
if [[ ! -f $place/base.tar ]]; then
    printf '== debootstrap: minbase, git, ca-certificates\n'
    rm -rf "$place/base"
    debootstrap --variant=minbase --include=git,ca-certificates bookworm "$place/base" "$mirror" >"$place/debootstrap.log" 2>&1 ||
        fail "debootstrap failed, see $place/debootstrap.log"
    tar -C "$place/base" --one-file-system -cf "$place/base.tar.part" .
    mv "$place/base.tar.part" "$place/base.tar"
    rm -rf "$place/base"
fi
rm -rf "$place/run"
mkdir "$place/run"
tar -C "$place/run" -xf "$place/base.tar"

# This machine's way to the archive: name resolution, sources, and whatever apt needs to fetch (proxies and the like).
run=$place/run
cp /etc/resolv.conf /etc/hosts "$run/etc/"
rm -f "$run/etc/apt/sources.list"
for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources; do
    [[ -f $file ]] && cp --parents "$file" "$run"
done
for file in /etc/apt/apt.conf /etc/apt/apt.conf.d/*; do
    if [[ -f $file ]] && grep -q '^ *Acquire' "$file"; then cp --parents "$file" "$run"; fi
done

git clone -q --no-hardlinks "$root" "$run/root/burin"
mount -t proc proc "$run/proc"
mount --rbind /dev "$run/dev"
if [[ -d $data ]]; then
    mkdir -p "$run/root/shared/data"
    mount --bind "$data" "$run/root/shared/data"
    mount -o remount,bind,ro "$run/root/shared/data"
fi
printf '== %s, on a fresh Debian %s at commit %s\n' "$*" "$(cat "$run/etc/debian_version")" "$(git -C "$root" rev-parse --short HEAD)"
SECONDS=0
chroot "$run" /usr/bin/env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 \
    ${CI:+CI="$CI"} ${BURIN_JOBS:+BURIN_JOBS="$BURIN_JOBS"} bash -c 'cd /root/burin && exec "$@"' fresh "$@" </dev/null ||
    fail "'$*' failed after $SECONDS s"
printf '== done in %s s\n' "$SECONDS"
