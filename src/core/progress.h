// SPDX-License-Identifier: MIT
// How far a long call is, told to whoever asked, who may stop it.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>

#include "core/status.h"

namespace burin {

class Progress {
  public:
    // Not 0 to stop. `done` runs from 0 to 1.
    using Callback = int (*)(void* user, double done);

    Progress() = default;  // tells nobody
    // A call of `stages` stages, taken as equally long.
    Progress(Callback callback, void* user, int stages) : callback_(callback), user_(user), stages_(stages) {}
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    // Item `item` of `count` of this stage comes next. False: stop, from now on. When several threads report
    // at a time, one of them does and the others go on.
    bool report(std::uint64_t item, std::uint64_t count) {
        if (!callback_) return true;
        if (telling_.test_and_set(std::memory_order_acquire)) return !stopped();
        if (!stopped()) {
            done_ =
                std::max(done_, (stage_ + static_cast<double>(item) / static_cast<double>(count)) / stages_);
            if (callback_(user_, done_) != 0) stopped_.store(true, std::memory_order_relaxed);
        }
        telling_.clear(std::memory_order_release);
        return !stopped();
    }
    void next_stage() { stage_ = std::min(stage_ + 1, stages_); }
    bool stopped() const { return stopped_.load(std::memory_order_relaxed); }

    // The end of the call: its error when it was stopped; otherwise tells 1, and no answer changes anything.
    Status finish() {
        if (stopped())
            return Status::error(Code::cancelled, "cancelled by the progress callback at %.0f %%",
                                 100 * done_);
        if (callback_) callback_(user_, 1.0);
        return {};
    }

  private:
    Callback callback_ = nullptr;
    void* user_ = nullptr;
    int stages_ = 1, stage_ = 0;
    double done_ = 0;
    std::atomic<bool> stopped_{false};
    std::atomic_flag telling_;
};

}  // namespace burin
