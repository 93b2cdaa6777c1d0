// SPDX-License-Identifier: MIT
// CRC-32 of IEEE 802.3 (reflected, 0xEDB88320), the one of zlib: recordings can be checked with what every
// language brings along.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin {

// Of `bytes` bytes; `crc` is that of what came before them, 0 at the start.
std::uint32_t crc32(const void* data, std::size_t bytes, std::uint32_t crc = 0);

}  // namespace burin
