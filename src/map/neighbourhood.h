// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "map/volume.h"

namespace burin {

// The 27 chunks around (and with) one chunk, looked up once.
struct Neighbourhood {
    std::uint32_t slot[27];  // kNoChunk where absent; index (dz + 1) * 9 + (dy + 1) * 3 + dx + 1
    Vec3i chunk;

    template <class Chunks>  // a Volume or a SurfaceField
    Neighbourhood(const Chunks& volume, Vec3i centre) : chunk(centre) {
        // All places are asked for before the first is read: the cache then fetches them side by side.
        ChunkKey keys[27];
        for (int i = 0; i < 27; ++i) {
            const Vec3i c = {centre.x + i % 3 - 1, centre.y + i / 3 % 3 - 1, centre.z + i / 9 - 1};
            keys[i] = chunk_in_range(c) ? pack_key(c) : 0;
            volume.prefetch(keys[i]);
        }
        for (int i = 0; i < 27; ++i) slot[i] = keys[i] != 0 ? volume.find(keys[i]) : kNoChunk;
    }
    std::uint32_t centre() const { return slot[13]; }
    // Voxel (x, y, z) relative to the centre chunk, each in -8..15: its chunk's place in `slot`, and its
    // index there.
    static int place(int x, int y, int z) { return ((z >> 3) + 1) * 9 + ((y >> 3) + 1) * 3 + (x >> 3) + 1; }
    static int voxel(int x, int y, int z) { return (z & 7) << 6 | (y & 7) << 3 | (x & 7); }
};

}  // namespace burin
