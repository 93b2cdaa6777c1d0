// SPDX-License-Identifier: MIT
// Where the chunks of the store lie: an open-addressing hash of fixed size from key to place, 36 bytes a
// chunk.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/arena.h"
#include "core/hash.h"
#include "map/chunk.h"

namespace burin {

class ChunkIndex {
  public:
    struct Entry {
        ChunkKey key = 0;  // 0: empty
        std::uint64_t checksum = 0;
        std::uint32_t place = 0;      // in the file, units of 2 KiB, below 2^28 (512 GiB); and four flags
        std::uint32_t last_seen = 0;  // of the chunk when it left
        static constexpr std::uint32_t kResident = 1u << 31;  // the volume has it
        static constexpr std::uint32_t kFree = 1u << 30;      // nothing but free space: never carved
        static constexpr int kFlags = 28;                     // here begin kChunkDirty and kChunkStale
        static constexpr std::uint32_t kPlaces = 1u << 28;
        bool resident() const { return (place & kResident) != 0; }
        bool free() const { return (place & kFree) != 0; }
        std::uint64_t offset() const { return std::uint64_t{place & (kPlaces - 1)} * 2048; }
    };

    // Room for so many chunks; the table is at most 2/3 full.
    void place(Arena& arena, std::uint32_t chunks) {
        capacity_ = chunks;
        size_ = chunks == 0 ? 0 : chunks + chunks / 2 + 1;
        table_ = arena.allocate<Entry>(size_, 64);
    }
    void clear() {
        count_ = 0;
        for (std::uint32_t i = 0; i < size_; ++i) table_[i] = {};
    }
    std::uint32_t capacity() const { return capacity_; }
    std::uint32_t count() const { return count_; }

    Entry* find(ChunkKey key) const {
        for (std::uint32_t i = home(key);; i = i + 1 == size_ ? 0 : i + 1) {
            if (table_[i].key == key) return &table_[i];
            if (table_[i].key == 0) return nullptr;
        }
    }
    // The entry of a key, made when absent; null when there is no room for one more.
    Entry* insert(ChunkKey key) {
        std::uint32_t i = home(key);
        for (; table_[i].key != key; i = i + 1 == size_ ? 0 : i + 1) {
            if (table_[i].key != 0) continue;
            if (count_ == capacity_) return nullptr;
            ++count_;
            table_[i].key = key;
            return &table_[i];
        }
        return &table_[i];
    }
    // Entries 0..size()-1, some of them empty. Insertion moves none.
    std::uint32_t size() const { return size_; }
    const Entry& at(std::uint32_t i) const { return table_[i]; }

  private:
    std::uint32_t home(ChunkKey key) const {
        return static_cast<std::uint32_t>((mix64(key) >> 32) * size_ >> 32);
    }
    std::uint32_t capacity_ = 0, count_ = 0, size_ = 0;
    Entry* table_ = nullptr;
};

}  // namespace burin
