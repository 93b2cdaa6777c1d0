// SPDX-License-Identifier: MIT
#include "map/chunk_store.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace burin {
namespace {

constexpr std::uint8_t kKeptFlags = kChunkDirty | kChunkStale;

// Chunks that leave at one time, since finding them takes a walk over all: at most this many (1 MiB), and at
// most a sixteenth of the pool.
constexpr std::uint32_t kEvictAtOnce = 256;

// Distances from the view are sorted into so many bins of one chunk.
constexpr std::uint32_t kBins = 1024;

}  // namespace

void ChunkStore::place(Arena& arena, const VolumeShape& shape, std::uint32_t chunks) {
    shape_ = shape;
    if (chunks == 0) return;
    index_.place(arena, chunks);
    walk_ = arena.allocate<ChunkKey>(kWalk, 64);
    writer_.place(arena, shape.colour);
    reader_.place(arena, store_chunk_bytes(shape.colour));
    page_ = arena.allocate<unsigned char>(store_chunk_bytes(shape.colour), 64);
}

Status ChunkStore::start() {
    BURIN_TRY(writer_.start());
    return reader_.start();
}

void ChunkStore::clear() {
    index_.clear();
    away_ = 0;
    evicted_ = reloaded_ = 0;
    full_ = unreadable_ = false;
}

// --------------------------------------------------------------------------------------------- opening and
// closing

Status ChunkStore::create(const char* path, StoreHead head) {
    BURIN_TRY(file_.create(path));
    Status status = attach(&file_, true, head, path, nullptr);
    if (status.ok()) status = file_.publish();
    if (!status.ok()) {
        close();
        file_.close();
    }
    return status;
}

Status ChunkStore::resume(const char* path, std::uint64_t* frames) {
    BURIN_TRY(file_.open(path));
    const Status status = attach(&file_, false, {}, path, frames);
    if (!status.ok()) file_.close();
    return status;
}

Status ChunkStore::attach(StoreIo* io, bool fresh, StoreHead head, const char* name, std::uint64_t* frames) {
    std::snprintf(name_, sizeof name_, "%s", name);
    BURIN_TRY(start());
    StoreTail tail;
    clear();
    if (fresh) {
        head.has_colour = shape_.colour;
        head.voxel_m = shape_.voxel_m;
        head.truncation_m = shape_.truncation_m;
        BURIN_TRY(write_store_head(*io, &head, name_, &tail));
    } else {
        BURIN_TRY(read_store_head(*io, name_, &head));
        if (head.voxel_m != shape_.voxel_m || head.truncation_m != shape_.truncation_m ||
            (head.has_colour != 0) != shape_.colour)
            return Status::error(
                Code::invalid_argument,
                "%s: store of voxel %g m, truncation %g m, %s colour; this map has %g, %g, %s colour", name_,
                static_cast<double>(head.voxel_m), static_cast<double>(head.truncation_m),
                head.has_colour ? "with" : "without", static_cast<double>(shape_.voxel_m),
                static_cast<double>(shape_.truncation_m), shape_.colour ? "with" : "without");
        struct Fill final : StoreVisitor {
            ChunkStore& store;
            ChunkIndex& index;
            const char* name;
            std::uint64_t frames = 0, expected = 0;
            explicit Fill(ChunkStore& s) : store(s), index(s.index_), name(s.name_) {}
            Status begin(std::uint64_t f, std::uint64_t chunks) override {
                frames = f;
                expected = chunks;
                if (chunks <= index.capacity()) return {};
                return Status::error(Code::insufficient_memory, "%s: %llu chunks, store_chunks is %u", name,
                                     static_cast<unsigned long long>(chunks), index.capacity());
            }
            void forget() override { index.clear(); }
            Status record(const StoreRecord& r, std::uint64_t at) override {
                ChunkIndex::Entry* entry = store.enter(r.key);
                if (!entry)
                    return Status::error(Code::insufficient_memory,
                                         "%s: more than the %u chunks of store_chunks", name,
                                         index.capacity());
                entry->checksum = r.checksum;
                entry->last_seen = r.last_seen;
                entry->place = static_cast<std::uint32_t>(at / 2048) |
                               (r.least_distance == 32767 ? ChunkIndex::Entry::kFree : 0u) |
                               static_cast<std::uint32_t>(r.flags & kKeptFlags) << ChunkIndex::Entry::kFlags;
                return {};
            }
        } fill(*this);
        Status status = recover_store(*io, head, name_, writer_.scratch(), fill, &tail);
        if (status.ok() && index_.count() != fill.expected)
            status = Status::error(Code::format, "%s: store is damaged: %u chunks, its last commit has %llu",
                                   name_, index_.count(), static_cast<unsigned long long>(fill.expected));
        if (!status.ok()) {
            clear();
            return status;
        }
        if (frames) *frames = fill.frames;
    }
    away_ = index_.count();
    writer_.open(io, tail);
    reader_.open(io);
    io_ = io;
    return {};
}

