// SPDX-License-Identifier: MIT
// Kernels of colour: which voxels of a chunk take colour, and the running mean of what the camera shows
// there.
#pragma once

#include <cstddef>
#include <cstdint>

#include "simd/tsdf.h"

namespace burin::simd {

struct ColourFrame {
    const std::uint8_t* rgb;  // interleaved; height * stride < 2^31
    int width, height;
    std::ptrdiff_t stride;  // bytes
    // Pixel = (fx x + cx, fy y + cy) of the distorted ray when any coefficient is not 0.
    bool distorted;
    float fx, fy, cx, cy, k1, k2, p1, p2, k3;
    // Projective coordinates (fx X + cx Z, fy Y + cy Z, Z; metres) of one voxel along x, y and z.
    float step_u[3], step_v[3], step_z[3];
    std::uint32_t number;  // seed of the rounding
};

// The voxels with |distance| <= band, in order, and their last one again up to a whole multiple of 16: `list`
// has room for kListRoom. Returns their number without the repetition. Asks the cache for their colours.
inline constexpr int kListRoom = kChunkVoxels + 8;  // vectors overrun the end
int select_voxels(const std::int16_t* distances, std::int16_t band, const std::uint8_t* colours,
                  std::uint16_t* list);

// Offsets (bytes) in the colour image of the pixels nearest to the projections ((x step[0] + y step[1]) + z
// step[2])
// + base of the `count` voxels of a list by select_voxels, its repetition included; -1 for those beside the
// image, behind the camera or on its very last pixel (pixels are read four bytes at a time). Asks the cache
// for the pixels.
void find_pixels(const std::uint16_t* list, int count, const ColourFrame& frame, ProjectiveBase base,
                 std::int32_t* offsets);

// For these voxels, where they have a pixel: colours: 512 x (r, g, b, count), aligned to 4. New colour =
// (old * count + reading) / (count + 1), count capped at kColourMemory. Rounded with a threshold that changes
// with voxel and frame: round-to-nearest would freeze the mean as soon as a reading differs by less than
// (count + 1) / 2 levels. Returns the largest count afterwards of the voxels that took a reading, 0 when none
// did.
inline constexpr int kColourMemory =
    24;  // rounding noise grows, reading noise falls with it; about 1.7 levels of each
int fuse_colours(const std::uint16_t* list, int count, const ColourFrame& frame, const std::int32_t* offsets,
                 std::uint8_t* colours);

namespace scalar {
int select_voxels(const std::int16_t* distances, std::int16_t band, const std::uint8_t* colours,
                  std::uint16_t* list);
void find_pixels(const std::uint16_t* list, int count, const ColourFrame& frame, ProjectiveBase base,
                 std::int32_t* offsets);
int fuse_colours(const std::uint16_t* list, int count, const ColourFrame& frame, const std::int32_t* offsets,
                 std::uint8_t* colours);
}  // namespace scalar

}  // namespace burin::simd
