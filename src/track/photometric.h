// SPDX-License-Identifier: MIT
// Tracking on brightness against a keyframe: the pose at which the points look in the keyframe as they do now
// (Kerl, Sturm, Cremers, "Robust odometry estimation for RGB-D cameras", ICRA 2013, with a keyframe as in
// their DVO-SLAM, IROS 2013). Gain and bias of the exposure are fitted.
#pragma once

#include "core/arena.h"
#include "core/jobs.h"
#include "track/descent.h"
#include "track/grey_image.h"
#include "track/reference_view.h"
#include "track/residuals.h"

namespace burin {

class Photometric final : public PoseMeasurement {
  public:
    void place(Arena& arena);
    void clear() {
        has_keyframe_ = false;
        gain_ = 1;
        bias_ = 0;
        forget_scale();
    }

    bool has_keyframe() const { return has_keyframe_; }
    const Se3& T_world_keyframe() const { return T_world_keyframe_; }
    // Makes the current points and their brightness the keyframe.
    void set_keyframe(const TrackPoints& points, const PointBrightness& brightness,
                      const Se3& T_world_camera);

    // Makes the view of the map from somewhere the keyframe, for levels from view.finest() on; it must have
    // grey.
    void set_keyframe(const ReferenceView& view);

    // What the next measures are of; all must outlive them.
    void look_at(const TrackPoints& points, const PointBrightness& brightness, Jobs& jobs);
    Measured begin_level(const Se3& T_world_camera, int level) override;
    Measured measure(const Se3& T_world_camera, int level) override;

    double gain() const { return gain_; }
    double bias() const { return bias_; }

  private:
    struct Moments;
    void measure_item(const Se3& T_keyframe_camera, int level, int item, ResidualItem* out,
                      Moments* moments) const;

    bool has_keyframe_ = false;
    Se3 T_world_keyframe_;
    int widths_[TrackPoints::kLevels] = {}, heights_[TrackPoints::kLevels] = {};
    Camera cameras_[TrackPoints::kLevels];
    float *depth_[TrackPoints::kLevels] = {}, *grey_[TrackPoints::kLevels] = {};

    const TrackPoints* points_ = nullptr;
    const PointBrightness* brightness_ = nullptr;
    Jobs* jobs_ = nullptr;
    double gain_ = 1, bias_ = 0;
    ResidualItem* items_ = nullptr;
    Moments* moments_ = nullptr;
};

}  // namespace burin
