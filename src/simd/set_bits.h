// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace burin::simd {

// place[b] lists the places of the set bits of b, lowest first; what follows them is 0.
struct SetBits {
    alignas(64) std::uint8_t place[256][8] = {};
    constexpr SetBits() {
        for (int byte = 0; byte < 256; ++byte) {
            int count = 0;
            for (int bit = 0; bit < 8; ++bit)
                if (byte >> bit & 1) place[byte][count++] = static_cast<std::uint8_t>(bit);
        }
    }
};
inline constexpr SetBits kSetBits;

}  // namespace burin::simd
