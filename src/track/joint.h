// SPDX-License-Identifier: MIT
// Geometry and colour in one system: each weighed by the robust scale of its own residuals.
#pragma once

#include "track/descent.h"

namespace burin {

class JointMeasurement final : public PoseMeasurement {
  public:
    // colour_weight: of a colour residual beside a geometric one of as many of its own standard deviations.
    JointMeasurement(PoseMeasurement& geometry, PoseMeasurement& colour, double colour_weight)
        : geometry_(geometry), colour_(colour), weight_(colour_weight) {}

    Measured begin_level(const Se3& T_world_camera, int level) override;
    Measured measure(const Se3& T_world_camera, int level) override;

    // Of the last measure.
    const Measured& geometry() const { return last_geometry_; }
    const Measured& colour() const { return last_colour_; }

  private:
    Measured sum() const;

    PoseMeasurement &geometry_, &colour_;
    double weight_;
    Measured last_geometry_, last_colour_;
};

}  // namespace burin