void ChunkStore::close() {
    if (io_) {
        reader_.close();
        writer_.close();
        io_ = nullptr;
        clear();
    }
    file_.close();
}

// ------------------------------------------------------------------------------------------------ going and
// coming

std::uint32_t ChunkStore::distance_bin(ChunkKey key) const {
    const Vec3i d = unpack_key(key) - centre_;
    const double x = d.x, y = d.y, z = d.z;
    return static_cast<std::uint32_t>(std::min(std::sqrt(x * x + y * y + z * z), kBins - 1.0));
}

ChunkIndex::Entry* ChunkStore::enter(ChunkKey key) {
    const Vec3i c = unpack_key(key);
    for (int r = 0; r < 3; ++r) {
        low_[r] = index_.count() == 0 ? c[r] : std::min(low_[r], c[r]);
        high_[r] = index_.count() == 0 ? c[r] : std::max(high_[r], c[r]);
    }
    return index_.insert(key);
}

// Sees that the index knows a chunk and the file, or a buffer on its way there, has its bytes.
bool ChunkStore::save(Volume& volume, std::uint32_t slot) {
    if (volume.flags(slot) & kChunkSaved) return true;
    if (writer_.end() / 2048 + 2 * kGroupChunks * 2 >= ChunkIndex::Entry::kPlaces) {
        full_ = true;
        return false;
    }
    const ChunkKey key = volume.key(slot);
    if (!index_.find(key) && index_.count() == index_.capacity()) {
        full_ = true;
        return false;
    }
    if (!writer_.ready()) return false;  // its error tells
    const std::uint64_t checksum = volume.chunk_hash(slot);
    const StoreRecord record = {key,
                                checksum,
                                volume.last_seen(slot),
                                volume.least_distance(slot),
                                static_cast<std::uint8_t>(volume.flags(slot) & kKeptFlags),
                                0};
    const std::uint64_t at =
        writer_.append(record, volume.geometry(slot), shape_.colour ? &volume.colour(slot) : nullptr);
    ChunkIndex::Entry* entry = enter(key);
    entry->checksum = checksum;
    entry->place = static_cast<std::uint32_t>(at / 2048) | ChunkIndex::Entry::kResident;
    volume.flags(slot) |= kChunkSaved;
    return true;
}

bool ChunkStore::evict(Volume& volume, std::uint32_t slot) {
    if (!save(volume, slot)) return false;
    ChunkIndex::Entry* entry = index_.find(volume.key(slot));
    entry->last_seen = volume.last_seen(slot);
    entry->place = (entry->place & (ChunkIndex::Entry::kPlaces - 1)) |
                   (volume.least_distance(slot) == 32767 ? ChunkIndex::Entry::kFree : 0u) |
                   static_cast<std::uint32_t>(volume.flags(slot) & kKeptFlags) << ChunkIndex::Entry::kFlags;
    volume.remove(slot);
    ++away_;
    ++evicted_;
    return true;
}

bool ChunkStore::make_room(Volume& volume, std::uint32_t chunks) {
    const std::uint32_t capacity = volume.shape().capacity;
    const auto room = [&] { return capacity - volume.live(); };
    if (room() >= chunks) return true;
    if (!is_open()) return false;
    const std::uint32_t wanted =
        std::max(chunks - room(), std::min(std::max(capacity / 16, 1u), kEvictAtOnce));
    // The farthest: how many are in each bin, then the bin beyond which all may go.
    std::uint32_t bins[kBins] = {};
    for (std::uint32_t slot = 0; slot < volume.live(); ++slot)
        if (!(volume.flags(slot) & kChunkPinned)) ++bins[distance_bin(volume.key(slot))];
    std::uint32_t nearest = kBins, found = 0;
    while (nearest > 0 && found < wanted) found += bins[--nearest];
    std::uint32_t rest = std::min(wanted, found);
    std::uint32_t at_nearest = rest - (found - (nearest < kBins ? bins[nearest] : 0));  // of the nearest bin
    // From the last slot down, so that what moves into a hole has been looked at.
    for (std::uint32_t slot = volume.live(); slot-- > 0 && rest > 0;) {
        if (volume.flags(slot) & kChunkPinned) continue;
        const std::uint32_t bin = distance_bin(volume.key(slot));
        if (bin < nearest || (bin == nearest && at_nearest == 0)) continue;
        if (!evict(volume, slot)) break;
        --rest;
        if (bin == nearest) --at_nearest;
    }
    return room() >= chunks;
}

bool ChunkStore::read_ahead(ChunkKey key) {
    const ChunkIndex::Entry* entry = index_.find(key);
    return !entry || entry->resident() || writer_.buffered(entry->offset()) || reader_.ask(entry->offset());
}

