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

# keep_rows ROWS SCRATCH: into the table of this machine, $csv. Rows of the same machine, commit, kind and sequence give
# way to the new ones, all others stay.
keep_rows() {
    csv=$_top/bench/results/$machine.csv
    [[ -f $csv ]] || echo 'machine,commit,run,dataset,program,voxel_mm,threads,colour,metric,value' >"$csv"
    cut -d, -f1-4 "$1" | sort -u >"$2/replaced"
    awk -F, 'NR == FNR { replaced[$0] = 1; next } !(($1 "," $2 "," $3 "," $4) in replaced)' "$2/replaced" "$csv" >"$csv.new"
    cat "$1" >>"$csv.new"
    mv "$csv.new" "$csv"
}
