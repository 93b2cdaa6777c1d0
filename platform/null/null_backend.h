// SPDX-License-Identifier: MIT
// A sensor that is always there: a depth ramp and a colour chequerboard, made on the spot. For applications'
// tests and as the smallest example of a back end. Addresses: "" or "WIDTHxHEIGHT@FPS", e.g.
// "null:320x240@90".
#pragma once

#include "capture/source.h"

namespace burin {

extern const SourceBackend kNullBackend;

// The image of depth with this sequence number: 1000 + (x + y + sequence) % 2048 millimetres.
inline std::uint16_t null_depth_mm(int x, int y, std::uint64_t sequence) {
    return static_cast<std::uint16_t>(1000 + (static_cast<std::uint64_t>(x + y) + sequence) % 2048);
}

}  // namespace burin
