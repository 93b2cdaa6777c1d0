#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
#     tests/rig/initramfs.sh amd64|arm64 GUEST SYSROOT OUT FILE[:PLACE]...
#
# Packs OUT, a root file system for the kernel in GUEST (what fetch.sh unpacked): busybox, udev, the modules below with all they need
# in the order to load them, guest/init and guest/library.sh, and the FILEs at their PLACEs (default /bin/NAME). Programs bring
# their shared libraries along, found under SYSROOT (empty: this machine).
set -euo pipefail
[[ $# -ge 4 ]] || { sed -n '3s/^# *//p' "$0" >&2; exit 2; }
architecture=$1 guest=$2 sysroot=$3 out=$4
shift 4
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
fail() { printf 'initramfs.sh: %s\n' "$*" >&2; exit 1; }
modules=(vhci-hcd uvcvideo gspca_kinect vivid virtio_pci virtio_blk)

case $architecture in
    amd64) triple=x86_64-linux-gnu loader=lib64/ld-linux-x86-64.so.2 ;;
    arm64) triple=aarch64-linux-gnu loader=lib/ld-linux-aarch64.so.1 ;;
    *) fail "expected amd64 or arm64, not '$architecture'" ;;
esac
version=$(ls "$guest/lib/modules")
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
mkdir -p "$root"/{bin,dev,proc,sys,tmp,lib,lib64,etc,run,modules,stages}
cp "$guest/bin/busybox" "$root/bin/"
cp "$here/guest/init" "$root/"
cp "$here/guest/library.sh" "$root/lib/"
chmod +x "$root/init"

for module in "${modules[@]}"; do
    modprobe -d "$guest" -S "$version" --show-depends "$module" || fail "no module $module in $guest"
done | awk '$1 == "insmod" && !seen[$2]++ { print $2 }' | while read -r file; do
    cp "$file" "$root/modules/"
    basename "$file" >>"$root/modules/order"
done

# The libraries a file needs, and those that they need, to /lib.
libraries() {
    local name place folder
    for name in $(readelf -d "$1" 2>/dev/null | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p'); do
        [[ ! -e $root/lib/$name ]] || continue
        place=
        # The cross compiler has its own copies of the C and C++ libraries; the sysroot's come first, being what others were built with.
        for folder in "$sysroot"/{usr/lib,lib}/"$triple" "/usr/$triple/lib" "$guest"/{usr/lib,lib}/"$triple"; do
            [[ ! -e $folder/$name ]] || { place=$folder/$name; break; }
        done
        [[ -n $place ]] || fail "no $name, which $(basename "$1") needs, under ${sysroot:-/}"
        cp -L "$place" "$root/lib/$name"
        libraries "$place"
    done
}

for file in "$guest/bin/udevadm" "$@"; do
    source=${file%%:*} place=${file#*:}
    [[ $place != "$file" ]] || place=/bin/$(basename "$source")
    mkdir -p "$root/$(dirname "$place")"
    cp -rL "$source" "$root/$place"
    [[ ! -f $source ]] || libraries "$source"
done
for folder in "$sysroot"/usr/lib/"$triple" "$sysroot"/lib/"$triple" "$sysroot"/lib64 "$sysroot"/lib "/usr/$triple/lib"; do
    [[ ! -e $folder/$(basename "$loader") || -e $root/$loader ]] || cp -L "$folder/$(basename "$loader")" "$root/$loader"
done
[[ -e $root/$loader ]] || fail "no $(basename "$loader") under ${sysroot:-/}"
(cd "$root" && find . | cpio --quiet -o -H newc | gzip -1) >"$out"
