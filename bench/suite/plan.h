// SPDX-License-Identifier: MIT
// What is run: the programs with their options, for one data set.
#pragma once

#include <string>
#include <vector>

#include "suite/job.h"

namespace burin::bench {

struct Options {
    std::string build, data, results, json_file, frames, machine, commit;
    std::vector<std::string> datasets;  // folders
    bool quick = false, open3d = false;
    int rounds = 3, warm = 10, nice = 0, minutes = 15;
    double deadline_s = 1e9, spent_s = 0;
};

// frames: "A:B"; every program decodes them into memory first.
std::vector<Job> plan_jobs(const Options& options, const std::string& dataset, const std::string& frames);

// Name of the job that measures the machine itself; the others have that of their subject, "-incremental"
// behind it when the changed chunks are meshed after every frame.
inline constexpr const char* kMachine = "machine";

// Where Open3D's mesh of this data set and voxel is left.
std::string peer_mesh(const Options& options, const std::string& dataset, const std::string& program,
                      int voxel_mm);

}  // namespace burin::bench
