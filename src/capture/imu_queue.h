// SPDX-License-Identifier: MIT
// Readings between frames, in fixed memory. No locks of its own.
#pragma once

#include <cstdint>

#include "capture/clock_map.h"
#include "core/imu.h"

namespace burin {

class ImuQueue {
  public:
    // Two seconds of the fastest sensor at hand (1 kHz).
    static constexpr int kSamples = 2048;

    void reset() { *this = ImuQueue(); }
    // Readings out of order are passed over; the oldest goes when there is no room.
    void add(const ImuSample& sample);
    // Readings that came before the clocks' relation was known move to the host's clock.
    void map(const ClockMap& clock);
    // A reading at or after t_ns has come.
    bool reaches(std::int64_t t_ns) const { return count_ > 0 && at(count_ - 1).t_ns >= t_ns; }
    // Readings for a frame at t_ns in the way of Frame::imu, into `out` (kSamples); those before are
    // forgotten.
    int take(std::int64_t t_ns, ImuSample* out);

  private:
    const ImuSample& at(int i) const { return samples_[(first_ + i) % kSamples]; }
    ImuSample samples_[kSamples];
    int first_ = 0, count_ = 0;
    bool any_frame_ = false;
};

}  // namespace burin
