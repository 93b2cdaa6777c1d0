# SPDX-License-Identifier: MIT
# Sourced by the scripts that write bench/results: what names this machine and the sources, in $machine and $commit.

# Its processor and how many of them there are; BURIN_MACHINE overrides.
machine=${BURIN_MACHINE:-$(sed -n 's/^model name[^:]*: *//p' /proc/cpuinfo | head -n 1)}
[[ -n $machine ]] || machine=$(uname -m)
[[ -n ${BURIN_MACHINE:-} ]] || machine="$machine x$(nproc)"
machine=$(tr -cs 'A-Za-z0-9\n' '-' <<<"${machine,,}" | sed 's/^-//; s/-$//')
_top=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
commit=$(git -C "$_top" rev-parse --short HEAD 2>/dev/null || echo unknown)
git -C "$_top" diff --quiet HEAD -- . ':!bench/results' 2>/dev/null || commit+=+  # with changes of its own
