// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "map/volume.h"

namespace burin {

// The last 512 chunks asked for, by their place modulo 8 in each direction: points of one image or one ray
// ask for few. Valid while nobody inserts or removes chunks.
class ChunkMemo {
  public:
    explicit ChunkMemo(const Volume& volume) : volume_(volume) {}

    std::uint32_t find(ChunkKey key) {
        Entry& entry = entry_of(key);
        if (entry.key != key) entry = {key, volume_.find(key)};
        return entry.slot;
    }
    // Asks the cache for what find(key) will read.
    void prefetch(ChunkKey key) const {
        if (entry_of(key).key != key) volume_.prefetch(key);
    }

  private:
    struct Entry {
        ChunkKey key = 0;
        std::uint32_t slot = kNoChunk;
    };
    static std::size_t index_of(ChunkKey key) { return (key & 7) | (key >> 18 & 0x38) | (key >> 36 & 0x1c0); }
    Entry& entry_of(ChunkKey key) { return entries_[index_of(key)]; }
    const Entry& entry_of(ChunkKey key) const { return entries_[index_of(key)]; }

    const Volume& volume_;
    Entry entries_[512];
};

}  // namespace burin
