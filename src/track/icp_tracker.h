// SPDX-License-Identifier: MIT
// Tracking against a view of the surface (KinectFusion, Newcombe et al., ISMAR 2011, section 3.5): points
// find the surface where they project into the view, and the pose with the least distances to its planes is
// taken.
#pragma once

#include "core/arena.h"
#include "core/jobs.h"
#include "map/volume.h"
#include "track/descent.h"
#include "track/reference_view.h"
#include "track/track_points.h"

namespace burin {

struct ResidualItem;

struct IcpGates {     // of correspondences at one level
    float most_m;     // from the model's point
    float least_cos;  // of the angle between normals
};

class IcpTracker final : public PoseMeasurement {
  public:
    void place(Arena& arena, int max_width, int max_height);

    // The frame to be tracked; `points` and `jobs` must outlive the next measures, the reference need not be
    // set again.
    void look_at(const TrackPoints& points, Jobs& jobs);

    // The reference, one of: the map as seen from somewhere, at the grids that TrackPoints has of a frame
    // with this camera at its finest level; or another frame. T_world_reference may be far from where the
    // next measures are, correspondences are then few. finest > 0 casts a quarter (1) or a sixteenth (2) of
    // the rays, for candidates by the dozen.
    void look_from(const Volume& volume, const Camera& camera, const Se3& T_world_reference,
                   float max_depth_m, Jobs& jobs, int finest = 0) {
        reference_.look_from(volume, camera, T_world_reference, max_depth_m, finest, jobs);
    }
    void look_at_frame(const TrackPoints& previous, const Se3& T_world_previous, Jobs& jobs) {
        reference_.look_at_frame(previous, T_world_previous, jobs);
    }
    const ReferenceView& reference() const { return reference_; }

    Measured begin_level(const Se3& T_world_camera, int level) override {
        return begin_with_scale(T_world_camera, level);
    }
    Measured measure(const Se3& T_world_camera, int level) override;

  private:
    ReferenceView reference_;
    const TrackPoints* points_ = nullptr;
    Jobs* jobs_ = nullptr;
    float* normals_[TrackPoints::kLevels][3] = {};  // beside the lists of TrackLevel, zero: none
    ResidualItem* items_ = nullptr;
};

}  // namespace burin
