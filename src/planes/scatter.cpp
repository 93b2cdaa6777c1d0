// SPDX-License-Identifier: MIT
#include "planes/scatter.h"

#include <utility>

#include "core/jacobi.h"

namespace burin {

void Scatter::add(const Scatter& o, double sign) {
    n += sign * o.n;
    p = p + o.p * sign;
    for (int i = 0; i < 6; ++i) pp[i] += sign * o.pp[i];
}

PlaneFit fit_plane(const Scatter& sums, Vec3d towards) {
    PlaneFit fit;
    fit.centroid = sums.centroid();
    const double inverse = 1 / sums.n;
    double a[3][3], v[3][3];
    int at = 0;
    for (int r = 0; r < 3; ++r)
        for (int c = r; c < 3; ++c)
            a[r][c] = a[c][r] = sums.pp[at++] * inverse - fit.centroid[r] * fit.centroid[c];
    diagonalise(a, v, 12);
    int order[3] = {0, 1, 2};
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2 - i; ++j)
            if (a[order[j + 1]][order[j + 1]] < a[order[j]][order[j]]) std::swap(order[j], order[j + 1]);
    for (int i = 0; i < 3; ++i) {
        fit.axis[i] = {v[order[i]][0], v[order[i]][1], v[order[i]][2]};
        fit.variance[i] = a[order[i]][order[i]] > 0 ? a[order[i]][order[i]] : 0;
    }
    if (dot(fit.axis[0], towards) < 0) fit.axis[0] = -fit.axis[0];
    fit.normal = normalised(fit.axis[0]);
    fit.offset = -dot(fit.normal, fit.centroid);
    return fit;
}

}  // namespace burin
