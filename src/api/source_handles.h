// SPDX-License-Identifier: MIT
// Sources and recorders behind the handles of capture.h, and how every call on one runs.
#pragma once

#include <atomic>
#include <cstdio>

#include "api/handle_table.h"
#include "burin/capture.h"
#include "capture/live_source.h"
#include "capture/recording_writer.h"
#include "core/status.h"

namespace burin {

struct SourceObject {
    static constexpr const char* kWhat = "source";
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

struct RecorderObject {
    static constexpr const char* kWhat = "recorder";
    RecordingWriter writer;
    DeviceInfo info;  // of the source
    std::atomic<bool> busy{false};
    char error[512] = "";
};

using SourceTable = HandleTable<SourceObject, 16>;
using RecorderTable = HandleTable<RecorderObject, 16>;
SourceTable& sources();
RecorderTable& recorders();

// Text for calls without an object; one a thread, 512 bytes.
char* source_thread_error();

// Keeps the line of an error.
inline burin_status tell(char* line, const Status& status) {
    if (!status.ok()) std::snprintf(line, 512, "%s", status.text());
    return static_cast<burin_status>(status.code());
}

inline Status null_argument(const char* name) {
    return Status::error(Code::invalid_argument, "%s is null", name);
}

// The object, for the length of one call; or null, with the status told.
template <class Object>
Object* enter(Object* object, burin_status* status) {
    Status refused;
    if (!object)
        refused = Status::error(Code::state, "the %s is null, closed or was never opened", Object::kWhat);
    else if (object->busy.exchange(true))
        refused = Status::error(Code::state, "the %s is in use by another thread", Object::kWhat);
    else
        return object;
    *status = tell(source_thread_error(), refused);
    return nullptr;
}

// One call: body(object) gives a Status, whose line the object keeps.
template <class Object, class Body>
burin_status call_on(Object* object, Body&& body) {
    burin_status status = BURIN_OK;
    if (!enter(object, &status)) return status;
    status = tell(object->error, body(*object));
    object->busy.store(false);
    return status;
}

}  // namespace burin
