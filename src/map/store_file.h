// SPDX-License-Identifier: MIT
// The format of the store: a head of one page, then groups. A group is a page that describes up to 32 chunks,
// followed by their bytes; a group that is a commit mark says that everything before it is a whole map.
// Append only: a chunk written again leaves its old bytes behind, so that the last commit stays readable.
// docs/store.md.
#pragma once

#include <cstddef>
#include <cstdint>

#include "map/store_io.h"
#include "map/volume.h"

namespace burin {

inline constexpr std::uint32_t kStoreVersion = 1;
inline constexpr std::size_t kStorePage = 4096;
inline constexpr std::uint32_t kGroupChunks =
    32;  // 132 KiB with colour: a disk's bandwidth, a small part of a budget

struct StoreHead {
    char magic[8];  // "BURINSTO"
    std::uint32_t version;
    std::uint32_t byte_order;  // 0x01020304 as the writer's machine stores it
    std::uint32_t has_colour;
    float voxel_m;
    float truncation_m;
    std::uint32_t config_bytes;
    unsigned char config[1024];  // the caller's configuration, opaque here
    unsigned char zeros[kStorePage - 8 - 6 * 4 - 1024 - 8];
    std::uint64_t head_hash;  // of everything before it
};
static_assert(sizeof(StoreHead) == kStorePage);

// What a chunk has besides its voxels.
struct StoreRecord {
    ChunkKey key;
    std::uint64_t checksum;  // Volume::chunk_hash
    std::uint32_t last_seen;
    std::int16_t least_distance;
    std::uint8_t flags;  // of Volume: dirty, stale
    std::uint8_t unused;
};

struct GroupHead {
    char magic[8];           // "BURINGRP"
    std::uint64_t sequence;  // 1, 2, ...
    std::uint64_t previous;  // hash of the group before, or of the file's head
    std::uint32_t chunks;    // records that follow; 0 in a commit mark
    std::uint8_t commit;     // 1: a commit mark
    std::uint8_t forget;     // 1: chunks of the groups before are no longer part of the map
    std::uint8_t unused[2];
    std::uint64_t frames;      // commit: integrated so far
    std::uint64_t map_chunks;  // commit: in the whole map
    StoreRecord records[kGroupChunks];
    unsigned char zeros[kStorePage - 48 - kGroupChunks * sizeof(StoreRecord) - 8];
    std::uint64_t group_hash;  // of everything before it
};
static_assert(sizeof(GroupHead) == kStorePage);

inline std::size_t store_chunk_bytes(bool colour) { return colour ? 4096 : 2048; }
// Of a group with so many chunks, whole pages.
inline std::size_t group_bytes(std::uint32_t chunks, bool colour) {
    return kStorePage + (chunks * store_chunk_bytes(colour) + kStorePage - 1) / kStorePage * kStorePage;
}
std::uint64_t record_checksum(ChunkKey key, const void* bytes, bool colour);

// Where the next group goes. Kept by whoever appends.
struct StoreTail {
    std::uint64_t end = 0;       // bytes
    std::uint64_t sequence = 0;  // of the last group
    std::uint64_t previous = 0;  // its hash
};

// Fills in magic, sequence, chain and hash and moves the tail behind the group.
void seal_group(GroupHead* group, bool colour, StoreTail* tail);

// Writes the head and a first, empty commit. `head` gives configuration and shape; the rest is filled in.
Status write_store_head(StoreIo& io, StoreHead* head, const char* name, StoreTail* tail);

Status read_store_head(StoreIo& io, const char* name, StoreHead* head);

// Called for every record up to the last commit, in the order they were written; `forget` before those of a
// group that forgets. An error ends the recovery.
struct StoreVisitor {
    virtual ~StoreVisitor() = default;
    virtual Status begin(std::uint64_t frames, std::uint64_t map_chunks) = 0;
    virtual void forget() = 0;
    virtual Status record(const StoreRecord& record, std::uint64_t at) = 0;  // at: offset of its bytes
};
// Finds the last commit, checks every byte before it, tells the visitor, and cuts off what follows. A file
// that is damaged before its last commit is an error. `buffer`: group_bytes(kGroupChunks) bytes.
Status recover_store(StoreIo& io, const StoreHead& head, const char* name, void* buffer,
                     StoreVisitor& visitor, StoreTail* tail);

}  // namespace burin
