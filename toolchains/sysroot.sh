#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
#     toolchains/sysroot.sh arm64|armhf FOLDER PACKAGE...
#
# Unpacks packages of another architecture, with all they depend on, from the distribution's archive into FOLDER. That
# is what `dpkg --add-architecture` and `apt-get install PACKAGE:arm64` give, in a folder of its own: needs no root, and
# nothing of the host is upgraded or added to (libraries of two architectures must have one version, so that installing
# libpng-dev:arm64 upgraded 18 packages of the host, and one architecture whose lists the mirror has not finished copying
# makes every later `apt-get update` fail). Sources, keys and proxies are the host's. Nothing is done when the folder
# already holds these packages.
set -euo pipefail
[[ $# -ge 3 ]] || { sed -n '3s/^# *//p' "$0" >&2; exit 2; }
architecture=$1 folder=$2
shift 2
fail() { printf 'sysroot.sh: %s\n' "$*" >&2; exit 1; }
[[ $(cat "$folder/.packages" 2>/dev/null) != "$*" ]] || exit 0

rm -rf "$folder" "$folder.apt"
mkdir -p "$folder" "$folder.apt"/{lists,archives}/partial
: >"$folder.apt/status"
place=$(cd "$folder.apt" && pwd)
apt=(apt-get -q -o APT::Architecture="$architecture" -o APT::Architectures="$architecture"
    -o Dir::State="$place" -o Dir::State::status="$place/status" -o Dir::Cache="$place" -o APT::Sandbox::User=)
# One of several sources may fail; whether what the others have is enough, the next step tells.
"${apt[@]}" update >"$place/log" 2>&1 || true
"${apt[@]}" install -y --download-only --no-install-recommends "$@" >>"$place/log" 2>&1 </dev/null ||
    { tail -n 20 "$place/log" >&2; fail "apt-get could not fetch for $architecture: $*"; }
for package in "$place"/archives/*.deb; do dpkg-deb --extract "$package" "$folder"; done

# Links to absolute paths would lead into the host.
find "$folder" -type l -lname '/*' -print0 | while IFS= read -r -d '' link; do
    ln -snfr "$folder$(readlink "$link")" "$link"
done
rm -rf "$place"
printf '%s' "$*" >"$folder/.packages"
