// SPDX-License-Identifier: MIT
// What is meshed: the chunks of the volume, each by itself or with an overlay's geometry over it, and the
// overlay's chunks where the volume has none. Slots below the volume's capacity are those of the volume.
#pragma once

#include "map/overlay.h"
#include "map/volume.h"

namespace burin {

class SurfaceField {
  public:
    // Implicit: a volume is a field. overlay: null for the volume alone.
    SurfaceField(const Volume& volume, const Overlay* overlay = nullptr)
        : volume_(volume), overlay_(overlay), first_alone_(volume.shape().capacity) {}

    float voxel_m() const { return volume_.voxel_m(); }
    float units_to_m() const { return volume_.units_to_m(); }
    bool has_colour() const { return volume_.has_colour(); }

    void prefetch(ChunkKey key) const { volume_.prefetch(key); }
    std::uint32_t find(ChunkKey key) const {
        const std::uint32_t slot = volume_.find(key);
        if (slot != kNoChunk || !overlay_ || overlay_->alone_count() == 0) return slot;
        const std::uint32_t entry = overlay_->find(key);
        return entry != kNoChunk && overlay_->alone(entry) ? first_alone_ + entry : kNoChunk;
    }
    ChunkKey key(std::uint32_t slot) const {
        return slot < first_alone_ ? volume_.key(slot) : overlay_->key(slot - first_alone_);
    }
    const ChunkGeometry& geometry(std::uint32_t slot) const {
        if (!overlay_) return volume_.geometry(slot);
        const std::uint32_t entry = slot < first_alone_ ? volume_.over(slot) : slot - first_alone_;
        return entry == kNoChunk ? volume_.geometry(slot) : overlay_->geometry(entry);
    }
    // Null: the chunk has none.
    const ChunkColour* colour(std::uint32_t slot) const {
        return slot < first_alone_ ? &volume_.colour(slot) : nullptr;
    }

    // Every chunk has one of these numbers; not every number is a chunk's: holds(slot_at(i)).
    std::uint32_t numbers() const {
        return volume_.live() + (overlay_ && overlay_->alone_count() > 0 ? overlay_->count() : 0);
    }
    std::uint32_t slot_at(std::uint32_t i) const {
        return i < volume_.live() ? i : first_alone_ + (i - volume_.live());
    }
    bool holds(std::uint32_t slot) const {
        if (slot < first_alone_) return true;
        const std::uint32_t entry = slot - first_alone_;
        return overlay_->alone(entry) && volume_.find(overlay_->key(entry)) == kNoChunk;
    }

  private:
    const Volume& volume_;
    const Overlay* overlay_;
    std::uint32_t first_alone_;
};

}  // namespace burin
