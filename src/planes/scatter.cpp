// SPDX-License-Identifier: MIT
#include "planes/scatter.h"

#include <cmath>
#include <utility>

namespace burin {

void Scatter::add(const Scatter& o, double sign) {
    n += sign * o.n;
    p = p + o.p * sign;
    for (int i = 0; i < 6; ++i) pp[i] += sign * o.pp[i];
}

namespace {

// Cyclic Jacobi (Golub & Van Loan 8.5) on a symmetric 3x3 matrix: a becomes diagonal, v the eigenvectors in
// its columns. By sqrt alone, so that every machine gets the same bits.
void diagonalise(double a[3][3], double v[3][3]) {
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) v[r][c] = r == c;
    constexpr int kSweeps = 12;  // converges quadratically: five are enough for 53 bits
    for (int sweep = 0; sweep < kSweeps; ++sweep)
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                if (a[p][q] == 0) continue;
                const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                const double t = (theta >= 0 ? 1 : -1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
                if (!(std::fabs(t) > 0)) continue;  // theta overflowed: nothing to turn
                const double c = 1 / std::sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 3; ++k) {
                    const double kp = a[k][p], kq = a[k][q];
                    a[k][p] = c * kp - s * kq;
                    a[k][q] = s * kp + c * kq;
                }
                for (int k = 0; k < 3; ++k) {
                    const double pk = a[p][k], qk = a[q][k];
                    a[p][k] = c * pk - s * qk;
                    a[q][k] = s * pk + c * qk;
                    const double kp = v[k][p], kq = v[k][q];
                    v[k][p] = c * kp - s * kq;
                    v[k][q] = s * kp + c * kq;
                }
            }
}

}  // namespace

PlaneFit fit_plane(const Scatter& sums, Vec3d towards) {
    PlaneFit fit;
    fit.centroid = sums.centroid();
    const double inverse = 1 / sums.n;
    double a[3][3], v[3][3];
    int at = 0;
    for (int r = 0; r < 3; ++r)
        for (int c = r; c < 3; ++c)
            a[r][c] = a[c][r] = sums.pp[at++] * inverse - fit.centroid[r] * fit.centroid[c];
    diagonalise(a, v);
    int order[3] = {0, 1, 2};
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2 - i; ++j)
            if (a[order[j + 1]][order[j + 1]] < a[order[j]][order[j]]) std::swap(order[j], order[j + 1]);
    for (int i = 0; i < 3; ++i) {
        fit.axis[i] = {v[0][order[i]], v[1][order[i]], v[2][order[i]]};
        fit.variance[i] = a[order[i]][order[i]] > 0 ? a[order[i]][order[i]] : 0;
    }
    if (dot(fit.axis[0], towards) < 0) fit.axis[0] = -fit.axis[0];
    fit.normal = normalised(fit.axis[0]);
    fit.offset = -dot(fit.normal, fit.centroid);
    return fit;
}

}  // namespace burin
