// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace burin {

// Stamps may come from anywhere: the difference is right also where it would not fit 64 bits.
inline double seconds_between(std::int64_t from_ns, std::int64_t to_ns) {
    const auto from = static_cast<std::uint64_t>(from_ns), to = static_cast<std::uint64_t>(to_ns);
    return to_ns >= from_ns ? static_cast<double>(to - from) * 1e-9 : static_cast<double>(from - to) * -1e-9;
}

}  // namespace burin
