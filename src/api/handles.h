// SPDX-License-Identifier: MIT
// Handles of the C API: a table of slots with generations, so that a handle used after burin_destroy is
// recognised.
#pragma once

#include <atomic>
#include <cstdint>

#include "burin/burin.h"
#include "core/jobs.h"
#include "session/fusion_session.h"

namespace burin {

// What lives at the start of the caller's memory.
struct MapState {
    FusionSession session;
    Jobs jobs;
    burin_hooks hooks = {};
    bool told_full = false;  // the log knows that the pool is full
    burin_config config;
    std::uint64_t bytes = 0;
    std::atomic<bool> busy{false};  // a call is under way
    char error[512] = "";

    explicit MapState(int threads) : jobs(threads) {}
};

// Registers a state; the null handle when all 64 places are taken.
burin_map register_map(MapState* state);
// Null when the handle is null, stale or was never given out.
MapState* state_of(burin_map map);
void unregister_map(burin_map map);

// Text of burin_last_error for calls without a map; one a thread.
char* thread_error();  // 512 bytes

}  // namespace burin
