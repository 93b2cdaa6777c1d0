// SPDX-License-Identifier: MIT
// Trilinear reading of the signed distance field at many points: the inner loop of tracking a camera against
// the map (Bylow 2013). The same bits as Sampler's for the same cells.
#pragma once

#include <cstdint>

#include "core/se3.h"
#include "map/chunk_memo.h"
#include "map/volume.h"
#include "simd/sample.h"

namespace burin {

// From the coordinates of a body (a camera, metres) to the voxel lattice, relative to the lowest voxel of the
// body's chunk: single precision is then as good a kilometre away from the world's origin as there.
struct LatticeFrame {
    Vec3i origin;  // voxel; a multiple of 8
    simd::LatticeMap map;

    LatticeFrame(const Volume& volume, const Se3& T_world_body);
    LatticeFrame(Vec3i its_origin, const simd::LatticeMap& its_map) : origin(its_origin), map(its_map) {}
};

// The chunks of one point's cell, remembered from one reading of the point to the next: a pose that is being
// refined moves it by less than a chunk. slot[m]: of the chunk one further along each axis whose bit is set
// in m. key 0: nothing is known. Valid while nobody inserts or removes chunks.
struct CellChunks {
    ChunkKey key;
    std::uint32_t slot[8];
};

// One a thread, some 14 KiB: for a few thousand points.
class BatchSampler {
  public:
    explicit BatchSampler(const Volume& volume);

    // Signed distance (metres) at `count` points given in the body's coordinates, NaN where one of the eight
    // voxels around was never observed. gradients: null, or three arrays: the gradient in world axes
    // (unitless), NaN where the distance is.
    // chunks: null, or one for each point.
    void sample(const LatticeFrame& frame, const float* x, const float* y, const float* z, std::size_t count,
                float* distances, float* const* gradients, CellChunks* chunks = nullptr);

    // The same at world points, x y z x y z ... (metres), gradients (may be null) likewise.
    void sample(const double* points, std::size_t count, float* distances, float* gradients);

  private:
    // Reads the voxels of cells_ (absolute voxel coordinates) and interpolates to distances_, gradients_.
    void finish(int count, bool with_gradients, CellChunks* chunks);
    void load_corners(int count, CellChunks* chunks);

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
