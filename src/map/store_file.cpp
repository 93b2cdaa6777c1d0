// SPDX-License-Identifier: MIT
#include "map/store_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/hash.h"

namespace burin {
namespace {

constexpr char kHeadMagic[8] = {'B', 'U', 'R', 'I', 'N', 'S', 'T', 'O'};
constexpr char kGroupMagic[8] = {'B', 'U', 'R', 'I', 'N', 'G', 'R', 'P'};
constexpr std::uint32_t kByteOrder = 0x01020304;

Status failed(const char* name, const char* doing, int error) {
    return Status::error(Code::io, "%s: cannot %s the store: %s", name, doing, std::strerror(error));
}
Status damaged(const char* name, const char* what, std::uint64_t at) {
    return Status::error(Code::format, "%s: store is damaged: %s at byte %llu", name, what,
                         static_cast<unsigned long long>(at));
}

std::uint64_t digest_of(const GroupHead& group) {
    return hash_bytes(&group, offsetof(GroupHead, group_hash));
}
std::uint64_t digest_of(const StoreHead& head) { return hash_bytes(&head, offsetof(StoreHead, head_hash)); }

bool whole(const GroupHead& group) {
    return std::memcmp(group.magic, kGroupMagic, sizeof kGroupMagic) == 0 && group.chunks <= kGroupChunks &&
           group.group_hash == digest_of(group);
}

struct LastCommit {
    std::uint64_t end = 0, sequence = 0, frames = 0, map_chunks = 0, hash = 0;
};

// Follows the chain of heads; *stopped is where it breaks off.
Status find_commit(StoreIo& io, const StoreHead& head, const char* name, std::uint64_t size, GroupHead* group,
                   LastCommit* last, std::uint64_t* stopped) {
    std::uint64_t at = kStorePage, sequence = 0, previous = head.head_hash;
    while (at + kStorePage <= size) {
        if (const int error = read_all(io, at, group, kStorePage)) return failed(name, "read", error);
        if (!whole(*group) || group->sequence != sequence + 1 || group->previous != previous) break;
        const std::uint64_t bytes = group_bytes(group->chunks, head.has_colour != 0);
        if (bytes > size - at) break;
        at += bytes;
        sequence = group->sequence;
        previous = group->group_hash;
        if (group->commit) *last = {at, sequence, group->frames, group->map_chunks, previous};
    }
    *stopped = at;
    return {};
}

}  // namespace

std::uint64_t record_checksum(ChunkKey key, const void* bytes, bool colour) {
    const auto* p = static_cast<const unsigned char*>(bytes);
    const std::uint64_t h = hash_bytes(p, sizeof(ChunkGeometry), key);
    return colour ? hash_bytes(p + sizeof(ChunkGeometry), sizeof(ChunkColour), h) : h;
}

void seal_group(GroupHead* group, bool colour, StoreTail* tail) {
    std::memcpy(group->magic, kGroupMagic, sizeof kGroupMagic);
    group->sequence = ++tail->sequence;
    group->previous = tail->previous;
    group->group_hash = tail->previous = digest_of(*group);
    tail->end += group_bytes(group->chunks, colour);
}

Status write_store_head(StoreIo& io, StoreHead* head, const char* name, StoreTail* tail) {
    std::memcpy(head->magic, kHeadMagic, sizeof kHeadMagic);
    head->version = kStoreVersion;
    head->byte_order = kByteOrder;
    head->head_hash = digest_of(*head);
    GroupHead first = {};
    first.commit = 1;
    *tail = {kStorePage, 0, head->head_hash};
    seal_group(&first, head->has_colour != 0, tail);
    int error = write_all(io, 0, head, sizeof *head);
    if (!error) error = write_all(io, kStorePage, &first, sizeof first);
    if (!error) error = -io.sync();
    return error ? failed(name, "create", error) : Status();
}

Status read_store_head(StoreIo& io, const char* name, StoreHead* head) {
    const std::int64_t size = io.size();
    if (size < 0) return failed(name, "read", static_cast<int>(-size));
    if (size < static_cast<std::int64_t>(sizeof *head))
        return Status::error(Code::format, "%s: %lld bytes long, a store has at least %zu", name,
                             static_cast<long long>(size), 2 * kStorePage);
    if (const int error = read_all(io, 0, head, sizeof *head)) return failed(name, "read", error);
    if (std::memcmp(head->magic, kHeadMagic, sizeof kHeadMagic) != 0)
        return Status::error(Code::format, "%s: not a store (it does not begin with BURINSTO)", name);
    if (head->byte_order != kByteOrder)
        return Status::error(Code::unsupported, "%s: written on a machine of the other byte order", name);
    if (head->version != kStoreVersion)
        return Status::error(Code::unsupported, "%s: store of version %u, this library reads version %u",
                             name, head->version, kStoreVersion);
    if (head->head_hash != digest_of(*head))
        return damaged(name, "the checksum of the head does not match", 0);
    if (!(head->voxel_m > 0) || !(head->truncation_m > 0) || !std::isfinite(head->voxel_m) ||
        !std::isfinite(head->truncation_m) || head->config_bytes > sizeof head->config ||
        head->has_colour > 1)
        return damaged(name, "the head holds impossible values", 0);
    return {};
}

Status recover_store(StoreIo& io, const StoreHead& head, const char* name, void* buffer,
                     StoreVisitor& visitor, StoreTail* tail) {
    const std::int64_t length = io.size();
    if (length < 0) return failed(name, "read", static_cast<int>(-length));
    const auto size = static_cast<std::uint64_t>(length);
    auto* group = static_cast<GroupHead*>(buffer);
    LastCommit last;
    std::uint64_t stopped = 0;
    BURIN_TRY(find_commit(io, head, name, size, group, &last, &stopped));
    // What follows was under way when its writer died, unless a commit mark stands behind the break: then
    // bytes that had been committed have changed.
    for (std::uint64_t at = stopped; at + kStorePage <= size; at += kStorePage) {
        if (const int error = read_all(io, at, group, kStorePage)) return failed(name, "read", error);
        if (whole(*group) && group->commit)
            return damaged(name, "a commit follows an unreadable group", stopped);
    }
    if (last.end == 0) return damaged(name, "there is no commit", kStorePage);

    BURIN_TRY(visitor.begin(last.frames, last.map_chunks));
    const bool colour = head.has_colour != 0;
    const std::size_t each = store_chunk_bytes(colour);
    const auto* bytes = static_cast<const unsigned char*>(buffer) + kStorePage;
    for (std::uint64_t at = kStorePage; at < last.end;) {
        if (const int error = read_all(io, at, group, kStorePage)) return failed(name, "read", error);
        const std::size_t all = group_bytes(group->chunks, colour);
        if (const int error = read_all(io, at + kStorePage, group + 1, all - kStorePage))
            return failed(name, "read", error);
        if (group->forget) visitor.forget();
        for (std::uint32_t i = 0; i < group->chunks; ++i) {
            const StoreRecord& record = group->records[i];
            const std::uint64_t place = at + kStorePage + i * each;
            if (record.key == 0 || record.key >> 63 || !chunk_in_range(unpack_key(record.key)))
                return damaged(name, "an impossible key", place);
            if (record_checksum(record.key, bytes + i * each, colour) != record.checksum)
                return damaged(name, "the checksum of a chunk does not match", place);
            BURIN_TRY(visitor.record(record, place));
        }
        if (!std::all_of(bytes + group->chunks * each, bytes + (all - kStorePage),
                         [](unsigned char b) { return b == 0; }))
            return damaged(name, "bytes behind a chunk are not 0", at);
        at += all;
    }
    if (size > last.end)
        if (const int error = -io.truncate(last.end)) return failed(name, "cut", error);
    *tail = {last.end, last.sequence, last.hash};
    return {};
}

}  // namespace burin
