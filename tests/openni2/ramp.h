// SPDX-License-Identifier: MIT
// What the driver under test sends, and its test expects.
#pragma once

#include <cstdint>

inline constexpr int kRampWidth = 320, kRampHeight = 240, kRampFps = 60;

inline std::uint16_t ramp_depth_mm(int x, int y, int n) {
    return static_cast<std::uint16_t>(500 + (x + 2 * y + n) % 4000);
}
inline std::uint8_t ramp_colour(int x, int y, int channel, int n) {
    return static_cast<std::uint8_t>(x + y * 3 + channel * 50 + n);
}
