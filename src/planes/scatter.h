// SPDX-License-Identifier: MIT
// The normal equations of a plane through weighted points: sums of 1, p and p p^T. They add up, so a plane
// over many chunks needs no second look at the voxels.
#pragma once

#include "core/vec.h"

namespace burin {

struct Scatter {
    double n = 0;       // sum of weights
    Vec3d p;            // sum of weight * point, metres
    double pp[6] = {};  // xx xy xz yy yz zz
    void add(const Scatter& o, double sign = 1);
    Vec3d centroid() const { return n > 0 ? p * (1 / n) : Vec3d{}; }
};

// The plane of least squared distances. axes: columns e1 (its normal), e2, e3 of the centred scatter over n,
// and their eigenvalues, ascending (m^2).
struct PlaneFit {
    Vec3d normal, centroid;
    double offset = 0;  // normal . x + offset = 0
    Vec3d axis[3];
    double variance[3] = {};
};
// towards: the side that the normal is to point to. n > 0.
PlaneFit fit_plane(const Scatter& sums, Vec3d towards);

}  // namespace burin
