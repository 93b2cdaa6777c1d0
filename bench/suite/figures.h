// SPDX-License-Identifier: MIT
// From the runs of a data set to figures: for each frame the least time over all runs, then the median over
// the frames after the first few, which is what a machine with nothing else to do would show. Plain medians
// stand beside.
#pragma once

#include <string>
#include <vector>

#include "suite/plan.h"

namespace burin::bench {

// {frame_ms, frame_cpu_ms, frame_plain_ms, depth_ms, integrate_ms, mesh_ms, mesh_cpu_ms, mesh_full_ms, ...}
// of one job.
Json figures_of(const Job& job, int warm);

// The ratios and frames a second that the runs allow; null for those whose runs are missing. One thread is
// compared in processor time, two threads by the wall clock.
Json ratios_of(const std::vector<Job>& jobs, int warm);

// Over several data sets, for every ratio the least favourable.
Json worst_of(const std::vector<Json>& ratios);

}  // namespace burin::bench
