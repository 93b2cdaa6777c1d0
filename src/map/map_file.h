// SPDX-License-Identifier: MIT
// The map file: a head of one page, an index of keys and checksums in key order, then the geometry halves of
// all chunks, then the colour halves, then perhaps a MapExtra. Disk holds the same bytes as memory. See
// docs/map_file.md.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/progress.h"
#include "core/status.h"
#include "map/chunk_source.h"
#include "map/map_extra.h"
#include "map/volume.h"

namespace burin {

inline constexpr std::uint32_t kMapFileVersion = 1;

// What a map knows of the cameras that it was fused from: sums, which further frames add to. With a direction
// against gravity that was told or measured, that one stands for `up`. All 0: nothing.
struct MapCameras {
    double up[3];        // of the cameras' -y axes, world
    double position[3];  // metres, world
    double count;
    double up_is_sure;  // 1: `up` is a unit vector against gravity
};

struct MapFileHead {
    char magic[8];  // "BURINMAP"
    std::uint32_t version;
    std::uint32_t byte_order;  // 0x01020304 as the writer's machine stores it
    std::uint32_t has_colour;
    float voxel_m;
    float truncation_m;
    std::uint32_t chunks;
    std::uint64_t frames;  // integrated so far; the next one continues the count
    std::uint64_t map_hash;
    std::uint64_t index_hash;
    std::uint32_t config_bytes;
    std::uint32_t extra_bytes;  // of a MapExtra behind the chunks; 0: the file has no such section
    unsigned char config[960];  // the caller's configuration, opaque here
    MapCameras cameras;         // 0 in files of earlier versions
    std::uint64_t head_hash;    // of everything before it
};
static_assert(sizeof(MapFileHead) <= kMapFilePage);

// Writes a map of this shape to `path` (through `path`.part) or to a writer, `name` in messages. `head` gives
// frames and config; the rest is filled in. `extra` may be null. Two stages of progress.
Status save_map(ChunkSource& chunks, const VolumeShape& shape, MapFileHead head, const char* path,
                Progress* progress = nullptr, const MapExtra* extra = nullptr);
Status save_map(ChunkSource& chunks, const VolumeShape& shape, MapFileHead head, MapWriter& writer,
                const char* name, Progress* progress = nullptr, const MapExtra* extra = nullptr);

// Reads and checks the head only. The size of the file must be what the head demands.
Status read_map_head(const char* path, MapFileHead* head);
// The same from bytes in memory (for fuzzing and for readers of other storage); `name` is for messages. A
// file of kAnyLength may have any length.
inline constexpr std::uint64_t kAnyLength = ~std::uint64_t{0};
Status parse_map_head(const void* data, std::size_t bytes, std::uint64_t file_bytes, const char* name,
                      MapFileHead* head);

// Replaces the content of the volume. Its shape must fit the head: voxel, truncation, colour, capacity
// (checked by the caller, who knows what to advise). A damaged chunk is an error and leaves the volume empty.
// The reader stands behind the first page, the head's; `name` is for messages. `extra` becomes what the file
// has for it, also when that is nothing; null: that is read past. One stage of progress.
Status load_map(Volume& volume, const MapFileHead& head, const char* path, std::uint32_t* scratch,
                Progress* progress = nullptr, MapExtra* extra = nullptr);
Status load_map(Volume& volume, const MapFileHead& head, MapReader& reader, const char* name,
                std::uint32_t* scratch, Progress* progress = nullptr, MapExtra* extra = nullptr);

}  // namespace burin
