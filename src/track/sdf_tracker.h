// SPDX-License-Identifier: MIT
// Tracking directly on the signed distance field (Bylow, Sturm, Kerl, Kahl, Cremers, RSS 2013): the pose
// whose points have the least distance, argmin sum w D(R x + t)^2 with D and its gradient trilinear from the
// chunks. No raycast, no correspondence.
#pragma once

#include <cstdint>

#include "core/arena.h"
#include "core/jobs.h"
#include "map/sample_batch.h"
#include "map/volume.h"
#include "track/descent.h"
#include "track/track_points.h"

namespace burin {

struct ResidualItem;

class SdfTracker final : public PoseMeasurement {
  public:
    void place(Arena& arena);
    // What the next measures are of; all three must outlive them. Once a frame, after its points were built
    // and while the volume stays as it is.
    void look_at(const Volume& volume, const TrackPoints& points, Jobs& jobs);
    Measured begin_level(const Se3& T_world_camera, int level) override {
        return begin_with_scale(T_world_camera, level);
    }
    Measured measure(const Se3& T_world_camera, int level) override;

  private:
    const Volume* volume_ = nullptr;
    const TrackPoints* points_ = nullptr;
    Jobs* jobs_ = nullptr;
    ResidualItem* items_ = nullptr;
    CellChunks* chunks_[TrackPoints::kLevels] = {};  // of each point in the list
};

}  // namespace burin
