// SPDX-License-Identifier: MIT
// The chunked signed distance field in fixed memory: two pools of chunk halves under one index, an
// open-addressing hash from key to index (Niessner 2013), and per-chunk facts in side arrays.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/arena.h"
#include "core/hash.h"
#include "map/chunk.h"

namespace burin {

inline constexpr std::uint32_t kNoChunk = 0xffffffffu;

// Bits of Volume::flags.
enum : std::uint8_t {
    kChunkDirty = 1,       // changed, and its neighbours have not been told
    kChunkStale = 2,       // its mesh may differ from the one last extracted
    kChunkListed = 4,      // to be meshed: said to the caller
    kChunkMeshed = 8,      // has been meshed
    kChunkSurface = 16,    // and held surface
    kChunkSaved = 32,      // the store has these very bytes
    kChunkPinned = 64,     // must stay where it is while others are evicted
    kChunkUnfitted = 128,  // changed since planes were last fitted to it
};

inline std::uint16_t add_saturated(std::uint16_t a, std::uint16_t b) {
    return static_cast<std::uint16_t>(a + b > 65535 ? 65535 : a + b);
}

struct VolumeShape {
    std::uint32_t capacity = 0;  // chunks
    bool colour = false;
    float voxel_m = 0;
    float truncation_m = 0;  // what sdf = 32767 stands for
};

class Volume {
  public:
    // Lays the parts out in the arena; an Arena that measures gives the size without touching memory.
    void place(Arena& arena, const VolumeShape& shape);
    void clear();

    const VolumeShape& shape() const { return shape_; }
    std::uint32_t live() const { return live_; }
    std::uint32_t high_water() const { return high_water_; }
    float voxel_m() const { return shape_.voxel_m; }
    float units_to_m() const { return shape_.truncation_m / 32767.0f; }

    // kNoChunk when absent. Safe from several threads while nobody inserts or removes.
    std::uint32_t find(ChunkKey key) const;
    // Asks the cache for what find(key) will read.
    void prefetch(ChunkKey key) const { __builtin_prefetch(&table_[home(key)]); }
    // A new chunk, all voxels unobserved and dirty, or kNoChunk when the pool is full. `key` must be absent.
    std::uint32_t insert(ChunkKey key);
    // The same in two steps: the voxels of a reserved chunk are rubbish until they are wiped, which several
    // threads may do at a time, to a chunk each. On fresh memory that is where the pages come in.
    std::uint32_t reserve(ChunkKey key);
    void wipe(std::uint32_t slot);

    // Takes a chunk out. The last slot's chunk moves into its place, so that slots 0..live()-1 stay in use.
    void remove(std::uint32_t slot);

    // Slots 0..live()-1 are in use, in order of insertion while nothing is removed.
    ChunkKey key(std::uint32_t slot) const { return keys_[slot]; }
    ChunkGeometry& geometry(std::uint32_t slot) { return geometry_[slot]; }
    const ChunkGeometry& geometry(std::uint32_t slot) const { return geometry_[slot]; }
    bool has_colour() const { return shape_.colour; }
    ChunkColour& colour(std::uint32_t slot) { return colour_[slot]; }
    const ChunkColour& colour(std::uint32_t slot) const { return colour_[slot]; }

    std::uint8_t& flags(std::uint32_t slot) { return flags_[slot]; }
    std::uint8_t flags(std::uint32_t slot) const { return flags_[slot]; }
    // Its voxels have changed.
    void touch(std::uint32_t slot) {
        flags_[slot] =
            static_cast<std::uint8_t>((flags_[slot] | kChunkDirty | kChunkUnfitted) & ~kChunkSaved);
    }
    // Number of the frame that last fused or carved the chunk.
    std::uint32_t& last_seen(std::uint32_t slot) { return last_seen_[slot]; }
    std::uint32_t last_seen(std::uint32_t slot) const { return last_seen_[slot]; }
    // Not above the least |sdf| of its observed voxels: 32767 means nothing but free space.
    std::int16_t& least_distance(std::uint32_t slot) { return least_distance_[slot]; }
    std::int16_t least_distance(std::uint32_t slot) const { return least_distance_[slot]; }

    // How far the surface in the chunk can have moved since its neighbours were told, in units of sdf: the
    // sum of each frame's largest step. 65535, as much as can be told, where voxels near the surface are new.
    std::uint16_t& moved(std::uint32_t slot) { return moved_[slot]; }
    std::uint16_t moved(std::uint32_t slot) const { return moved_[slot]; }
    // The same since the chunk was last meshed, neighbours included, as far as told.
    std::uint16_t& mesh_lag(std::uint32_t slot) { return mesh_lag_[slot]; }
    std::uint16_t mesh_lag(std::uint32_t slot) const { return mesh_lag_[slot]; }

    // The largest count of readings of a voxel's colour.
    std::uint8_t& colour_readings(std::uint32_t slot) { return colour_readings_[slot]; }
    std::uint8_t colour_readings(std::uint32_t slot) const { return colour_readings_[slot]; }

    // The entry of an Overlay that is over the chunk's geometry, kNoChunk for none.
    std::uint32_t& over(std::uint32_t slot) { return over_[slot]; }
    std::uint32_t over(std::uint32_t slot) const { return over_[slot]; }

    // Slots in ascending key order, written to out[0..live()-1].
    void sorted_slots(std::uint32_t* out) const;
    // Digest of all keys and voxels in key order. `scratch`: live() entries.
    std::uint64_t hash(std::uint32_t* scratch) const;
    // Digest of one chunk, also the checksum of the map file.
    std::uint64_t chunk_hash(std::uint32_t slot) const;

    std::size_t chunk_bytes() const {
        return sizeof(ChunkGeometry) + (shape_.colour ? sizeof(ChunkColour) : 0);
    }

  private:
    // Where the search for a key begins: the hash scaled to the table, so that its size need not be a power
    // of two.
    std::uint32_t home(ChunkKey key) const {
        return static_cast<std::uint32_t>((mix64(key) >> 32) * table_size_ >> 32);
    }
    std::uint32_t entry_of(ChunkKey key) const;  // the key must be there
    std::uint32_t after(std::uint32_t i) const { return i + 1 == table_size_ ? 0 : i + 1; }

    struct Entry {
        ChunkKey key;  // 0: empty
        std::uint32_t slot;
        std::uint32_t unused;
    };

    VolumeShape shape_;
    std::uint32_t live_ = 0, high_water_ = 0;
    std::uint32_t table_size_ = 0;
    Entry* table_ = nullptr;
    ChunkKey* keys_ = nullptr;
    std::uint32_t* last_seen_ = nullptr;
    std::uint32_t* over_ = nullptr;
    std::int16_t* least_distance_ = nullptr;
    std::uint16_t* moved_ = nullptr;
    std::uint16_t* mesh_lag_ = nullptr;
    std::uint8_t* flags_ = nullptr;
    std::uint8_t* colour_readings_ = nullptr;
    ChunkGeometry* geometry_ = nullptr;
    ChunkColour* colour_ = nullptr;
};

}  // namespace burin
