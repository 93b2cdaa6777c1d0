// SPDX-License-Identifier: MIT
// One program with one set of options, run several times in turn with the others.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace burin::bench {

using Json = nlohmann::ordered_json;

// What a row of the results is about.
struct Subject {
    std::string dataset, program;  // program: burin, open3d_vbg, open3d_scalable
    int voxel_mm = 0, threads = 1;
    bool colour = false;
    std::string id() const;  // burin-5mm-1t, open3d_vbg-10mm-2t, burin-5mm-1t-colour
};

struct Job {
    std::string name;  // unique within a data set
    Subject subject;
    std::vector<std::string> command;
    int first_round = 0, most_runs = 1000;
    bool required = true;       // run at least once, whatever the time
    std::vector<Json> outputs;  // one a run
    double longest_s = 0;       // of its runs
};

// Runs the command and reads the JSON object on its stdout; null with a line on stderr when it fails.
Json run_json(const std::vector<std::string>& command);
// Runs the command, its output on ours; false with a line on stderr when it fails.
bool run_plain(const std::vector<std::string>& command);

// Goes over the jobs in order, so that what is compared runs within the same minutes. A run that would go
// beyond `deadline_s` (of seconds_since_start) is left out, except the first of a required job. *ran: whether
// any ran.
bool run_round(std::vector<Job>& jobs, int round, double deadline_s, bool* ran);

double seconds_since_start();

}  // namespace burin::bench
