// SPDX-License-Identifier: MIT
#pragma once

namespace burin {

// Round to nearest, ties to even, for |x| < 2^22, by adding and subtracting 1.5 * 2^23: the addition itself
// rounds, so there is no library call and the bits are those of every vector unit's own conversion.
inline int round_to_int(float x) {
    const float magic = 12582912.0f;
    return static_cast<int>((x + magic) - magic);
}

}  // namespace burin
