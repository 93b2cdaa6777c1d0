// SPDX-License-Identifier: MIT
// Which kernels run: the best that the machine has, unless the environment variable BURIN_SIMD names another
// limit. It is read at the first use; upper or lower case; no target above the named one is used (scalar <
// sse4 < avx2 < avx3 < avx3_dl, scalar < neon < sve < sve2). A name that does not exist limits nothing;
// target_name() and the report of `burin fuse` tell what runs.
#pragma once

#include <string>
#include <vector>

namespace burin::simd {

// Name of the target in use: "scalar", "sse4", "avx2", "avx3", "neon", ... Static.
const char* target_name();

// Names of all targets that this build holds and this machine runs, best first, "scalar" last.
std::vector<std::string> target_names();

// Makes the kernels run on the named target from now on; false when it is not among target_names(). Not to be
// called while kernels run: for start-up and tests. An empty name gives back the best.
bool select_target(const std::string& name);

// Whether the scalar specification itself is to be called. For the kernels' entry points.
bool scalar_selected();

}  // namespace burin::simd
