#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
#     tests/rig/boot.sh amd64|arm64 GUEST INITRAMFS SECONDS [QEMU ARGUMENT...]
#
# Boots the kernel in GUEST with INITRAMFS under QEMU's emulation (no KVM) and shows its console, for SECONDS at most. What the
# guest did is for the caller to read from the console.
set -euo pipefail
[[ $# -ge 4 ]] || { sed -n '3s/^# *//p' "$0" >&2; exit 2; }
architecture=$1 guest=$2 initramfs=$3 seconds=$4
shift 4
case $architecture in
    amd64) qemu=(qemu-system-x86_64 -M q35 -cpu max) console=ttyS0 ;;
    arm64) qemu=(qemu-system-aarch64 -M virt -cpu cortex-a72) console=ttyAMA0 ;;
    *) printf 'boot.sh: expected amd64 or arm64, not %s\n' "$architecture" >&2; exit 2 ;;
esac
# An emulated processor stands still when the host is busy; the kernel would take that for its own fault.
stalls="rcupdate.rcu_cpu_stall_suppress=1 nowatchdog"
exec timeout "$seconds" "${qemu[@]}" -accel tcg -m "${RIG_MEMORY:-1024}" -smp 1 -nographic -no-reboot -nic none \
    -kernel "$guest"/boot/vmlinuz-* -initrd "$initramfs" -append "console=$console panic=-1 quiet $stalls" "$@" </dev/null 2>&1
