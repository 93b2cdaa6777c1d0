// SPDX-License-Identifier: MIT
// A device's 32-bit tick counter as nanoseconds that never wrap. All streams of a device share one counter
// and so one of these.
#pragma once

#include <cmath>
#include <cstdint>

namespace burin {

class TickClock {
  public:
    // At 60 MHz the counter wraps every 71.6 s.
    void reset(double ticks_per_second) { *this = TickClock(), ns_per_tick_ = 1e9 / ticks_per_second; }

    // Nanoseconds on the device's clock. The host's clock says how often the counter went round while nothing
    // came; stamps may come a little out of order, as those of two streams do. False: the stamp is kJump_ns
    // or more from where the host's clock has the device, as that of a corrupt packet; when the next ones are
    // there too, the device has jumped and they are taken.
    bool ns(std::uint32_t ticks, std::int64_t host_ns, std::int64_t* device_ns) {
        if (!any_) {
            any_ = true;
            last_ = ticks;
        } else {
            const double passed = static_cast<double>(host_ns - host_ns_) / ns_per_tick_;
            const double ahead = static_cast<std::int32_t>(ticks - static_cast<std::uint32_t>(last_));
            const double step = ahead + std::nearbyint((passed - ahead) / kRound) * kRound;
            if (std::fabs(step - passed) * ns_per_tick_ > kJump_ns && ++jumps_ < kJumps) return false;
            last_ += static_cast<std::int64_t>(step);
        }
        jumps_ = 0;
        host_ns_ = host_ns;
        *device_ns = static_cast<std::int64_t>(static_cast<double>(last_) * ns_per_tick_);
        return true;
    }

  private:
    static constexpr double kRound = 4294967296.0;
    // Transfer and scheduling delay images by less.
    static constexpr double kJump_ns = 2e9;
    static constexpr int kJumps = 5;
    double ns_per_tick_ = 0;
    bool any_ = false;
    int jumps_ = 0;
    std::int64_t last_ = 0, host_ns_ = 0;
};

}  // namespace burin
