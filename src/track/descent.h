// SPDX-License-Identifier: MIT
// From a start to the pose that explains the points best: Gauss-Newton with damping (Levenberg-Marquardt),
// coarse to fine. What is measured, field, raycast or colour, is behind PoseMeasurement.
#pragma once

#include "core/se3.h"
#include "track/normal_equations.h"
#include "track/track_points.h"

namespace burin {

// What the points of one level say at one pose. Residuals are in units of `scale` standard deviations of a
// reading.
struct Measured {
    NormalEquations system;
    double median = 0;      // of |residual|, in standard deviations of a reading, over the points that count
    double considered = 0;  // points of the level, found in the model or not
    // Of geometry alone: points of the level, of those the ones in space that was observed before, and of
    // those the ones within kCloseSigmas of the surface.
    double depth_points = 0, known = 0, close = 0;
    // Of colour alone: points with brightness, of those the ones the keyframe shows too, and `median` of
    // colour.
    double bright = 0, seen = 0, colour_median = 0;
};

// A reading this many of its standard deviations from the surface agrees with it: 87 % of normal ones do.
inline constexpr double kCloseSigmas = 1.5;

class PoseMeasurement {
  public:
    // Chooses what stays fixed while poses of one level are compared: above all the robust scale, from the
    // residuals at T. Returns the measurement at T.
    virtual Measured begin_level(const Se3& T_world_camera, int level) = 0;
    // T_world_camera need not be near the last one. Results do not depend on threads.
    virtual Measured measure(const Se3& T_world_camera, int level) = 0;
    // Robust standard deviation of residuals at the level begun, in standard deviations of a reading.
    double scale() const { return scale_; }
    // A level begins with the scale of the one before: of a new recording it must not be that of the last
    // one.
    void forget_scale() { scale_ = 1; }

  protected:
    ~PoseMeasurement() = default;
    // begin_level for measurements with nothing but a scale to choose.
    Measured begin_with_scale(const Se3& T_world_camera, int level);

    double scale_ = 1;
};

struct MotionPriorTerm {  // a normal distribution around a predicted pose
    Se3 T_world_camera;
    double sigma_m = 0, sigma_rad = 0;  // 0: no prior
};

struct DescentOptions {
    int steps[TrackPoints::kLevels] = {5, 6, 8};  // at most, finest first
    int finest = 0;                               // the level to end at
    // A step that moves no point at 2 m by more than a twentieth of a 5 mm voxel: smaller ones change no
    // error.
    double least_m = 1e-4, least_rad = 1e-4;
};

struct PoseFit {
    Se3 T_world_camera;
    Measured measured;  // at the pose, of the finest level, without the prior
    double cost = 0;    // a point of the finest level; points that the model lacks cost kMissCost
    double scale = 0;   // robust standard deviation of residuals, in standard deviations of a reading
    int evaluations = 0;
    bool converged = false;  // the last step was below least_*
};

// A point without correspondence costs as much as one 2 scaled deviations off under Huber's k of 1.345: so
// that losing points never pays, and finding bad ones does not either.
inline constexpr double kMissCost = 1.7855;  // k (2 - k / 2)

// Robust scale from the median absolute residual of a normal distribution, kept within reason.
double scale_of(double median);

// Cost a point at one pose and scale, prior included.
double cost_at(const Measured& measured);

PoseFit descend(PoseMeasurement& measurement, const Se3& start, const MotionPriorTerm& prior,
                const DescentOptions& options);

}  // namespace burin
