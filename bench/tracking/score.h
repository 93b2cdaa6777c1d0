// SPDX-License-Identifier: MIT
// What a tracked sequence is worth: trajectory errors, times, and what happened around a disturbance.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "core/trajectory.h"
#include "tracking/run.h"

namespace burin::bench {

// "A:B" with A < B.
bool parse_span(const std::string& text, Span* span);

// Errors in millimetres, times in milliseconds, medians under `..._p50`. Error: no trajectory error follows
// from the frames (fewer than three poses).
Result<nlohmann::ordered_json> score_run(const Run& run, const Disturbance& disturbance);

// The same as a line for people.
std::string line_of(const std::string& name, const nlohmann::ordered_json& row);

Trajectory estimate_of(const Run& run);

}  // namespace burin::bench
