// SPDX-License-Identifier: MIT
#include "capture/clock_map.h"

#include <algorithm>
#include <cmath>

namespace burin {
namespace {

// Differences by unsigned arithmetic: stamps are untrusted and may be anything.
std::int64_t minus(std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}
std::int64_t plus(std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

// No crystal is worse; a slope beyond this is noise in the delays of a short series.
constexpr double kMaxDrift = 500e-6;

}  // namespace

bool ClockMap::add(std::int64_t device_ns, std::int64_t host) {
    const std::int64_t offset = minus(host, device_ns);
    if (any_) {
        const std::int64_t ahead = minus(offset, minus(host_ns(device_ns), device_ns));
        if (ahead > kJump_ns || ahead < -kJump_ns || minus(device_ns, window_start_ns_) < -kJump_ns) reset();
    }
    if (!any_) {
        any_ = true;
        window_start_ns_ = device_ns;
        open_ = {device_ns, offset};
        base_ns_ = device_ns;
        base_offset_ns_ = offset;
        return true;
    }
    if (offset < open_.offset_ns) open_ = {device_ns, offset};
    if (minus(device_ns, window_start_ns_) >= kWindow_ns) {
        least_[next_] = open_;
        next_ = (next_ + 1) % kWindows;
        count_ = std::min(count_ + 1, kWindows);
        window_start_ns_ = device_ns;
        open_ = {device_ns, offset};
        fit();
    } else if (count_ == 0 && offset < base_offset_ns_) {
        base_ns_ = device_ns;  // within the first second: the least so far
        base_offset_ns_ = offset;
    }
    return false;
}

// Least squares through the least delays; then lowered so that no window lies below it.
void ClockMap::fit() {
    const Least& origin = least_[(next_ + kWindows - count_) % kWindows];
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int i = 0; i < count_; ++i) {
        const double x = static_cast<double>(minus(least_[i].device_ns, origin.device_ns));
        const double y = static_cast<double>(minus(least_[i].offset_ns, origin.offset_ns));
        sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    const double n = count_, spread = sxx - sx * sx / n;
    slope_ = count_ > 1 && spread > 0 ? std::clamp((sxy - sx * sy / n) / spread, -kMaxDrift, kMaxDrift) : 0;
    double lowest = 0;
    for (int i = 0; i < count_; ++i) {
        const double x = static_cast<double>(minus(least_[i].device_ns, origin.device_ns));
        const double y = static_cast<double>(minus(least_[i].offset_ns, origin.offset_ns)) - slope_ * x;
        lowest = i == 0 ? y : std::min(lowest, y);
    }
    base_ns_ = origin.device_ns;
    base_offset_ns_ = plus(origin.offset_ns, static_cast<std::int64_t>(std::llround(lowest)));
}

std::int64_t ClockMap::host_ns(std::int64_t device_ns) const {
    if (!any_) return device_ns;
    const double drifted = slope_ * static_cast<double>(minus(device_ns, base_ns_));
    // |drifted| < 500e-6 * 2^63 fits.
    return plus(plus(device_ns, base_offset_ns_), static_cast<std::int64_t>(std::llround(drifted)));
}

}  // namespace burin
