#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
#     tests/rig/fetch.sh amd64|arm64 FOLDER
#
# Puts what a guest is made of into FOLDER, from the distribution's archive, without installing anything: boot/vmlinuz-*, its
# modules with their dependencies worked out, a static busybox, and udev with what it needs (libusb learns of plugged devices
# from it alone). Nothing is done when they are there.
set -euo pipefail
[[ $# == 2 ]] || { sed -n '3s/^# *//p' "$0" >&2; exit 2; }
architecture=$1 folder=$2
fail() { printf 'fetch.sh: %s\n' "$*" >&2; exit 1; }
packages=(busybox-static udev libudev1 libkmod2 libacl1 libblkid1 libcap2 libselinux1 libpcre2-8-0 liblzma5 libzstd1 libssl3)
[[ $(cat "$folder/.complete" 2>/dev/null) != "${packages[*]}" ]] || exit 0

rm -rf "$folder" "$folder.apt"
mkdir -p "$folder" "$folder.apt"/{lists,archives}/partial
place=$(cd "$folder.apt" && pwd)
folder=$(cd "$folder" && pwd)
: >"$place/status"
# A state of its own, as in toolchains/sysroot.sh: the host's lists may lack the architecture, or belong to root.
options=(-q -o APT::Architecture="$architecture" -o APT::Architectures="$architecture" -o Dir::State="$place"
    -o Dir::State::status="$place/status" -o Dir::Cache="$place" -o APT::Sandbox::User= -o Acquire::Languages=none)
apt-get "${options[@]}" update >"$place/log" 2>&1 || true  # whether what came is enough, the next steps tell

# linux-image-ARCH only depends on the kernel of the day; where the mirror has not got that yet, the newest there is.
image=$(apt-cache "${options[@]}" depends "linux-image-$architecture" 2>>"$place/log" |
    sed -n 's/^ *Depends: \(linux-image-[0-9][^ ]*\)$/\1/p' | head -n 1)
if [[ -z $image ]] || ! apt-cache "${options[@]}" show "$image" >/dev/null 2>&1; then
    image=$(apt-cache "${options[@]}" pkgnames linux-image- 2>>"$place/log" |
        grep -E "^linux-image-[0-9.]+-[0-9]+-$architecture\$" | sort -V | tail -n 1)
fi
[[ -n $image ]] || { tail -n 20 "$place/log" >&2; fail "the archive has no linux-image-*-$architecture"; }
(cd "$place/archives" && apt-get "${options[@]}" download "$image" "${packages[@]}") >>"$place/log" 2>&1 ||
    { tail -n 20 "$place/log" >&2; fail "apt-get could not fetch for $architecture: $image ${packages[*]}"; }

# Of 400 MB of modules those that a stage may want: a tenth, and so a tenth of the time.
version=${image#linux-image-} modules=./lib/modules/${image#linux-image-}
dpkg-deb --fsys-tarfile "$place"/archives/linux-image-*.deb | tar -x -C "$folder" "./boot/vmlinuz-$version" \
    "$modules"/modules.{order,builtin,builtin.modinfo} \
    "$modules"/kernel/{drivers/{media,usb,virtio,block,char,dma-buf,i2c,input,hid,net},fs,lib,crypto,mm,net/core,sound/core} 2>"$place/tar" ||
    grep -qv 'Not found in archive\|Exiting with failure' "$place/tar" && { cat "$place/tar" >&2; fail "cannot unpack $image"; }
[[ -e $folder/boot/vmlinuz-$version ]] || fail "no kernel in $image"
depmod -b "$folder" "$version" 2>/dev/null || fail "depmod failed for $image"
rm "$place"/archives/linux-image-*.deb
for package in "$place"/archives/*.deb; do dpkg-deb --extract "$package" "$folder"; done
[[ -x $folder/bin/busybox && -x $folder/bin/udevadm ]] || fail "no bin/busybox or bin/udevadm in their packages"
rm -rf "$place"
printf '%s' "${packages[*]}" >"$folder/.complete"
