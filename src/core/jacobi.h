// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

namespace burin {

// Cyclic Jacobi (Golub & Van Loan 8.5) on a symmetric N x N matrix: a becomes diagonal, with the eigenvalues
// in no order, and row i of v the eigenvector of a[i][i]. Converges quadratically: six unknowns settle to
// rounding in five sweeps. By sqrt alone, so that every machine gets the same bits.
template <int N>
void diagonalise(double (&a)[N][N], double (&v)[N][N], int sweeps) {
    for (int r = 0; r < N; ++r)
        for (int c = 0; c < N; ++c) v[r][c] = r == c;
    for (int sweep = 0; sweep < sweeps; ++sweep)
        for (int p = 0; p < N - 1; ++p)
            for (int q = p + 1; q < N; ++q) {
                if (a[p][q] == 0) continue;
                const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                const double t = (theta < 0 ? -1 : 1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
                const double c = 1 / std::sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < N; ++k) {
                    const double kp = a[k][p], kq = a[k][q];
                    a[k][p] = c * kp - s * kq;
                    a[k][q] = s * kp + c * kq;
                }
                for (int k = 0; k < N; ++k) {
                    const double pk = a[p][k], qk = a[q][k];
                    a[p][k] = c * pk - s * qk;
                    a[q][k] = s * pk + c * qk;
                    const double vp = v[p][k], vq = v[q][k];
                    v[p][k] = c * vp - s * vq;
                    v[q][k] = s * vp + c * vq;
                }
            }
}

}  // namespace burin
