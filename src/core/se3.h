// SPDX-License-Identifier: MIT
// Rigid transforms. T_a_b maps coordinates in frame b to coordinates in frame a: p_a = T_a_b * p_b.
#pragma once

#include "core/status.h"
#include "core/vec.h"

namespace burin {

struct Quaternion {  // unit, Hamilton, order x y z w as in TUM files
    double x = 0, y = 0, z = 0, w = 1;
};

struct Se3 {
    Mat3d R;
    Vec3d t;  // metres

    Vec3d operator*(Vec3d p) const { return R * p + t; }
    Se3 operator*(const Se3& b) const { return {R * b.R, R * b.t + t}; }
    Se3 inverse() const;
};

// Normalises q. Error: a non-finite component, or a norm off 1 by more than 5 % (then it was no rotation;
// files with few digits stay far below that).
Result<Se3> se3_from_quaternion(Vec3d t, Quaternion q);

// From a row-major 4x4 (the last row must be 0 0 0 1 within 1e-6) or 3x4. Error: non-finite, or R^T R off the
// identity by more than `tolerance` in any entry, or a reflection. The rotation is re-orthonormalised.
Result<Se3> se3_from_matrix(const double* row_major, int rows, double tolerance = 0.02);

Quaternion quaternion_of(const Mat3d& R);  // w >= 0

// A small motion in a body's own axes: v (metres), then w (radians).
struct Twist {
    double v[3] = {}, w[3] = {};
};
// T moved by xi: R' = R exp(w), t' = t + R v. exp(w) is the unit quaternion along (w / 2, 1), which is the
// exponential up to |w|^3 / 12 and takes no sine; the result is orthonormal to rounding however often this is
// repeated.
Se3 moved(const Se3& T, const Twist& xi);
// xi with moved(from, xi) == to, for rotations of less than 180 degrees.
Twist motion_between(const Se3& from, const Se3& to);
// The same transform with its rotation brought back to orthonormal: products of products drift off.
Se3 orthonormal(const Se3& T);

}  // namespace burin
