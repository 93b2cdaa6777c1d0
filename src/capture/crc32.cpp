// SPDX-License-Identifier: MIT
#include "capture/crc32.h"

#include <array>
#include <cstring>

namespace burin {
namespace {

// Eight bytes a step by eight tables ("slicing by 8", Kounavis and Berry, ISCC 2005): table[k][b] is byte b's
// share of the remainder when k more bytes follow it.
constexpr int kSlices = 8;
using Tables = std::array<std::array<std::uint32_t, 256>, kSlices>;

constexpr Tables make_tables() {
    Tables t{};
    for (std::uint32_t b = 0; b < 256; ++b) {
        std::uint32_t r = b;
        for (int bit = 0; bit < 8; ++bit) r = (r >> 1) ^ ((r & 1) ? 0xedb88320u : 0);
        t[0][b] = r;
    }
    for (std::size_t k = 1; k < kSlices; ++k)
        for (std::size_t b = 0; b < 256; ++b) t[k][b] = (t[k - 1][b] >> 8) ^ t[0][t[k - 1][b] & 255];
    return t;
}
constexpr Tables kTables = make_tables();

}  // namespace

std::uint32_t crc32(const void* data, std::size_t bytes, std::uint32_t crc) {
    const auto* p = static_cast<const unsigned char*>(data);
    std::uint32_t r = ~crc;
    for (; bytes >= kSlices; bytes -= kSlices, p += kSlices) {
        std::uint32_t low, high;  // little-endian, as every machine at hand
        std::memcpy(&low, p, 4);
        std::memcpy(&high, p + 4, 4);
        low ^= r;
        r = kTables[7][low & 255] ^ kTables[6][(low >> 8) & 255] ^ kTables[5][(low >> 16) & 255] ^
            kTables[4][low >> 24] ^ kTables[3][high & 255] ^ kTables[2][(high >> 8) & 255] ^
            kTables[1][(high >> 16) & 255] ^ kTables[0][high >> 24];
    }
    for (; bytes > 0; --bytes, ++p) r = (r >> 8) ^ kTables[0][(r ^ *p) & 255];
    return ~r;
}

}  // namespace burin
