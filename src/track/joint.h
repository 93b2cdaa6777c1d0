// SPDX-License-Identifier: MIT
// Geometry and colour in one system: each weighed by the robust scale of its own residuals.
#pragma once

#include "track/descent.h"

namespace burin {

class JointMeasurement final : public PoseMeasurement {
  public:
    // colour_weight: of a colour residual beside a geometric one of as many of its own standard deviations.
    void look_at(PoseMeasurement& geometry, PoseMeasurement& colour, double colour_weight) {
        geometry_ = &geometry;
        colour_ = &colour;
        base_weight_ = colour_weight;
    }

    Measured begin_level(const Se3& T_world_camera, int level) override;
    Measured measure(const Se3& T_world_camera, int level) override;

  private:
    Measured sum() const;

    PoseMeasurement *geometry_ = nullptr, *colour_ = nullptr;
    double base_weight_ = 1, weight_ = 1;
    Measured last_geometry_, last_colour_;
};

}  // namespace burin
