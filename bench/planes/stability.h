// SPDX-License-Identifier: MIT
// How much the surface of planes trembles while frames come in, with the layer and without.
#pragma once

#include <cstdint>
#include <vector>

#include "planes/mapping.h"

namespace burin::bench {

struct StabilityOptions {
    int every = 8;         // frames between two meshes
    bool refresh = false;  // planes and surface brought up to date before each mesh
    int least_seen = 16;   // observations of both ends of an edge: what has been seen for a while
};

// |difference| along their lattice edges of vertices that are in both of two meshes, one after the other,
// metres. On a told plane: within a voxel of it without the layer, and where it was seen. In view: the frames
// between fused the chunk.
struct Motion {
    std::vector<double> with, without;  // of the same vertices
};

// Both meshes are of one map: the layer only reads the volume, so the volume alone is the map without it.
class Stability {
  public:
    explicit Stability(const StabilityOptions& options) : options_(options) {}
    void take(Mapping& mapping, int frames);
    const Motion& motion() const { return motion_; }
    int pairs() const { return pairs_; }

    struct Vertex {
        std::uint64_t edge;   // lattice place and axis
        float with, without;  // voxels along the edge, from the world's origin
        Vec3f at;             // without the layer, metres
        std::uint32_t slot;   // of its chunk
    };

  private:
    std::vector<Vertex> last_, now_;
    StabilityOptions options_;
    Motion motion_;
    std::uint64_t last_frames_ = 0;
    int pairs_ = 0;
};

}  // namespace burin::bench
