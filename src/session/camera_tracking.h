// SPDX-License-Identifier: MIT
// Where the camera is, frame after frame: predict, align with the map, judge; and when it was lost, find it
// again.
#pragma once

#include "capture/frame.h"
#include "core/arena.h"
#include "core/jobs.h"
#include "depth/depth_image.h"
#include "map/volume.h"
#include "track/descent.h"
#include "track/fern_section.h"
#include "track/ferns.h"
#include "track/grey_image.h"
#include "track/icp_tracker.h"
#include "track/joint.h"
#include "track/motion_prior.h"
#include "track/photometric.h"
#include "track/point_selection.h"
#include "track/sdf_tracker.h"
#include "track/track_points.h"
#include "track/verdict.h"

namespace burin {

enum class Tracker : std::uint8_t { none, sdf, icp };

struct TrackingOptions {
    Tracker tracker = Tracker::none;
    bool colour = true;  // also the brightness against a keyframe, where frames have colour
    bool gyro = true;    // also the gyroscope, where frames have samples
    // Of a colour residual beside one of depth, each in its own deviations. Equal: neither was better on all
    // sequences.
    double colour_weight = 1;
    bool select = true;  // the finest points by their information; false: all
    DescentOptions descent;
    FernOptions ferns;
};

struct TrackingReport {
    TrackingState state = TrackingState::lost;
    Se3 T_world_camera;  // not of a lost frame
    Verdict verdict;
    double cost = 0, scale = 0;
    int evaluations = 0;
    bool relocalised = false;
    double track_ms = 0;
};

class CameraTracking {
  public:
    void place(Arena& arena, const TrackingOptions& options, const DepthOptions& depth);
    void clear();
    // The map was replaced by one from a file: the camera has to be found in it.
    void look_for_camera();
    MapExtra* keyframes() { return options_.tracker == Tracker::none ? nullptr : &section_; }

    // The pose of the frame serves as the first one of an empty map, and is not looked at otherwise.
    TrackingReport track(const Volume& volume, const DepthImage& depth, const FrameView& frame, Jobs& jobs);

    bool gravity(Vec3d* up_world, double* sigma_rad) const { return prior_.gravity(up_world, sigma_rad); }

  private:
    PoseMeasurement& geometry();
    PoseMeasurement& measurement();
    Prediction predict(const FrameView& frame);
    double since_last_s(
        const FrameView& frame) const;  // seconds from the last pose that was known, not below 0
    // descend, its evaluations counted.
    static PoseFit fitted(PoseMeasurement& measured, const Se3& start, const MotionPriorTerm& prior,
                          const DescentOptions& options, TrackingReport* report);
    PoseFit follow(const DepthImage& depth, const FrameView& frame, TrackingReport* report);
    // Among the frames that were fused a frame with this verdict stands out.
    static constexpr double kStrange = 0.93;
    // A camera that turns at 400 degrees a second leaves three quarters of what was known in sight.
    static constexpr double kHidden = 0.6;
    bool fits_less_than_usual(const Verdict& verdict) const {
        return verdict.close_share < kStrange * usual_close_share_;
    }
    bool strange(const Verdict& verdict) const;
    bool sudden(const Verdict& verdict) const;
    bool hidden(const Verdict& verdict) const {  // of what was known, much is out of sight at once
        return verdict.known_share < kHidden * usual_known_share_;
    }
    bool doubtful(const Verdict& verdict) const;
    void watch_interruption(const FrameView& frame, const Verdict& verdict);
    void keep(const DepthImage& depth, const FrameView& frame, const TrackingReport& report);

    // camera_recovery.cpp
    PoseFit rescued(const FrameView& frame, const PoseFit& failed, TrackingReport* report);
    PoseFit find_again(const DepthImage& depth, const FrameView& frame, TrackingReport* report);
    Se3 drawn_near(const Se3& start, bool by_colour, TrackingReport* report);
    Se3 swept(const Se3& near, TrackingReport* report);
    PoseFit settled(const Se3& near, bool by_colour, TrackingReport* report);
    bool view_map(const Se3& T_world_camera);
    bool has_view_colour() const;
    bool looks_like_map(const Se3& T_world_camera, double grey);
    // Keyframes tried for a lost camera, a frame: of five the right one is among them 97 times in 100
    // (docs/relocalisation.md).
    static constexpr int kCandidates = 5, kStarts = 3 + kCandidates;
    int starts_of_search(const DepthImage& depth, const FrameView& frame, const Prediction& ahead,
                         Se3 (&starts)[kStarts]);
    PoseFit search(const DepthImage& depth, const FrameView& frame, const Prediction& ahead,
                   const PoseFit* followed, TrackingReport* report);
    PoseFit looked_for(const DepthImage& depth, const FrameView& frame, const Prediction& ahead,
                       const PoseFit& followed, TrackingReport* report);
    void begin_anew(const Verdict& found);

    TrackingOptions options_;
    float max_depth_m_ = 0;
    TrackPoints points_;
    SdfTracker sdf_;
    IcpTracker icp_;
    PointSelection selection_;
    GreyImage grey_;
    PointBrightness brightness_;
    Photometric photometric_;
    Photometric rendered_;  // against the map's own colours
    JointMeasurement joint_;
    MotionPrior prior_;
    FernKeyframes ferns_;
    FernSection section_{ferns_};

    // Of the frame under way.
    const Volume* volume_ = nullptr;
    Jobs* jobs_ = nullptr;
    Camera grid_camera_;
    bool icp_ready_ = false;  // it has the points

    std::uint64_t frames_ = 0;
    bool bright_ = false;                                   // this frame has colour
    bool known_ = false;                                    // where the camera was in the last frame
    int sure_ = 0;                                          // frames tracked one after another
    double usual_close_share_ = 0, usual_known_share_ = 0;  // of recent frames, 0: not known
    double usual_weakest_m_ = 0;                            // the same
    int fused_ = 0;                                         // frames, up to kYoungFrames
    int strange_frames_ = 0;                                // in a row
    Se3 last_;                                              // the last pose that was known
    std::int64_t last_t_ns_ = 0;
    Se3 last_sure_;  // of a frame that was fused

    // Frames that nothing held, or behind a hand: until one fits as those before did, none is fused.
    bool interrupted_ = false, was_hidden_ = false;
    int interrupted_frames_ = 0, held_frames_ = 0, searches_ = 0;
    std::int64_t interrupted_t_ns_ = 0;  // when a frame was last hidden or not held
};

}  // namespace burin
