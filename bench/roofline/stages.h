// SPDX-License-Identifier: MIT
// Where the time of integration goes: the integrator's own laps over real frames.
#pragma once

#include <vector>

#include "burin/burin.h"
#include "capture/frame.h"
#include "core/status.h"
#include "map/integrator.h"

namespace burin::bench {

struct StageTimes {
    double depth = 0;  // ms: conversion, padding, tiles
    IntegrationTimes integrate;
    double fused = 0;  // chunks
};

// Fuses the frames in order into a map of its own, `passes` times; for each frame and stage the least.
Result<std::vector<StageTimes>> time_stages(const std::vector<Frame>& frames, const burin_config& config,
                                            int passes);

}  // namespace burin::bench
