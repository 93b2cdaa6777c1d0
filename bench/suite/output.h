// SPDX-License-Identifier: MIT
// The results: rows of a CSV file that grows over commits, a table for people, one JSON object.
#pragma once

#include <string>
#include <vector>

#include "suite/plan.h"

namespace burin::bench {

// machine,commit,run,dataset,program,voxel_mm,threads,colour,metric,value for everything in the report. Rows
// of the same machine, commit and kind of run that the file already holds are replaced, all others stay.
bool write_csv(const std::string& path, const Options& options, const Json& report);

// Markdown: the ratios beside their aims, then every program's times.
std::string table_of(const Options& options, const Json& report);

bool write_text(const std::string& path, const std::string& text);

}  // namespace burin::bench
