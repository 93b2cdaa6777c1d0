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
           std::uint64_t{head.chunks} *
               (sizeof(ChunkGeometry) + (head.has_colour ? sizeof(ChunkColour) : 0)) +
           extra_section_bytes(head.extra_bytes);
}
bool possible(const MapCameras& cameras) {
    double values[8];
    static_assert(sizeof values == sizeof cameras);
    std::memcpy(values, &cameras, sizeof values);
    for (const double v : values)
        if (!std::isfinite(v)) return false;
    const double* u = cameras.up;
    const double square = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    if (cameras.up_is_sure != 0 && !(cameras.up_is_sure == 1 && std::fabs(square - 1) < 1e-6)) return false;
    return cameras.count >= 0;
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

Status save_map(ChunkSource& chunks, const VolumeShape& shape, MapFileHead head, const char* path,
                Progress* progress, const MapExtra* extra) {
    struct PathWriter final : MapWriter {
        Status write(const void* data, std::size_t bytes) override { return file.write(data, bytes); }
        AtomicFile file;
    } writer;
    BURIN_TRY(writer.file.open(path));
    BURIN_TRY(save_map(chunks, shape, head, writer, path, progress, extra));
    return writer.file.commit(true);
}

Status save_map(ChunkSource& chunks, const VolumeShape& shape, MapFileHead head, MapWriter& writer,
                const char* name, Progress* progress, const MapExtra* extra) {
    Progress nobody;
    if (!progress) progress = &nobody;
    const auto stopped = [] { return Status::error(Code::cancelled, "cancelled"); };
    std::memcpy(head.magic, kMagic, sizeof kMagic);
    head.version = kMapFileVersion;
    head.byte_order = kByteOrder;
    head.has_colour = shape.colour;
    head.voxel_m = shape.voxel_m;
    head.truncation_m = shape.truncation_m;
    head.chunks = chunks.count();
    head.map_hash = chunks.hash();
    head.extra_bytes = extra ? extra->bytes() : 0;
    head.index_hash = 0;
    ChunkSource::Chunk chunk;
    std::uint32_t seen = 0;
    for (chunks.rewind(); chunks.next(&chunk, false); ++seen) {
        if (!progress->report(seen, head.chunks)) return stopped();
        const IndexEntry entry = {chunk.key, chunk.checksum};
        head.index_hash = hash_bytes(&entry, sizeof entry, head.index_hash);
    }
    head.head_hash = digest_of(head);
    progress->next_stage();

    unsigned char page[kMapFilePage] = {};
    std::memcpy(page, &head, sizeof head);
    BURIN_TRY(writer.write(page, sizeof page));
    chunks.rewind();
    constexpr std::uint32_t kEntries = kMapFilePage / sizeof(IndexEntry);
    for (std::uint32_t first = 0; first < head.chunks; first += kEntries) {
        std::memset(page, 0, sizeof page);
        for (std::uint32_t i = first; i < std::min(head.chunks, first + kEntries); ++i) {
            chunks.next(&chunk, false);
            const IndexEntry entry = {chunk.key, chunk.checksum};
            std::memcpy(page + (i - first) * sizeof entry, &entry, sizeof entry);
        }
        BURIN_TRY(writer.write(page, sizeof page));
    }
    const std::uint64_t pieces = std::uint64_t{head.chunks} * (shape.colour ? 2 : 1);
    for (std::uint64_t i = 0; i < pieces; ++i) {
        if (!progress->report(i, pieces)) return stopped();
        if (i % head.chunks == 0) chunks.rewind();
        if (!chunks.next(&chunk, true))
            return Status::error(Code::io, "%s: cannot write the map: a chunk in the store is unreadable",
                                 name);
        if (i < head.chunks)
            BURIN_TRY(writer.write(chunk.geometry, sizeof *chunk.geometry));
        else
            BURIN_TRY(writer.write(chunk.colour, sizeof *chunk.colour));
    }
    return extra ? save_extra(*extra, writer, name) : Status();
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
        head->has_colour > 1 || head->chunks > kMaxChunks || !possible(head->cameras))
        return damaged(name, "the head holds impossible values");
    if (file_bytes != kAnyLength && file_bytes != expected_bytes(*head))
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

Status load_map(Volume& volume, const MapFileHead& head, const char* path, std::uint32_t* scratch,
                Progress* progress, MapExtra* extra) {
    struct PathReader final : MapReader {
        explicit PathReader(const char* p) : file(p), path(p) {}
        Status read(void* to, std::size_t bytes) override {
            return file.read(to, bytes) ? Status() : damaged(path, "it is cut short");
        }
        File file;
        const char* path;
    } reader(path);
    if (!reader.file || !reader.file.seek(kMapFilePage)) {
        volume.clear();
        if (extra) extra->clear();
        return Status::error(Code::io, "%s: cannot read: %s", path, std::strerror(errno));
    }
    return load_map(volume, head, reader, path, scratch, progress, extra);
}

namespace {

// The chunks' keys, in order and each with its checksum; and nothing behind them in their last page.
Status load_index(Volume& volume, const MapFileHead& head, MapReader& reader, const char* name) {
    std::uint64_t index_hash = 0;
    ChunkKey previous = 0;
    unsigned char page[kMapFilePage];
    constexpr std::uint32_t kEntries = kMapFilePage / sizeof(IndexEntry);
    for (std::uint32_t first = 0; first < head.chunks; first += kEntries) {
        BURIN_TRY(reader.read(page, sizeof page));
        const std::uint32_t count = std::min(kEntries, head.chunks - first);
        for (std::uint32_t i = 0; i < count; ++i) {
            IndexEntry entry;
            std::memcpy(&entry, page + i * sizeof entry, sizeof entry);
            if (entry.key <= previous || !chunk_in_range(unpack_key(entry.key)) || entry.key >> 63)
                return damaged(name, "keys are out of order");
            previous = entry.key;
            index_hash = hash_bytes(&entry, sizeof entry, index_hash);
            if (volume.insert(entry.key) == kNoChunk)
                return damaged(name, "it holds more chunks than there is room for");
        }
        if (!only_zeros(page + count * sizeof(IndexEntry), sizeof page - count * sizeof(IndexEntry)))
            return damaged(name, "bytes behind the index are not 0");
    }
    if (index_hash != head.index_hash) return damaged(name, "the checksum of the index does not match");
    return {};
}

Status load_chunks(Volume& volume, const MapFileHead& head, MapReader& reader, Progress& progress) {
    const std::uint64_t pieces = std::uint64_t{head.chunks} * (head.has_colour ? 2 : 1);
    for (std::uint64_t i = 0; i < pieces; ++i) {
        if (!progress.report(i, pieces)) return Status::error(Code::cancelled, "cancelled");
        const auto slot = static_cast<std::uint32_t>(i % head.chunks);
        if (i < head.chunks) {
            ChunkGeometry& g = volume.geometry(slot);
            BURIN_TRY(reader.read(&g, sizeof g));
            int least = 32767;
            for (int k = 0; k < kChunkVoxels; ++k)
                if (g.weight[k] > 0) least = std::min(least, std::abs(static_cast<int>(g.sdf[k])));
            volume.least_distance(slot) = static_cast<std::int16_t>(least);
            volume.moved(slot) = 65535;  // nothing of it has been meshed
        } else {
            ChunkColour& c = volume.colour(slot);
            BURIN_TRY(reader.read(&c, sizeof c));
            for (const auto& voxel : c.rgbn)
                volume.colour_readings(slot) = std::max(volume.colour_readings(slot), voxel[3]);
        }
    }
    return {};
}

}  // namespace

Status load_map(Volume& volume, const MapFileHead& head, MapReader& reader, const char* name,
                std::uint32_t* scratch, Progress* progress, MapExtra* extra) {
    Progress nobody;
    volume.clear();
    if (extra) extra->clear();
    Status status = load_index(volume, head, reader, name);
    if (status.ok()) status = load_chunks(volume, head, reader, progress ? *progress : nobody);
    if (status.ok() && volume.hash(scratch) != head.map_hash)
        status = damaged(name, "the checksum of the chunks does not match");
    if (status.ok()) status = load_extra(extra, head.extra_bytes, reader, name);
    if (!status.ok()) volume.clear();
    return status;
}

}  // namespace burin
