// SPDX-License-Identifier: MIT
#include "map/volume.h"

#include <algorithm>
#include <cstring>

namespace burin {

void Volume::place(Arena& arena, const VolumeShape& shape) {
    shape_ = shape;
    // At most 2/3 filled: linear probing then takes 2 probes for a hit, 5 for a miss on average. Not rounded
    // up to a power of two: a table that doubles at some capacity would leave megabytes of a budget unused.
    table_size_ = shape.capacity + shape.capacity / 2 + 1;
    table_ = arena.allocate<Entry>(table_size_, 64);
    keys_ = arena.allocate<ChunkKey>(shape.capacity, 64);
    last_seen_ = arena.allocate<std::uint32_t>(shape.capacity, 64);
    over_ = arena.allocate<std::uint32_t>(shape.capacity, 64);
    least_distance_ = arena.allocate<std::int16_t>(shape.capacity, 64);
    moved_ = arena.allocate<std::uint16_t>(shape.capacity, 64);
    mesh_lag_ = arena.allocate<std::uint16_t>(shape.capacity, 64);
    flags_ = arena.allocate<std::uint8_t>(shape.capacity, 64);
    colour_readings_ = arena.allocate<std::uint8_t>(shape.colour ? shape.capacity : 0, 64);
    geometry_ = arena.allocate<ChunkGeometry>(shape.capacity, 64);
    colour_ = shape.colour ? arena.allocate<ChunkColour>(shape.capacity, 64) : nullptr;
}

void Volume::clear() {
    live_ = 0;
    high_water_ = 0;
    std::memset(static_cast<void*>(table_), 0, sizeof(Entry) * std::size_t{table_size_});
}

std::uint32_t Volume::find(ChunkKey key) const {
    for (std::uint32_t i = home(key);; i = after(i)) {
        if (table_[i].key == key) return table_[i].slot;
        if (table_[i].key == 0) return kNoChunk;
    }
}

std::uint32_t Volume::insert(ChunkKey key) {
    const std::uint32_t slot = reserve(key);
    if (slot != kNoChunk) wipe(slot);
    return slot;
}

std::uint32_t Volume::reserve(ChunkKey key) {
    if (live_ == shape_.capacity) return kNoChunk;
    std::uint32_t i = home(key);
    while (table_[i].key != 0) i = after(i);
    const std::uint32_t slot = live_++;
    high_water_ = std::max(high_water_, live_);
    table_[i] = {key, slot, 0};
    keys_[slot] = key;
    last_seen_[slot] = 0;
    over_[slot] = kNoChunk;
    least_distance_[slot] = 32767;
    moved_[slot] = mesh_lag_[slot] = 0;
    flags_[slot] = kChunkDirty | kChunkUnfitted;
    if (shape_.colour) colour_readings_[slot] = 0;
    return slot;
}

void Volume::wipe(std::uint32_t slot) {
    std::memset(&geometry_[slot], 0, sizeof(ChunkGeometry));
    if (shape_.colour) std::memset(&colour_[slot], 0, sizeof(ChunkColour));
}

std::uint32_t Volume::entry_of(ChunkKey key) const {
    std::uint32_t i = home(key);
    while (table_[i].key != key) i = after(i);
    return i;
}

void Volume::remove(std::uint32_t slot) {
    // Deletion by backward shift (Knuth 6.4, algorithm R): whatever the search passes over the hole for moves
    // into it, so that no tombstones lengthen later searches.
    std::uint32_t hole = entry_of(keys_[slot]);
    for (std::uint32_t i = after(hole); table_[i].key != 0; i = after(i)) {
        const std::uint32_t start = home(table_[i].key);
        const bool reaches = hole <= i ? start <= hole || start > i : start <= hole && start > i;
        if (!reaches) continue;
        table_[hole] = table_[i];
        hole = i;
    }
    table_[hole] = {};
    const std::uint32_t last = --live_;
    if (slot == last) return;
    table_[entry_of(keys_[last])].slot = slot;
    keys_[slot] = keys_[last];
    last_seen_[slot] = last_seen_[last];
    over_[slot] = over_[last];
    least_distance_[slot] = least_distance_[last];
    moved_[slot] = moved_[last];
    mesh_lag_[slot] = mesh_lag_[last];
    flags_[slot] = flags_[last];
    geometry_[slot] = geometry_[last];
    if (!shape_.colour) return;
    colour_readings_[slot] = colour_readings_[last];
    colour_[slot] = colour_[last];
}

void Volume::sorted_slots(std::uint32_t* out) const {
    for (std::uint32_t i = 0; i < live_; ++i) out[i] = i;
    std::sort(out, out + live_, [this](std::uint32_t a, std::uint32_t b) { return keys_[a] < keys_[b]; });
}

std::uint64_t Volume::chunk_hash(std::uint32_t slot) const {
    const std::uint64_t h = hash_bytes(&geometry_[slot], sizeof(ChunkGeometry), keys_[slot]);
    return shape_.colour ? hash_bytes(&colour_[slot], sizeof(ChunkColour), h) : h;
}

std::uint64_t Volume::hash(std::uint32_t* scratch) const {
    sorted_slots(scratch);
    std::uint64_t h = mix64(live_);
    for (std::uint32_t i = 0; i < live_; ++i) h = mix64(h ^ chunk_hash(scratch[i])) + i;
    return h;
}

}  // namespace burin
