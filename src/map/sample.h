// SPDX-License-Identifier: MIT
// Trilinear reading of the signed distance field.
#pragma once

#include "map/volume.h"

namespace burin {

// Reads at points that lie near each other: remembers the chunk it used last. One a thread.
class Sampler {
  public:
    explicit Sampler(const Volume& volume) : volume_(volume), inverse_voxel_(1.0 / volume.voxel_m()) {}

    // Signed distance (metres) at a world point; false when one of the eight voxels around it was never
    // observed.
    bool distance(Vec3d p, float* out) { return interpolate(p, out, nullptr); }
    // The same with the gradient of the trilinear interpolant (unitless, about length 1 near the surface).
    bool distance_and_gradient(Vec3d p, float* out, Vec3f* gradient) { return interpolate(p, out, gradient); }
    // Distance of the voxel that contains p, no interpolation; false when never observed. *in_chunk tells
    // whether its chunk exists at all.
    bool nearest(Vec3d p, float* out, bool* in_chunk);
    // Colour, trilinear over the voxels around p that have one; false when none has.
    bool colour(Vec3d p, float rgb[3]);

  private:
    bool interpolate(Vec3d p, float* out, Vec3f* gradient);
    std::uint32_t chunk_of(Vec3i voxel);

    const Volume& volume_;
    double inverse_voxel_;
    ChunkKey last_key_ = 0;
    std::uint32_t last_slot_ = kNoChunk;
};

}  // namespace burin
