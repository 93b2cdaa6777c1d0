// SPDX-License-Identifier: MIT
// Where the time of integration goes, measured from outside: the parts of src/map and src/simd are called one
// by one over the chunks of real frames. The only file of the benches that follows the integrator's inner
// steps; when those change, this changes.
#pragma once

#include <vector>

#include "burin/burin.h"
#include "capture/frame.h"
#include "core/status.h"

namespace burin::bench {

// Milliseconds of one frame, each the least of several repeats.
struct StageTimes {
    double depth = 0;        // conversion, padding, tiles
    double mark = 0;         // which chunks may the band cross
    double find = 0;         // their look-up in the hash
    double observe_new = 0;  // distances of candidates that are not in the map
    double observe = 0;      // distances of the chunks that were fused
    double fuse = 0;         // their average, the chunk in cache
    double memory = 0;       // the same with the chunks in the map, less `fuse`: bringing them in and out
    int candidates = 0, absent = 0, fused = 0;
};

// Fuses the frames in order into a map of its own; one entry a frame.
Result<std::vector<StageTimes>> time_stages(const std::vector<Frame>& frames, const burin_config& config,
                                            int repeats);

}  // namespace burin::bench
