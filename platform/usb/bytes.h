// SPDX-License-Identifier: MIT
// Numbers on the wire: little-endian but where it says otherwise, at any address.
#pragma once

#include <cstdint>
#include <cstring>

namespace burin {

inline std::uint16_t le16(const std::uint8_t* p) { return static_cast<std::uint16_t>(p[0] | p[1] << 8); }
inline std::uint16_t be16(const std::uint8_t* p) { return static_cast<std::uint16_t>(p[0] << 8 | p[1]); }
inline std::uint32_t le32(const std::uint8_t* p) {
    return le16(p) | static_cast<std::uint32_t>(le16(p + 2)) << 16;
}
inline float le_float(const std::uint8_t* p) {
    const std::uint32_t bits = le32(p);
    float value;
    std::memcpy(&value, &bits, 4);
    return value;
}
inline void put_le16(std::uint8_t* p, unsigned value) {
    p[0] = static_cast<std::uint8_t>(value);
    p[1] = static_cast<std::uint8_t>(value >> 8);
}

}  // namespace burin
