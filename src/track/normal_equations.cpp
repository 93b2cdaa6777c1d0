// SPDX-License-Identifier: MIT
#include "track/normal_equations.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/jacobi.h"

namespace burin {
namespace {

double lane_sum(const float (&lanes)[simd::kTrackLanes]) {
    double sum = 0;
    for (const float lane : lanes) sum += static_cast<double>(lane);
    return sum;
}

}  // namespace

void NormalEquations::add(const simd::TrackSums& sums) {
    int term = simd::kTrackA;
    for (int r = 0; r < 6; ++r) {
        for (int c = r; c < 6; ++c) A[r][c] += lane_sum(sums[term++]);
        b[r] += lane_sum(sums[simd::kTrackB + r]);
    }
    cost += lane_sum(sums[simd::kTrackCost]);
    points += lane_sum(sums[simd::kTrackPoints]);
    inliers += lane_sum(sums[simd::kTrackInliers]);
}

void NormalEquations::finish(double inverse_scale) {
    for (int r = 0; r < 6; ++r) {
        for (int c = r; c < 6; ++c) A[r][c] *= inverse_scale * inverse_scale;
        for (int c = 0; c < r; ++c) A[r][c] = A[c][r];
        b[r] *= inverse_scale;
    }
}

void NormalEquations::scale_by(double weight) {
    for (int r = 0; r < 6; ++r) {
        for (int c = 0; c < 6; ++c) A[r][c] *= weight;
        b[r] *= weight;
    }
    cost *= weight;
    points *= weight;
    inliers *= weight;
}

NormalEquations& NormalEquations::operator+=(const NormalEquations& other) {
    for (int r = 0; r < 6; ++r) {
        for (int c = 0; c < 6; ++c) A[r][c] += other.A[r][c];
        b[r] += other.b[r];
    }
    cost += other.cost;
    points += other.points;
    inliers += other.inliers;
    return *this;
}

void NormalEquations::add_prior(const Twist& to, double sigma_m, double sigma_rad) {
    const auto pull = [&](int i, double target, double sigma) {
        if (!(sigma > 0)) return;
        const double information = 1 / (sigma * sigma);
        A[i][i] += information;
        b[i] -= information * target;
        cost += 0.5 * information * target * target;
    };
    for (int i = 0; i < 3; ++i) {
        pull(i, to.v[i], sigma_m);
        pull(3 + i, to.w[i], sigma_rad);
    }
}

bool NormalEquations::solve(double damping, Twist* xi) const {
    double L[6][6] = {}, d[6], y[6];
    for (int r = 0; r < 6; ++r) {
        for (int c = 0; c <= r; ++c) {
            double sum = A[r][c] + (r == c ? damping * A[r][r] : 0);
            for (int k = 0; k < c; ++k) sum -= L[r][k] * L[c][k] * d[k];
            if (r == c) {
                // A pivot this small beside its own diagonal is rounding: the unknowns before it explain all.
                if (!(sum > 1e-12 * A[r][r]) || !(sum > 0)) return false;
                d[r] = sum;
                L[r][r] = 1;
            } else {
                L[r][c] = sum / d[c];
            }
        }
    }
    for (int r = 0; r < 6; ++r) {
        y[r] = -b[r];
        for (int k = 0; k < r; ++k) y[r] -= L[r][k] * y[k];
    }
    double x[6];
    for (int r = 5; r >= 0; --r) {
        x[r] = y[r] / d[r];
        for (int k = r + 1; k < 6; ++k) x[r] -= L[k][r] * x[k];
    }
    for (int i = 0; i < 6; ++i)
        if (!std::isfinite(x[i])) return false;
    *xi = {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
    return true;
}

Spectrum spectrum_of(const NormalEquations& system, double reach_m) {
    double M[6][6], V[6][6];
    for (int r = 0; r < 6; ++r)
        for (int c = 0; c < 6; ++c)
            M[r][c] = system.A[r][c] / ((r < 3 ? 1 : reach_m) * (c < 3 ? 1 : reach_m));
    diagonalise(M, V, 8);
    int order[6] = {0, 1, 2, 3, 4, 5};
    for (int i = 0; i < 6; ++i)  // insertion: NaN may be among them
        for (int k = i; k > 0 && M[order[k]][order[k]] < M[order[k - 1]][order[k - 1]]; --k)
            std::swap(order[k], order[k - 1]);
    Spectrum out;
    for (int i = 0; i < 6; ++i) {
        out.values[i] = M[order[i]][order[i]];
        std::copy_n(V[order[i]], 6, out.vectors[i]);
    }
    return out;
}

}  // namespace burin
