// SPDX-License-Identifier: MIT
// The linear system of one step of a camera pose, and what it tells of itself: which motions the measurements
// hold and which they leave free. Everything in double and in a fixed order.
#pragma once

#include "core/se3.h"
#include "simd/track.h"

namespace burin {

// Sum of w J^T J and w J^T u over residuals u = u0 + J xi, xi a twist in the camera's own axes (v in metres,
// then w in radians), so that A xi = -b is the Gauss-Newton step.
struct NormalEquations {
    double A[6][6] = {};
    double b[6] = {};
    double cost = 0;  // of the robust functions
    double points = 0, inliers = 0;

    // Of one item's lanes, in lane order. Only the upper triangle of A is filled until finish().
    void add(const simd::TrackSums& sums);
    // inverse_scale as given to track_sums. Mirrors the triangle.
    void finish(double inverse_scale);
    void scale_by(double weight);  // every sum
    NormalEquations& operator+=(const NormalEquations& other);
    // A quadratic pull towards the motion `to` with the given standard deviations (metres, radians); 0: no
    // pull.
    void add_prior(const Twist& to, double sigma_m, double sigma_rad);
    // (A + damping diag(A)) xi = -b by LDL^T. False when it is not positive definite or not finite.
    bool solve(double damping, Twist* xi) const;
};

// Eigenvalues of A in ascending order, with rotations measured by the arc at `reach_m` (so that both halves
// have the same unit); vectors[i] belongs to values[i], in the scaled unknowns (v, reach_m w). By Jacobi's
// rotations.
struct Spectrum {
    double values[6];
    double vectors[6][6];
};
Spectrum spectrum_of(const NormalEquations& system, double reach_m);

}  // namespace burin
