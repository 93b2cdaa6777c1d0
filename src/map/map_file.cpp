// SPDX-License-Identifier: MIT
#include "map/map_file.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "core/atomic_file.h"
#include "core/hash.h"

namespace burin {
namespace {

constexpr char kMagic[8] = {'B', 'U', 'R', 'I', 'N', 'M', 'A', 'P'};
constexpr std::uint32_t kByteOrder = 0x01020304;

struct IndexEntry {
    ChunkKey key;
    std::uint64_t checksum;
};

std::uint64_t index_bytes(std::uint32_t chunks) {
    return (std::uint64_t{chunks} * sizeof(IndexEntry) + kMapFilePage - 1) / kMapFilePage * kMapFilePage;
}
std::uint64_t geometry_at(std::uint32_t chunks) { return kMapFilePage + index_bytes(chunks); }
std::uint64_t expected_bytes(const MapFileHead& head) {
    return geometry_at(head.chunks) +
           std::uint64_t{head.chunks} * (sizeof(ChunkGeometry) + (head.has_colour ? sizeof(ChunkColour) : 0));
}
std::uint64_t digest_of(const MapFileHead& head) {
    return hash_bytes(&head, offsetof(MapFileHead, head_hash));
}

// 2 TiB of geometry; keeps capacities, and tables half as large again, inside 32 bits.
constexpr std::uint32_t kMaxChunks = 1u << 30;

bool only_zeros(const unsigned char* bytes, std::size_t count) {
    return std::all_of(bytes, bytes + count, [](unsigned char b) { return b == 0; });
}

Status damaged(const char* name, const char* what) {
    return Status::error(Code::format, "%s: map file is damaged: %s", name, what);
}

class File {  // closes itself
  public:
    explicit File(const char* path) : file_(std::fopen(path, "rb")) {}
    ~File() {
        if (file_) std::fclose(file_);
    }
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    explicit operator bool() const { return file_ != nullptr; }
    bool read(void* to, std::size_t bytes) { return std::fread(to, 1, bytes, file_) == bytes; }
    bool seek(std::uint64_t at) { return fseeko(file_, static_cast<off_t>(at), SEEK_SET) == 0; }
    std::uint64_t size() {
        if (fseeko(file_, 0, SEEK_END) != 0) return 0;
        const off_t end = ftello(file_);
        return end < 0 ? 0 : static_cast<std::uint64_t>(end);
    }

