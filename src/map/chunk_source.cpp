// SPDX-License-Identifier: MIT
#include "map/chunk_source.h"

namespace burin {

std::uint64_t ChunkSource::hash() {
    rewind();
    std::uint64_t h = mix64(count()), i = 0;
    for (Chunk chunk; next(&chunk, false);) h = mix64(h ^ chunk.checksum) + i++;
    return h;
}

VolumeSource::VolumeSource(const Volume& volume, std::uint32_t* scratch) : volume_(volume), order_(scratch) {
    volume.sorted_slots(scratch);
}

bool VolumeSource::next(Chunk* chunk, bool with_voxels) {
    if (at_ == volume_.live()) return false;
    const std::uint32_t slot = order_[at_++];
    chunk->key = volume_.key(slot);
    chunk->checksum = with_voxels ? 0 : volume_.chunk_hash(slot);
    chunk->geometry = &volume_.geometry(slot);
    chunk->colour = volume_.has_colour() ? &volume_.colour(slot) : nullptr;
    return true;
}

bool StoreSource::next(Chunk* chunk, bool with_voxels) {
    if (keys_.empty()) keys_ = store_.next_keys(volume_, last_);
    if (keys_.empty()) return false;
    chunk->key = last_ = keys_.front();
    keys_ = keys_.subspan(1);
    const std::uint32_t slot = volume_.find(chunk->key);
    if (slot != kNoChunk) {
        chunk->checksum = with_voxels ? 0 : volume_.chunk_hash(slot);
        chunk->geometry = &volume_.geometry(slot);
        chunk->colour = volume_.has_colour() ? &volume_.colour(slot) : nullptr;
        return true;
    }
    const ChunkIndex::Entry* entry = store_.entry(chunk->key);
    chunk->checksum = entry->checksum;
    if (!with_voxels) return true;
    const void* page = store_.read(*entry);
    if (!page) return false;
    chunk->geometry = static_cast<const ChunkGeometry*>(page);
    const void* colour = static_cast<const unsigned char*>(page) + sizeof(ChunkGeometry);
    chunk->colour = volume_.has_colour() ? static_cast<const ChunkColour*>(colour) : nullptr;
    return true;
}

}  // namespace burin
