// SPDX-License-Identifier: MIT
// From a device's clock to the host's, with its drift. What the host sees is device time plus an offset plus
// a delay that is never negative but often large (transfer, scheduling), so the offset is where the smallest
// delays are: the least one of each window, and a line through those of the last windows. (The convex-hull
// and windowed-minimum filters of Moon, Skelly, Towsley, "Estimation and removal of clock skew from network
// delay measurements", INFOCOM 1999, in the windowed form.)
#pragma once

#include <cstdint>

namespace burin {

class ClockMap {
  public:
    void reset() { *this = ClockMap(); }

    // One image: its device time and when its last byte had come. Device time that jumps by more than
    // kJump_ns against the host's (a device that restarted) begins anew. True: it was the first, or began
    // anew.
    bool add(std::int64_t device_ns, std::int64_t host_ns);

    // Host time at which the device's clock showed device_ns, but for the least delay there is. Before any
    // add(): device_ns.
    std::int64_t host_ns(std::int64_t device_ns) const;

    // How much faster the device's clock runs, parts per million; 0 until two windows have passed.
    double drift_ppm() const { return -slope_ * 1e6; }
    int windows() const { return count_; }

    // A crystal is within 100 ppm and scheduling within a second; what is beyond is another epoch.
    static constexpr std::int64_t kJump_ns = 2'000'000'000;

  private:
    // A second holds 30 images, one of which comes with next to no delay; 32 windows are what the drift of a
    // warming crystal is steady over.
    static constexpr std::int64_t kWindow_ns = 1'000'000'000;
    static constexpr int kWindows = 32;
    struct Least {
        std::int64_t device_ns = 0, offset_ns = 0;  // host - device
    };
    void fit();

    Least least_[kWindows];  // of closed windows, a ring
    int count_ = 0, next_ = 0;
    Least open_;  // of the window under way
    std::int64_t window_start_ns_ = 0;
    bool any_ = false;
    // offset(device) = base_offset_ns_ + slope_ * (device - base_ns_)
    std::int64_t base_ns_ = 0, base_offset_ns_ = 0;
    double slope_ = 0;
};

}  // namespace burin
