// SPDX-License-Identifier: MIT
// Trilinear reading of the signed distance field at many points: the inner loop of tracking a camera against
// the map (Bylow 2013). The same bits as Sampler's for the same cells.
#pragma once

#include <cstdint>

#include "core/se3.h"
#include "map/volume.h"
#include "simd/sample.h"

namespace burin {

// From the coordinates of a body (a camera, metres) to the voxel lattice, relative to a voxel near the body:
// single precision is then as good a kilometre away from the world's origin as there.
struct LatticeFrame {
    Vec3i origin;  // voxel
    simd::LatticeMap map;

    LatticeFrame(const Volume& volume, const Se3& T_world_body);
};

// The last 512 chunks asked for, by their place modulo 8 in each direction: points of one image or one ray
// ask for few. Valid while nobody inserts or removes chunks.
class ChunkMemo {
  public:
    explicit ChunkMemo(const Volume& volume) : volume_(volume) {}

    std::uint32_t find(ChunkKey key) {
        Entry& entry = entry_of(key);
        if (entry.key != key) entry = {key, volume_.find(key)};
        return entry.slot;
    }
    // Asks the cache for what find(key) will read.
    void prefetch(ChunkKey key) const {
        if (entry_of(key).key != key) volume_.prefetch(key);
    }

  private:
    struct Entry {
        ChunkKey key = 0;
        std::uint32_t slot = kNoChunk;
    };
    static std::size_t index_of(ChunkKey key) { return (key & 7) | (key >> 18 & 0x38) | (key >> 36 & 0x1c0); }
    Entry& entry_of(ChunkKey key) { return entries_[index_of(key)]; }
    const Entry& entry_of(ChunkKey key) const { return entries_[index_of(key)]; }

    const Volume& volume_;
    Entry entries_[512];
};

// One a thread, some 14 KiB: for a few thousand points.
class BatchSampler {
  public:
    explicit BatchSampler(const Volume& volume);

    // Signed distance (metres) at `count` points given in the body's coordinates, NaN where one of the eight
    // voxels around was never observed. gradients: null, or three arrays: the gradient in world axes
    // (unitless), NaN where the distance is.
    void sample(const LatticeFrame& frame, const float* x, const float* y, const float* z, std::size_t count,
                float* distances, float* const* gradients);

    // The same at world points, x y z x y z ... (metres), gradients (may be null) likewise.
    void sample(const double* points, std::size_t count, float* distances, float* gradients);

  private:
    // Reads the voxels of cells_ (absolute voxel coordinates) and interpolates to distances_, gradients_.
    void finish(int count, bool with_gradients);
    void load_corners(int count);

    const Volume& volume_;
    double inverse_voxel_;
    simd::SampleScale scale_;
    ChunkMemo memo_;
    simd::Cells cells_;
    simd::Corners corners_{};
    alignas(64) float distances_[simd::kSampleBatch];
    alignas(64) float gradients_[3][simd::kSampleBatch];
};

}  // namespace burin
