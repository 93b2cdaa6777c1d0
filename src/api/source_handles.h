// SPDX-License-Identifier: MIT
// Handles of sources: those of maps (handles.h) in small.
#pragma once

#include <atomic>
#include <cstdio>

#include "burin/capture.h"
#include "capture/live_source.h"
#include "core/status.h"

namespace burin {

struct SourceObject {
    LiveSource source;
    burin_log log = nullptr;
    void* log_user = nullptr;
    std::atomic<bool> busy{false};
    char error[512] = "";

    static void tell_log(void* object, LogLevel level, const char* line) {
        const auto* o = static_cast<SourceObject*>(object);
        o->log(o->log_user, static_cast<burin_log_level>(level), line);  // the levels have the same numbers
    }
};

inline constexpr std::uint32_t kMaxSources = 16;

// False: all places are taken.
bool register_source(SourceObject* object, burin_source* handle);
void unregister_source(burin_source handle);
// Null when the handle is null, stale or was never given out.
SourceObject* object_of(burin_source handle);

// Text of burin_source_error for calls without a source; one a thread, 512 bytes.
char* source_thread_error();

// Keeps the line of an error.
inline burin_status tell(char* line, const Status& status) {
    if (!status.ok()) std::snprintf(line, 512, "%s", status.text());
    return static_cast<burin_status>(status.code());
}

inline Status null_argument(const char* name) {
    return Status::error(Code::invalid_argument, "%s is null", name);
}

}  // namespace burin
