// SPDX-License-Identifier: MIT
// Geometry that lies over that of the volume: chunks of the same lattice with other distances, made from the
// volume and never the other way, so that the volume stays what was measured. Room for a fixed number of
// chunks; entries are found by key.
#pragma once

#include <cstring>

#include "core/arena.h"
#include "core/hash.h"
#include "map/volume.h"

namespace burin {

class Overlay {
  public:
    void place(Arena& arena, std::uint32_t capacity) {
        capacity_ = capacity;
        size_ = capacity == 0 ? 0 : capacity + capacity / 2 + 1;  // at most 2/3 filled, as in Volume
        table_ = arena.allocate<std::uint32_t>(size_, 64);
        keys_ = arena.allocate<ChunkKey>(capacity, 64);
        flags_ = arena.allocate<std::uint8_t>(capacity, 64);
        geometry_ = arena.allocate<ChunkGeometry>(capacity, 64);
    }
    void clear() {
        count_ = alone_count_ = 0;
        if (size_ > 0) std::memset(table_, 0xff, sizeof *table_ * std::size_t{size_});
    }
    std::uint32_t capacity() const { return capacity_; }
    std::uint32_t count() const { return count_; }

    // kNoChunk when absent.
    std::uint32_t find(ChunkKey key) const {
        if (count_ == 0) return kNoChunk;
        for (std::uint32_t i = home(key);; i = after(i))
            if (table_[i] == kNoChunk || keys_[table_[i]] == key) return table_[i];
    }
    // The entry of a key, made when absent, its geometry then rubbish; kNoChunk when there is no room.
    std::uint32_t insert(ChunkKey key) {
        if (size_ == 0) return kNoChunk;
        std::uint32_t i = home(key);
        for (; table_[i] != kNoChunk; i = after(i))
            if (keys_[table_[i]] == key) return table_[i];
        if (count_ == capacity_) return kNoChunk;
        table_[i] = count_;
        keys_[count_] = key;
        flags_[count_] = 0;
        return count_++;
    }
    // The last entry takes the place of the removed one.
    void remove(std::uint32_t entry) {
        set_alone(entry, false);
        std::uint32_t hole = place_of(keys_[entry]);
        // What was pushed on by the one that goes moves back (Knuth, TAOCP 3, 6.4, algorithm R).
        for (std::uint32_t i = after(hole); table_[i] != kNoChunk; i = after(i)) {
            const std::uint32_t from = home(keys_[table_[i]]);
            if (hole <= i ? hole < from && from <= i : hole < from || from <= i) continue;
            table_[hole] = table_[i];
            hole = i;
        }
        table_[hole] = kNoChunk;
        const std::uint32_t last = --count_;
        if (entry == last) return;
        table_[place_of(keys_[last])] = entry;
        keys_[entry] = keys_[last];
        flags_[entry] = flags_[last];
        geometry_[entry] = geometry_[last];
    }
    // Entries 0..count()-1.
    ChunkKey key(std::uint32_t entry) const { return keys_[entry]; }
    ChunkGeometry& geometry(std::uint32_t entry) { return geometry_[entry]; }
    const ChunkGeometry& geometry(std::uint32_t entry) const { return geometry_[entry]; }

    // The entry is surface where the volume has no chunk.
    bool alone(std::uint32_t entry) const { return flags_[entry] & kAlone; }
    void set_alone(std::uint32_t entry, bool on) {
        alone_count_ += on;
        alone_count_ -= alone(entry);
        set(entry, kAlone, on);
    }
    // Such an entry's mesh may differ from the one last extracted.
    bool stale(std::uint32_t entry) const { return flags_[entry] & kStale; }
    void set_stale(std::uint32_t entry, bool on) { set(entry, kStale, on); }
    std::uint32_t alone_count() const { return alone_count_; }

  private:
    enum : std::uint8_t { kAlone = 1, kStale = 2 };
    void set(std::uint32_t entry, unsigned flag, bool on) {
        flags_[entry] = static_cast<std::uint8_t>(on ? flags_[entry] | flag : flags_[entry] & ~flag);
    }
    std::uint32_t place_of(ChunkKey key) const {  // in the table; the key must be there
        std::uint32_t i = home(key);
        while (keys_[table_[i]] != key) i = after(i);
        return i;
    }
    std::uint32_t home(ChunkKey key) const {
        return static_cast<std::uint32_t>((mix64(key) >> 32) * size_ >> 32);
    }
    std::uint32_t after(std::uint32_t i) const { return i + 1 == size_ ? 0 : i + 1; }

    std::uint32_t capacity_ = 0, count_ = 0, size_ = 0, alone_count_ = 0;
    std::uint32_t* table_ = nullptr;
    ChunkKey* keys_ = nullptr;
    std::uint8_t* flags_ = nullptr;
    ChunkGeometry* geometry_ = nullptr;
};

}  // namespace burin
