// SPDX-License-Identifier: MIT
// How every function of the C boundary runs: check, translate, call, and turn the outcome into a status with
// a line.
#pragma once

#include <cstdio>

#include "api/handles.h"
#include "api/log.h"
#include "core/status.h"

namespace burin {

inline burin_status report(char* error, const Status& status) {
    if (!status.ok()) {
        std::snprintf(error, 512, "%s", status.text());
        log_line(BURIN_LOG_ERROR, error);
    }
    return static_cast<burin_status>(status.code());
}

// One call on one map: finds the state, refuses a second thread, keeps the error text.
class Call {
  public:
    explicit Call(burin_map map) : state_(state_of(map)) {
        if (!state_) {
            entry_ = Status::error(Code::state, "the map is null, destroyed or was never created");
        } else if (state_->busy.exchange(true)) {
            entry_ = Status::error(Code::state, "the map is in use by another thread");
            state_ = nullptr;
        }
    }
    ~Call() {
        if (state_) state_->busy.store(false);
    }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

    // Runs body(state) unless the map could not be entered.
    template <class Body>
    burin_status run(Body&& body) {
        if (!state_) return report(thread_error(), entry_);
        return report(state_->error, body(*state_));
    }

  private:
    MapState* state_;
    Status entry_;
};

// Watches the long work of one call: `stages` stages of about the same length.
class Watch {
  public:
    Watch(MapState& state, int stages)
        : progress(state.hooks.progress, state.hooks.user, stages), jobs_(state.jobs) {
        jobs_.watch(&progress);
    }
    ~Watch() { jobs_.watch(nullptr); }
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    Progress progress;

  private:
    Jobs& jobs_;
};

inline Status null_argument(const char* name) {
    return Status::error(Code::invalid_argument, "%s is null", name);
}

}  // namespace burin
