// SPDX-License-Identifier: MIT
// Which chunks a renderer that follows along should mesh again. In a live map most chunks in view change a
// little with every frame; meshing them all takes longer than fusing them. So a chunk has its turn every
// `interval` frames, and is then listed when its surface has moved by more than a threshold.
#pragma once

#include <cstdint>

#include "map/neighbourhood.h"

namespace burin {

struct ChangeRule {
    float threshold_voxels = 0.05f;  // 0: every change counts
    std::uint32_t interval = 64;     // frames, >= 1
};

// Every so many turns a chunk is listed however little it changed: small changes, those of colours, and those
// that the measure does not see (voxels farther than one voxel from the surface, weights that pass a limit)
// come through.
inline constexpr std::uint32_t kSweepTurns = 8;

// Slots of the chunks to be meshed at `frame`, in key order, written to `slots` (room for volume.live());
// returns their number. A chunk stays listed until it is meshed. It follows from the map, from what was
// meshed and from `frame` alone.
std::uint32_t list_changed(Volume& volume, const ChangeRule& rule, std::uint64_t frame, std::uint32_t* slots);

// The chunk in the middle has been meshed, and holds surface or not. Its neighbours, whose cells read voxels
// on its border and whose normals read one more, hear of what has changed in it, and it is no longer listed.
void mark_meshed(Volume& volume, const Neighbourhood& around, bool surface);

}  // namespace burin
