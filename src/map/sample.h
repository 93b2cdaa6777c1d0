// SPDX-License-Identifier: MIT
// Trilinear reading of the signed distance field.
#pragma once

#include <cmath>

#include "map/volume.h"
#include "simd/sample.h"

namespace burin {

// Lowest voxel of the cell of eight voxel centres around world point p, and where in the cell p lies. False
// when p is outside what keys can tell.
inline bool cell_of(Vec3d p, double inverse_voxel, Vec3i* low, float place[3]) {
    for (int r = 0; r < 3; ++r) {
        const double x = p[r] * inverse_voxel - 0.5;
        if (!(std::fabs(x) < (kChunkLimit - 2.0) * kChunkSide)) return false;
        std::int32_t floor = static_cast<std::int32_t>(x);
        floor -= floor > x;
        (*low)[r] = floor;
        place[r] = static_cast<float>(x - floor);
    }
    return true;
}

// To metres, and to a gradient without unit.
inline simd::SampleScale sample_scale(const Volume& volume) {
    return {volume.units_to_m(), volume.units_to_m() * static_cast<float>(1.0 / volume.voxel_m())};
}

// Reads at points that lie near each other: remembers the chunk it used last. One a thread.
class Sampler {
  public:
    explicit Sampler(const Volume& volume)
        : volume_(volume), inverse_voxel_(1.0 / volume.voxel_m()), scale_(sample_scale(volume)) {}

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
    bool corners(Vec3i low, float d[8]);
    std::uint32_t chunk_of(Vec3i voxel);

    const Volume& volume_;
    double inverse_voxel_;
    simd::SampleScale scale_;
    ChunkKey last_key_ = 0;
    std::uint32_t last_slot_ = kNoChunk;
};

}  // namespace burin
