// SPDX-License-Identifier: MIT
// Reads the field along rays, in lattice coordinates relative to a chunk and distances in voxels: what
// Sampler does, in single precision and with a memory of chunks that the rays of a tile share.
#pragma once

#include "map/chunk_memo.h"
#include "map/sample.h"
#include "map/sample_batch.h"

namespace burin {

// Floor and nearest integer, halves up, without the library; |x| < 2^30.
inline std::int32_t floor_int(float x) {
    const std::int32_t i = static_cast<std::int32_t>(x);
    return i - (static_cast<float>(i) > x);
}
inline std::int32_t nearest_int(float x) { return floor_int(x + 0.5f); }

// One a thread.
class FieldReader {
  public:
    // `origin`: the voxel at lattice coordinates 0, a multiple of 8.
    FieldReader(const Volume& volume, Vec3i origin)
        : volume_(volume),
          units_to_voxels_(volume.units_to_m() / volume.voxel_m()),
          memo_(volume),
          base_(pack_key({origin.x >> 3, origin.y >> 3, origin.z >> 3})) {}

    enum Nearest { kNoChunkThere, kUnknown, kKnown };

    // Distance at the nearest voxel.
    Nearest nearest(Vec3f v, float* d) {
        const Vec3i voxel{nearest_int(v.x), nearest_int(v.y), nearest_int(v.z)};
        const ChunkGeometry* g = chunk_of(voxel);
        if (!g) return kNoChunkThere;
        const int i = voxel_index(voxel);
        if (g->weight[i] == 0) return kUnknown;
        *d = units_to_voxels_ * g->sdf[i];
        return kKnown;
    }

    // False when one of the eight voxels around v was never observed.
    bool trilinear(Vec3f v, float* d) {
        float corner[8], t[3];
        if (!corners(v, corner, t)) return false;
        *d = units_to_voxels_ * simd::trilinear(corner, t[0], t[1], t[2]).value;
        return true;
    }
    bool gradient(Vec3f v, Vec3f* g) {
        float corner[8], t[3];
        if (!corners(v, corner, t)) return false;
        const simd::Trilinear at = simd::trilinear(corner, t[0], t[1], t[2]);
        *g = {units_to_voxels_ * at.gradient[0], units_to_voxels_ * at.gradient[1],
              units_to_voxels_ * at.gradient[2]};
        return true;
    }

  private:
    const ChunkGeometry* chunk_of(Vec3i voxel) {
        const auto part = [](std::int32_t v, int shift) {
            return static_cast<ChunkKey>(static_cast<std::int64_t>(v >> 3)) << shift;
        };
        const ChunkKey key = base_ + part(voxel.x, 0) + part(voxel.y, 21) + part(voxel.z, 42);
        if (key != last_key_) {
            last_key_ = key;
            const std::uint32_t slot = memo_.find(key);
            last_ = slot == kNoChunk ? nullptr : &volume_.geometry(slot);
        }
        return last_;
    }

    bool corners(Vec3f v, float d[8], float t[3]) {
        const Vec3i low{floor_int(v.x), floor_int(v.y), floor_int(v.z)};
        for (int k = 0; k < 3; ++k) t[k] = v[k] - static_cast<float>(low[k]);
        bool known = true;
        if ((low.x & 7) != 7 && (low.y & 7) != 7 && (low.z & 7) != 7) {  // two of three: all in one chunk
            const ChunkGeometry* g = chunk_of(low);
            if (!g) return false;
            const int index = voxel_index(low);
            for (int i = 0; i < 8; ++i) {
                const int at = index + (i & 1) + (i >> 1 & 1) * 8 + (i >> 2) * 64;
                known &= g->weight[at] != 0;
                d[i] = g->sdf[at];
            }
            return known;
        }
        // Up to eight chunks, each looked up once.
        const bool across[3] = {(low.x & 7) == 7, (low.y & 7) == 7, (low.z & 7) == 7};
        const ChunkGeometry* chunks[8];
        for (int i = 0; i < 8; ++i) {
            int same = i;  // the lowest corner in the same chunk
            for (int k = 0; k < 3; ++k)
                if (!across[k]) same &= ~(1 << k);
            const Vec3i at{low.x + (i & 1), low.y + (i >> 1 & 1), low.z + (i >> 2)};
            chunks[i] = same == i ? chunk_of(at) : chunks[same];
            if (!chunks[i]) return false;
            const int index = voxel_index(at);
            known &= chunks[i]->weight[index] != 0;
            d[i] = chunks[i]->sdf[index];
        }
        return known;
    }

    const Volume& volume_;
    float units_to_voxels_;
    ChunkMemo memo_;
    ChunkKey base_;
    ChunkKey last_key_ = 0;
    const ChunkGeometry* last_ = nullptr;
};

}  // namespace burin
