// SPDX-License-Identifier: MIT
// Step one of Dzitsiuk et al. (ICRA 2017): the planes in one chunk, by robust least squares on its signed
// distances, argmin_p sum w(r) r^2, r = n . x + d - phi.
#pragma once

#include <cstdint>

#include "map/volume.h"
#include "planes/scatter.h"

namespace burin {

inline constexpr int kChunkPlanes = 3;  // a corner of a room
inline constexpr std::uint16_t kNoPlane = 0xffff;

// The axis that a plane is nearest to facing, the first of equals, and the two others, in order.
struct Axes {
    int axis = 0, first = 1, second = 2;
    explicit Axes(int facing) : axis(facing), first(facing == 0 ? 1 : 0), second(facing == 2 ? 1 : 2) {}
    explicit Axes(Vec3d normal);
    Axes() = default;
};

// What one chunk holds of one plane. Metres, from the chunk's centre.
struct Patch {
    float normal[3], offset;  // its own fit, unit normal into free space: normal . x + offset = 0
    float stretch;        // gradient of the stored distances along the normal: 1 seen head on, more aslant
    float rms_m;          // of the fit's residuals
    float n;              // weight: number of voxels, those that fit less counting less
    float p[3], pp[6];    // the foot points of these voxels on the fitted plane: sums as in Scatter
    std::uint64_t cells;  // bit 8 b + a: the column of voxels at (a, b) along `axis` holds surface of it
    std::uint16_t plane;  // the global plane it belongs to, kNoPlane
    std::uint8_t axis;    // the largest component of the normal; (a, b) are the two others in order
    std::uint8_t unused[5];

    Vec3d unit_normal() const { return {normal[0], normal[1], normal[2]}; }
    Vec3d middle(Vec3d centre) const;     // of its foot points, in the world, centre: of the chunk
    Scatter scatter(Vec3d centre) const;  // in the world, centre: of the chunk
};

// Into out[0 .. kChunkPlanes - 1]; returns how many. They belong to no global plane yet. The volume is asked
// for neighbours where the chunk alone holds a single layer of a plane.
int find_candidates(const Volume& volume, std::uint32_t slot, Patch* out);

}  // namespace burin
