// SPDX-License-Identifier: MIT
// A fused frame in the terms of the C interface.
#pragma once

#include "api/handles.h"
#include "api/log.h"

namespace burin {

// Tells the log, once a map, that the pool is full.
inline burin_frame_result frame_result(const FrameReport& r, MapState* state) {
    std::uint32_t flags = 0;
    if (r.chunks.dropped > 0) flags |= BURIN_FLAG_POOL_FULL;
    if (r.store_full) flags |= BURIN_FLAG_STORE_FULL;
    if (r.store_failed) flags |= BURIN_FLAG_STORE_FAILED;
    if (r.chunks.dropped > 0 && !state->told_full) {
        state->told_full = true;
        log_line(BURIN_LOG_WARNING, "the map is full, chunks are dropped: raise budget_bytes or voxel_m");
    }
    return {flags,          r.chunks.fused, r.chunks.added, r.chunks.carved, r.chunks.dropped,
            r.valid_pixels, r.depth_ms,     r.integrate_ms, r.planes_ms};
}

}  // namespace burin