  private:
    std::FILE* file_;
};

}  // namespace

Status save_map(ChunkSource& chunks, const VolumeShape& shape, MapFileHead head, const char* path) {
    std::memcpy(head.magic, kMagic, sizeof kMagic);
    head.version = kMapFileVersion;
    head.byte_order = kByteOrder;
    head.has_colour = shape.colour;
    head.voxel_m = shape.voxel_m;
    head.truncation_m = shape.truncation_m;
    head.chunks = chunks.count();
    head.map_hash = chunks.hash();
    head.unused = 0;
    head.index_hash = 0;
    ChunkSource::Chunk chunk;
    for (chunks.rewind(); chunks.next(&chunk, false);) {
        const IndexEntry entry = {chunk.key, chunk.checksum};
        head.index_hash = hash_bytes(&entry, sizeof entry, head.index_hash);
    }
    head.head_hash = digest_of(head);

    AtomicFile file;
    static const unsigned char kZeros[kMapFilePage] = {};
    BURIN_TRY(file.open(path));
    BURIN_TRY(file.write(&head, sizeof head));
    BURIN_TRY(file.write(kZeros, kMapFilePage - sizeof head));
    for (chunks.rewind(); chunks.next(&chunk, false);) {
        const IndexEntry entry = {chunk.key, chunk.checksum};
        BURIN_TRY(file.write(&entry, sizeof entry));
    }
    BURIN_TRY(file.write(kZeros, index_bytes(head.chunks) - std::uint64_t{head.chunks} * sizeof(IndexEntry)));
    for (const bool colour : {false, true}) {
        if (colour && !shape.colour) continue;
        std::uint32_t written = 0;
        for (chunks.rewind(); chunks.next(&chunk, true); ++written)
            BURIN_TRY(colour ? file.write(chunk.colour, sizeof *chunk.colour)
                             : file.write(chunk.geometry, sizeof *chunk.geometry));
        if (written != head.chunks)
            return Status::error(Code::io, "%s: cannot write the map: a chunk in the store is unreadable",
                                 path);
    }
    return file.commit(true);
}

Status parse_map_head(const void* data, std::size_t bytes, std::uint64_t file_bytes, const char* name,
                      MapFileHead* head) {
    if (bytes < sizeof *head)
        return Status::error(Code::format, "%s: %llu bytes long, a map file has at least %zu", name,
                             static_cast<unsigned long long>(file_bytes), kMapFilePage);
    std::memcpy(head, data, sizeof *head);
    if (std::memcmp(head->magic, kMagic, sizeof kMagic) != 0)
        return Status::error(Code::format, "%s: not a map file (it does not begin with BURINMAP)", name);
    if (head->byte_order != kByteOrder)
        return Status::error(Code::unsupported, "%s: written on a machine of the other byte order", name);
    if (head->version != kMapFileVersion)
        return Status::error(Code::unsupported, "%s: map file of version %u, this library reads version %u",
                             name, head->version, kMapFileVersion);
    if (head->head_hash != digest_of(*head)) return damaged(name, "the checksum of the head does not match");
    if (!(head->voxel_m > 0) || !(head->truncation_m > 0) || !std::isfinite(head->voxel_m) ||
        !std::isfinite(head->truncation_m) || head->config_bytes > sizeof head->config ||
        head->has_colour > 1 || head->chunks > kMaxChunks)
        return damaged(name, "the head holds impossible values");
    if (file_bytes != expected_bytes(*head))
        return Status::error(Code::format,
                             "%s: map file is damaged: %llu bytes long, expected %llu for %u chunks", name,
                             static_cast<unsigned long long>(file_bytes),
                             static_cast<unsigned long long>(expected_bytes(*head)), head->chunks);
    const auto* all = static_cast<const unsigned char*>(data);
    if (!only_zeros(all + sizeof *head, std::min(bytes, kMapFilePage) - sizeof *head))
        return damaged(name, "bytes behind the head are not 0");
    return {};
}

Status read_map_head(const char* path, MapFileHead* head) {
    File file(path);
    if (!file) return Status::error(Code::io, "%s: cannot read: %s", path, std::strerror(errno));
    const std::uint64_t size = file.size();
    unsigned char bytes[kMapFilePage];
    const std::size_t have = size < sizeof bytes ? static_cast<std::size_t>(size) : sizeof bytes;
    if (!file.seek(0) || !file.read(bytes, have))
        return Status::error(Code::io, "%s: cannot read: %s", path, std::strerror(errno));
    return parse_map_head(bytes, have, size, path, head);
}

Status load_map(Volume& volume, const MapFileHead& head, const char* path, std::uint32_t* scratch) {
    volume.clear();
    File file(path);
    if (!file || !file.seek(kMapFilePage))
        return Status::error(Code::io, "%s: cannot read: %s", path, std::strerror(errno));
    const auto fail = [&](const char* what) {
        volume.clear();
        return damaged(path, what);
    };
    std::uint64_t index_hash = 0;
    ChunkKey previous = 0;
    for (std::uint32_t i = 0; i < head.chunks; ++i) {
        IndexEntry entry;
        if (!file.read(&entry, sizeof entry)) return fail("the index is cut short");
        if (entry.key <= previous || !chunk_in_range(unpack_key(entry.key)) || entry.key >> 63)
            return fail("keys are out of order");
        previous = entry.key;
        index_hash = hash_bytes(&entry, sizeof entry, index_hash);
        if (volume.insert(entry.key) == kNoChunk) return fail("it holds more chunks than there is room for");
    }
    if (index_hash != head.index_hash) return fail("the checksum of the index does not match");
    unsigned char padding[kMapFilePage];
    const std::uint64_t rest = index_bytes(head.chunks) - std::uint64_t{head.chunks} * sizeof(IndexEntry);
    if (!file.read(padding, static_cast<std::size_t>(rest))) return fail("the index is cut short");
    if (!only_zeros(padding, static_cast<std::size_t>(rest))) return fail("bytes behind the index are not 0");
    for (std::uint32_t slot = 0; slot < head.chunks; ++slot) {
        ChunkGeometry& g = volume.geometry(slot);
        if (!file.read(&g, sizeof g)) return fail("the chunks are cut short");
        int least = 32767;
        for (int i = 0; i < kChunkVoxels; ++i)
            if (g.weight[i] > 0) least = std::min(least, std::abs(static_cast<int>(g.sdf[i])));
        volume.least_distance(slot) = static_cast<std::int16_t>(least);
    }
    if (head.has_colour)
        for (std::uint32_t slot = 0; slot < head.chunks; ++slot) {
            ChunkColour& c = volume.colour(slot);
            if (!file.read(&c, sizeof c)) return fail("the chunks are cut short");
            for (const auto& voxel : c.rgbn)
                volume.colour_readings(slot) = std::max(volume.colour_readings(slot), voxel[3]);
        }
    if (volume.hash(scratch) != head.map_hash) return fail("the checksum of the chunks does not match");
    return {};
}

}  // namespace burin