const void* ChunkStore::read(const ChunkIndex::Entry& entry) {
    const void* bytes = writer_.buffered(entry.offset());
    if (!bytes) bytes = reader_.take(entry.offset());
    if (!bytes) {
        if (read_all(*io_, entry.offset(), page_, store_chunk_bytes(shape_.colour)) != 0) {
            unreadable_ = true;
            return nullptr;
        }
        bytes = page_;
    }
    if (record_checksum(entry.key, bytes, shape_.colour) == entry.checksum) return bytes;
    unreadable_ = true;
    return nullptr;
}

std::uint32_t ChunkStore::bring(Volume& volume, ChunkKey key) {
    if (!make_room(volume, 1)) return kNoChunk;
    ChunkIndex::Entry* entry = index_.find(key);
    const auto* bytes = static_cast<const unsigned char*>(read(*entry));
    if (!bytes) return kNoChunk;
    const std::uint32_t slot = volume.insert(key);
    ChunkGeometry& g = volume.geometry(slot);
    std::memcpy(&g, bytes, sizeof g);
    int least = 32767;
    for (int i = 0; i < kChunkVoxels; ++i)
        if (g.weight[i] > 0) least = std::min(least, std::abs(static_cast<int>(g.sdf[i])));
    // Carving passes over free chunks: whether this one counted as free when it left may not change.
    volume.least_distance(slot) = static_cast<std::int16_t>(entry->free() ? least : std::min(least, 32766));
    if (shape_.colour) {
        ChunkColour& c = volume.colour(slot);
        std::memcpy(&c, bytes + sizeof g, sizeof c);
        std::uint8_t most = 0;
        for (const auto& voxel : c.rgbn) most = std::max(most, voxel[3]);
        volume.colour_readings(slot) = most;
    }
    volume.last_seen(slot) = entry->last_seen;
    // How far its mesh is behind was not kept: all the way, unless it had been meshed as it is.
    const unsigned kept = entry->place >> ChunkIndex::Entry::kFlags & kKeptFlags;
    volume.moved(slot) = kept & kChunkDirty ? 65535 : 0;
    volume.mesh_lag(slot) = kept & kChunkStale ? 65535 : 0;
    volume.flags(slot) =
        static_cast<std::uint8_t>(kept | kChunkSaved | (kept == 0 ? kChunkMeshed | kChunkSurface : 0));
    entry->place |= ChunkIndex::Entry::kResident;
    --away_;
    ++reloaded_;
    return slot;
}

std::span<const ChunkKey> ChunkStore::next_keys(const Volume& volume, ChunkKey after) {
    std::uint32_t count = 0;  // the least so far, a heap with the largest of them on top
    const auto offer = [&](ChunkKey key) {
        if (key <= after) return;
        if (count == kWalk) {
            if (key >= walk_[0]) return;
            std::pop_heap(walk_, walk_ + count--);
        }
        walk_[count++] = key;
        std::push_heap(walk_, walk_ + count);
    };
    for (std::uint32_t slot = 0; slot < volume.live(); ++slot) offer(volume.key(slot));
    for_each_away([&](const ChunkIndex::Entry& entry) {
        offer(entry.key);
        return true;
    });
    std::sort_heap(walk_, walk_ + count);
    return {walk_, count};
}

// -------------------------------------------------------------------------------------------------------
// commits

Status ChunkStore::commit(Volume& volume, std::uint64_t frames) {
    if (!is_open()) return Status::error(Code::state, "no store is open");
    writer_.retry();
    for (std::uint32_t slot = 0; slot < volume.live(); ++slot) {
        if (save(volume, slot)) continue;
        if (const int error = writer_.error())
            return Status::error(Code::io, "%s: cannot write the store: %s", name_, std::strerror(error));
        return Status::error(Code::insufficient_memory,
                             "%s: the map has more than the %u chunks of store_chunks", name_,
                             index_.capacity());
    }
    if (const int error = writer_.commit(frames, volume.live() + std::uint64_t{away_}))
        return Status::error(Code::io, "%s: cannot write the store: %s", name_, std::strerror(error));
    return {};
}

void ChunkStore::forget() {
    if (!is_open()) return;
    clear();
    reader_.give_up();
    writer_.forget();
}

void ChunkStore::begin_frame(Vec3i centre) {
    look_at(centre);
    full_ = unreadable_ = false;
    writer_.retry();
}

ChunkStore::Counts ChunkStore::counts() const {
    Counts c;
    c.evicted = evicted_;
    c.reloaded = reloaded_;
    c.disk_error = writer_.error();
    const bool no_room = c.disk_error == ENOSPC || c.disk_error == EDQUOT;
    c.full = full_ || no_room;
    c.failed = unreadable_ || (c.disk_error != 0 && !no_room);
    c.bytes = is_open() ? writer_.end() : 0;
    return c;
}

}  // namespace burin
