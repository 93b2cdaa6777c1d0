// SPDX-License-Identifier: MIT
// The last readings of something, for quantiles on demand.
#pragma once

#include <algorithm>
#include <cstdint>

namespace burin {

class Rolling {
  public:
    // Eight seconds at 30 a second.
    static constexpr int kReadings = 256;

    void add(double reading) {
        readings_[next_] = static_cast<float>(reading);
        next_ = (next_ + 1) % kReadings;
        count_ = std::min(count_ + 1, kReadings);
    }
    int count() const { return count_; }

    // q in 0..1 (0.5 the median, 1 the largest); 0 without readings.
    double quantile(double q) const {
        if (count_ == 0) return 0;
        float sorted[kReadings];
        std::copy(readings_, readings_ + count_, sorted);
        const int at = std::clamp(static_cast<int>(q * count_), 0, count_ - 1);
        std::nth_element(sorted, sorted + at, sorted + count_);
        return static_cast<double>(sorted[at]);
    }

  private:
    float readings_[kReadings] = {};
    int count_ = 0, next_ = 0;
};

}  // namespace burin
