# SPDX-License-Identifier: MIT
# What a stage is written with. A stage is a list of lines
#
#     plug EMULATOR [OPTION...]       an emulated device; the one before is unplugged
#     check NAME COMMAND...           RIG NAME ok|FAIL and the command's last line
#
# Each check's name stands in the script as it is: run.sh reads there which results it has to find.

emulator_pid=

plug() {
    unplug
    rm -f /tmp/fifo
    "$@" -F /tmp/fifo >/tmp/emulator.log 2>&1 &
    emulator_pid=$!
    wait_for configured
}

# The host has given it a configuration: its interface is there.
configured() { any /sys/bus/usb/devices/[0-9]-[1-9]:1.0; }

unplug() {
    [ -n "$emulator_pid" ] || return 0
    kill "$emulator_pid" 2>/dev/null
    wait "$emulator_pid" 2>/dev/null
    emulator_pid=
    wait_for no_usb
}

# Nothing is plugged in, and the kernel has done with every port (state 4).
no_usb() {
    ! any /sys/bus/usb/devices/[0-9]-[1-9] && ! grep '^[hs]s ' /sys/devices/platform/vhci_hcd.0/status | grep -qv '^[hs]s *[0-9]* 004 '
}

# One of these files exists. (ls of several fails already when one goes meanwhile.)
any() {
    for file in "$@"; do
        [ ! -e "$file" ] || return 0
    done
    return 1
}

# tell WORDS...: a command to the emulator (emulators/faults.h).
tell() { echo "$*" >/tmp/fifo; }

# Asks again for ten seconds.
wait_for() {
    n=0
    until "$@"; do
        n=$((n + 1))
        [ $n -lt 200 ] || return 1
        usleep 50000
    done
}

uptime_cs() { cut -d' ' -f1 /proc/uptime | tr -d .; }
seconds_since() { t=$(($(uptime_cs) - $1)); echo "$((t / 100)).$((t % 100 / 10)) s"; }

# check NAME COMMAND...: RIG_LIMIT seconds at most (60).
check() {
    name=$1 began=$(uptime_cs)
    shift
    if timeout -s KILL "${RIG_LIMIT:-60}" "$@" >/tmp/out 2>&1; then
        echo "RIG $name ok $(tail -n 1 /tmp/out) [$(seconds_since $began)]"
    else
        echo "RIG $name FAIL ($?) $(tail -n 1 /tmp/out) [$(seconds_since $began)]"
        sed 's/^/rig:   /' /tmp/out | tail -n 12
        tail -n 4 /tmp/emulator.log 2>/dev/null | sed 's/^/rig:   /'
        dmesg | tail -n 4 | sed 's/^/rig:   /'
    fi
}

# check_not NAME COMMAND...: the command has to fail by itself, with a message; not by a signal, and not for want of time.
check_not() {
    name=$1 began=$(uptime_cs)
    shift
    timeout -s KILL "${RIG_LIMIT:-60}" "$@" >/tmp/out 2>&1
    code=$?
    if [ $code -ge 1 ] && [ $code -lt 124 ] && [ -s /tmp/out ]; then
        echo "RIG $name ok $(tail -n 1 /tmp/out) [$(seconds_since $began)]"
    else
        echo "RIG $name FAIL ($code) $(tail -n 1 /tmp/out) [$(seconds_since $began)]"
    fi
}

# hand_out NAME FOLDER: to the second disk (one for each guest); host/NAME.sh judges it, and its line is RIG NAME.
hand_out() { tar cf /dev/vdb -C "$(dirname "$2")" "$(basename "$2")"; }

# node DRIVER [INTERFACE [INDEX]]: path of the capture node of a driver, when it is there; a UVC camera has several. INTERFACE
# is its control interface (0 depth and infrared, 3 colour), INDEX 0 depth, 1 its metadata, 2 infrared, 3 its metadata.
node() {
    n=0
    while [ $n -lt 200 ]; do
        for entry in /sys/class/video4linux/video*; do
            [ -e "$entry/device/driver" ] || continue
            [ "$(basename "$(readlink -f "$entry/device/driver")")" = "$1" ] || continue
            case $(readlink -f "$entry/device") in *":1.${2:-0}" | *vivid*) ;; *) continue ;; esac
            [ "$(cat "$entry/index")" = "${3:-0}" ] || continue
            echo "/dev/$(basename "$entry")"
            return
        done
        n=$((n + 1))
        usleep 50000
    done
    echo "/dev/no-node-of-$1"
}

# kernel_faults: what the kernel says of its own faults, if anything. calm: there is nothing, half a second after something was plugged
# in; a command, for check.
cat >/bin/kernel_faults <<'END'
#!/bin/sh
dmesg | grep -E ' BUG: |Oops|Call Trace|use-after-free|refcount_t|general protection|soft lockup'
END
cat >/bin/calm <<'END'
#!/bin/sh
usleep 500000
! kernel_faults || exit 1
dmesg | tail -n 1
END
chmod +x /bin/kernel_faults /bin/calm
