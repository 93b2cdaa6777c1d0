// SPDX-License-Identifier: MIT
// The parts of the bench that run once, beside the rounds.
#pragma once

#include <string>

#include "suite/plan.h"

namespace burin::bench {

// The range of frames that suits the data set and the kind of run.
std::string frames_of(const Options& options, const std::string& dataset);

// "observe_chunk/avx3": processor time in ns, one entry a kernel and target. Empty when they were not built.
Json kernels(const Options& options);

// Bench_roofline over the data set: its table on stdout, its figures as report["roofline"] (flat) and
// report["roofline_runs"].
bool roofline(const Options& options, const std::string& dataset, const std::string& frames, Json* report);

// Peak memory after 200 frames at 5 mm with and without colour, bytes a square metre, scratch of the full
// mesh.
Json memory(const Options& options, const std::string& dataset);

// Shares of surface within two voxels of the other's, for both of Open3D's volumes and both voxels. After the
// rounds.
Json coverage(const Options& options, const std::string& dataset, const std::string& frames);

}  // namespace burin::bench
