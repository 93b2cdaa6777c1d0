// SPDX-License-Identifier: MIT
// Where the camera is, frame after frame: predict, align against the map, and judge the outcome.
#pragma once

#include "capture/frame.h"
#include "core/arena.h"
#include "core/jobs.h"
#include "depth/depth_image.h"
#include "map/volume.h"
#include "track/descent.h"
#include "track/icp_tracker.h"
#include "track/sdf_tracker.h"
#include "track/track_points.h"

namespace burin {

enum class Tracker : std::uint8_t { none, sdf, icp };
enum class TrackingState : std::uint8_t { tracking, weak, lost };

struct TrackingOptions {
    Tracker tracker = Tracker::none;
};

struct TrackingReport {
    TrackingState state = TrackingState::lost;
    Se3 T_world_camera;
    int evaluations = 0;
    double inlier_share = 0, cost = 0, scale = 0;
    double track_ms = 0;
};

class CameraTracking {
  public:
    void place(Arena& arena, const TrackingOptions& options, const DepthOptions& depth);
    void clear() { frames_ = 0; }

    // The first frame's pose is the one that the frame comes with.
    TrackingReport track(const Volume& volume, const DepthImage& depth, const FrameView& frame, Jobs& jobs);

  private:
    TrackingOptions options_;
    TrackPoints points_;
    SdfTracker sdf_;
    IcpTracker icp_;
    float max_depth_m_ = 0;
    int frames_ = 0;
    std::int64_t last_t_ns_ = 0;
    Se3 last_, before_;
};

}  // namespace burin
