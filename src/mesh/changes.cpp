// SPDX-License-Identifier: MIT
#include "mesh/changes.h"

#include <algorithm>
#include <cmath>

#include "core/hash.h"

namespace burin {
namespace {

void clear_flags(Volume& volume, std::uint32_t slot, unsigned bits) {
    volume.flags(slot) = static_cast<std::uint8_t>(volume.flags(slot) & ~bits);
}

// The neighbours' meshes, and its own, are behind by what has moved in the chunk since this was last told.
// Those without surface are none the worse for it: where surface comes near their border, voxels of their own
// change.
void tell(Volume& volume, std::uint32_t slot, const Neighbourhood& around) {
    if (!(volume.flags(slot) & kChunkDirty)) return;
    for (const std::uint32_t neighbour : around.slot) {
        if (neighbour == kNoChunk) continue;
        volume.flags(neighbour) |= kChunkStale;
        if (volume.flags(neighbour) & kChunkSurface || neighbour == slot)
            volume.mesh_lag(neighbour) = add_saturated(volume.mesh_lag(neighbour), volume.moved(slot));
    }
    volume.moved(slot) = 0;
    clear_flags(volume, slot, kChunkDirty);
}

// Chunks of one block of 4x4x4 have their turn together: their voxels and places are then fetched once, and a
// renderer gets patches instead of crumbs.
std::uint64_t block_hash(ChunkKey key) {
    const Vec3i c = unpack_key(key);
    return mix64(pack_key({c.x >> 2, c.y >> 2, c.z >> 2}));
}

}  // namespace

std::uint32_t list_changed(Volume& volume, const ChangeRule& rule, std::uint64_t frame,
                           std::uint32_t* slots) {
    const float units = rule.threshold_voxels * volume.voxel_m() / volume.units_to_m();
    const auto threshold = static_cast<std::uint16_t>(std::min(units, 65534.0f));
    const std::uint64_t sweep = std::uint64_t{rule.interval} * kSweepTurns;
    // Where every change counts, chunks are listed for what has changed beside them too. Else they hear of
    // that when the neighbour is meshed, and it counts at their own turn.
    if (threshold == 0)
        for (std::uint32_t slot = 0; slot < volume.live(); ++slot)
            if (volume.flags(slot) & kChunkDirty)
                tell(volume, slot, Neighbourhood(volume, unpack_key(volume.key(slot))));
    std::uint32_t count = 0;
    for (std::uint32_t slot = 0; slot < volume.live(); ++slot) {
        const unsigned flags = volume.flags(slot);
        if (!(flags & (kChunkDirty | kChunkStale))) continue;
        const std::uint16_t moved = add_saturated(volume.mesh_lag(slot), volume.moved(slot));
        const bool first = !(flags & kChunkMeshed) && moved > 0;
        if (!(flags & kChunkListed) && !first) {
            const std::uint64_t every = threshold == 0 || moved > threshold ? rule.interval : sweep;
            if ((block_hash(volume.key(slot)) + frame) % every != 0) continue;
        }
        volume.flags(slot) |= kChunkListed;
        slots[count++] = slot;
    }
    // All tell before the first is meshed: a neighbour that is meshed in the same round is not behind
    // afterwards.
    for (std::uint32_t i = 0; i < count; ++i)
        if (volume.flags(slots[i]) & kChunkDirty)
            tell(volume, slots[i], Neighbourhood(volume, unpack_key(volume.key(slots[i]))));
    std::sort(slots, slots + count,
              [&volume](std::uint32_t a, std::uint32_t b) { return volume.key(a) < volume.key(b); });
    return count;
}

void mark_meshed(Volume& volume, const Neighbourhood& around, bool surface) {
    const std::uint32_t slot = around.centre();
    tell(volume, slot, around);
    volume.mesh_lag(slot) = 0;
    clear_flags(volume, slot, kChunkStale | kChunkListed | kChunkSurface);
    volume.flags(slot) |= surface ? kChunkMeshed | kChunkSurface : kChunkMeshed;
}

}  // namespace burin
