// SPDX-License-Identifier: MIT
// What every tracker ends in: motions and poses, the 6x6 system and what it tells of itself, robust scale.
// Against Eigen, where there is something to be held against.
#include <Eigen/Dense>

#include "track/residuals.h"
#include "track_helpers.h"

namespace burin {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
const double kNan = static_cast<double>(NAN);

Matrix6 random_orthogonal(Rng& rng) {
    Matrix6 m;
    for (int i = 0; i < 36; ++i) m(i) = rng.normal();
    return Matrix6(Eigen::HouseholderQR<Matrix6>(m).householderQ());
}
Matrix6 with_values(Rng& rng, const Vector6& values) {
    const Matrix6 Q = random_orthogonal(rng);
    return Q * values.asDiagonal() * Q.transpose();
}
NormalEquations system_of(const Matrix6& A, const Vector6& b = Vector6::Zero()) {
    NormalEquations out;
    for (int r = 0; r < 6; ++r) {
        for (int c = 0; c < 6; ++c) out.A[r][c] = 0.5 * (A(r, c) + A(c, r));
        out.b[r] = b(r);
    }
    return out;
}
Vector6 vector_of(const Twist& xi) {
    return (Vector6() << xi.v[0], xi.v[1], xi.v[2], xi.w[0], xi.w[1], xi.w[2]).finished();
}
Vector6 random_vector(Rng& rng) {
    Vector6 v;
    for (int i = 0; i < 6; ++i) v(i) = rng.normal();
    return v;
}
Vector6 random_values(Rng& rng, double spread) {
    Vector6 v;
    for (int i = 0; i < 6; ++i) v(i) = std::pow(10, rng.uniform(0, spread));
    return v;
}

TEST(TrackSolver, AMotionLeadsFromOnePoseToTheOther) {
    Rng rng(1);
    for (int i = 0; i < 1000; ++i) {
        const Se3 a = random_pose(rng, 5), b = random_pose(rng, 5);
        const Se3 there = moved(a, motion_between(a, b));
        ASSERT_LT(away_m(there, b), 1e-12);
        for (int k = 0; k < 9; ++k) ASSERT_NEAR(there.R.m[k], b.R.m[k], 1e-9);
        Twist xi;
        for (int k = 0; k < 3; ++k) {
            xi.v[k] = rng.uniform(-1, 1);
            xi.w[k] = rng.uniform(-1, 1);
        }
        ASSERT_LT((vector_of(motion_between(a, moved(a, xi))) - vector_of(xi)).norm(), 1e-12);
    }
    const Twist none = motion_between(random_pose(rng, 5), random_pose(rng, 5));
    EXPECT_GT(vector_of(none).norm(), 0);
    const Se3 T = random_pose(rng, 5);
    EXPECT_LT(vector_of(motion_between(T, T)).norm(), 1e-15);
    EXPECT_LT(away_m(moved(T, {}), T), 1e-15);
}

TEST(TrackSolver, SmallMotionsAreTheExponential) {
    Rng rng(2);
    for (const double size : {1e-3, 1e-2, 0.1}) {
        const Se3 T = random_pose(rng, 1);
        const Twist xi{{0, 0, 0}, {size * 0.6, -size * 0.64, size * 0.48}};
        const Mat3d R = T.R * rotation_from_vector({xi.w[0], xi.w[1], xi.w[2]});
        const Mat3d got = moved(T, xi).R;
        for (int k = 0; k < 9; ++k) EXPECT_NEAR(got.m[k], R.m[k], size * size * size / 12 + 1e-15);
        // In the body's own axes: forward is along its own z.
        const Se3 forward = moved(T, {{0, 0, size}, {0, 0, 0}});
        EXPECT_LT(norm(forward.t - (T.t + T.R.column(2) * size)), 1e-15);
    }
    Se3 spun;  // stays a rotation however often it is turned
    for (int i = 0; i < 10000; ++i) spun = moved(spun, {{0, 0, 0}, {0.1, 0.2, -0.3}});
    EXPECT_NEAR(spun.R.determinant(), 1, 1e-12);
    EXPECT_NEAR(dot(spun.R.column(0), spun.R.column(1)), 0, 1e-12);
}

TEST(TrackSolver, SolvesWhatEigenSolves) {
    Rng rng(3);
    for (int i = 0; i < 500; ++i) {
        const Matrix6 A = with_values(rng, random_values(rng, i % 9));
        const Vector6 b = random_vector(rng);
        Twist xi;
        for (const double damping : {0.0, 1e-4, 0.5}) {
            ASSERT_TRUE(system_of(A, b).solve(damping, &xi)) << i;
            Matrix6 damped = A;
            damped.diagonal() *= 1 + damping;
            const Vector6 wanted = -damped.ldlt().solve(b);
            // Both are off by rounding times the condition.
            ASSERT_LT((vector_of(xi) - wanted).norm(), 1e-13 * std::pow(10, i % 9) * (1 + wanted.norm()));
        }
    }
}

TEST(TrackSolver, RefusesWhatHasNoSolution) {
    Rng rng(4);
    const Vector6 b = random_vector(rng);
    Twist xi{{7, 7, 7}, {7, 7, 7}};
    EXPECT_FALSE(NormalEquations().solve(0, &xi));
    EXPECT_FALSE(NormalEquations().solve(1, &xi));
    for (int zeros = 1; zeros <= 6; ++zeros) {
        NormalEquations free = system_of(Matrix6::Identity(), b);
        for (int k = 0; k < zeros; ++k) free.A[5 - k][5 - k] = 0;
        EXPECT_FALSE(free.solve(0, &xi)) << zeros;
    }
    // Two unknowns that only their sum is known of.
    NormalEquations tied = system_of(Matrix6::Identity(), b);
    tied.A[1][4] = tied.A[4][1] = 1;
    EXPECT_FALSE(tied.solve(0, &xi));
    EXPECT_TRUE(tied.solve(1e-4, &xi)) << "damping holds it";
    xi = {{7, 7, 7}, {7, 7, 7}};
    NormalEquations negative = system_of(-Matrix6::Identity(), b);
    EXPECT_FALSE(negative.solve(0, &xi));
    for (int r = 0; r < 6; ++r)
        for (const double bad : {kNan, static_cast<double>(INFINITY)}) {
            for (int c = 0; c < 6; ++c) {
                NormalEquations s = system_of(Matrix6::Identity(), b);
                s.A[r][c] = s.A[c][r] = bad;
                EXPECT_FALSE(s.solve(1e-4, &xi)) << r << ' ' << c << ' ' << bad;
            }
            NormalEquations s = system_of(Matrix6::Identity(), b);
            s.b[r] = bad;
            EXPECT_FALSE(s.solve(1e-4, &xi)) << r << ' ' << bad;
        }
    EXPECT_EQ(xi.v[0], 7) << "left alone";
}

TEST(TrackSolver, APriorPullsByItsInformation) {
    Rng rng(5);
    const Twist to{{0.01, -0.02, 0.03}, {0.1, -0.2, 0.3}};
    NormalEquations alone;
    alone.add_prior(to, 0.5, 0.25);
    Twist xi;
    ASSERT_TRUE(alone.solve(0, &xi));
    EXPECT_LT((vector_of(xi) - vector_of(to)).norm(), 1e-15);
    EXPECT_NEAR(alone.cost, 0.5 * (14e-4 / 0.25 + 14e-2 / 0.0625), 1e-12);
    EXPECT_EQ(alone.points, 0);
    NormalEquations rotation;  // of rotation alone: translation stays free
    rotation.add_prior(to, 0, 0.25);
    EXPECT_FALSE(rotation.solve(0, &xi));
    EXPECT_EQ(rotation.A[0][0], 0);
    EXPECT_EQ(rotation.A[5][5], 16);
    NormalEquations none;
    none.add_prior(to, static_cast<double>(INFINITY), kNan);
    EXPECT_EQ(none.A[0][0], 0);
    EXPECT_EQ(none.A[3][3], 0);
    EXPECT_EQ(none.cost, 0);
    // A measurement of the same information: half way.
    NormalEquations half = system_of(4 * Matrix6::Identity());
    half.add_prior(to, 0.5, 0.5);
    ASSERT_TRUE(half.solve(0, &xi));
    EXPECT_LT((2 * vector_of(xi) - vector_of(to)).norm(), 1e-15);
}

TEST(TrackSolver, SumsOfItemsAreTheUpperTriangle) {
    simd::TrackSums sums;
    for (int term = 0; term < simd::kTrackTerms; ++term)
        for (int lane = 0; lane < simd::kTrackLanes; ++lane)
            sums[term][lane] = static_cast<float>(term + 1) / simd::kTrackLanes;
    NormalEquations s;
    s.add(sums);
    s.add(sums);
    s.finish(0.5);
    int term = 0;
    for (int r = 0; r < 6; ++r) {
        for (int c = r; c < 6; ++c, ++term) {
            EXPECT_EQ(s.A[r][c], 2 * 0.25 * (term + 1));
            EXPECT_EQ(s.A[c][r], s.A[r][c]);
        }
        EXPECT_EQ(s.b[r], 2 * 0.5 * (simd::kTrackB + r + 1));
    }
    EXPECT_EQ(s.cost, 2 * (simd::kTrackCost + 1));
    EXPECT_EQ(s.points, 2 * (simd::kTrackPoints + 1));
    EXPECT_EQ(s.inliers, 2 * (simd::kTrackInliers + 1));
    NormalEquations doubled = s, tripled = s;
    doubled += s;
    tripled.scale_by(2);
    EXPECT_EQ(std::memcmp(&doubled, &tripled, sizeof doubled), 0);
}

void expect_spectrum(const Matrix6& A, double reach_m) {
    const NormalEquations system = system_of(A);
    Vector6 scale;
    scale << 1, 1, 1, 1 / reach_m, 1 / reach_m, 1 / reach_m;
    Matrix6 M = 0.5 * (A + A.transpose());
    M = scale.asDiagonal() * M * scale.asDiagonal();
    const Spectrum got = spectrum_of(system, reach_m);
    const Eigen::SelfAdjointEigenSolver<Matrix6> wanted(M);
    const double size = 1e-13 * M.norm();
    for (int i = 0; i < 6; ++i) {
        ASSERT_NEAR(got.values[i], wanted.eigenvalues()(i), size);
        const Eigen::Map<const Vector6> v(got.vectors[i]);
        ASSERT_LE((M * v - got.values[i] * v).norm(), size);
        for (int k = 0; k < 6; ++k)
            ASSERT_NEAR(v.dot(Eigen::Map<const Vector6>(got.vectors[k])), i == k, 1e-13);
    }
}

TEST(TrackSolver, TheSpectrumIsEigens) {
    Rng rng(6);
    for (int i = 0; i < 200; ++i) expect_spectrum(with_values(rng, random_values(rng, i % 12)), 0.5 + i % 4);
    for (int rank = 0; rank < 6; ++rank) {  // degenerate, and equal values
        Vector6 values = Vector6::Zero();
        values.head(rank).setConstant(1e6);
        for (int i = 0; i < 20; ++i) expect_spectrum(with_values(rng, values), 2);
    }
    expect_spectrum(Matrix6::Zero(), 1);
    expect_spectrum(Matrix6::Identity(), 1);
    expect_spectrum(Matrix6::Ones(), 1);
    expect_spectrum(with_values(rng, (Vector6() << -3, -1, 0, 1e-9, 1, 1e9).finished()), 3);
    // A plane seen square on: no hold sideways and about its normal.
    Matrix6 plane = Matrix6::Zero();
    for (int y = -5; y <= 5; ++y)
        for (int x = -5; x <= 5; ++x) {
            const Vector6 J = (Vector6() << 0, 0, 1, 0.1 * y, -0.1 * x, 0).finished();
            plane += J * J.transpose();
        }
    expect_spectrum(plane, 2);
    const Spectrum s = spectrum_of(system_of(plane), 2);
    EXPECT_LT(s.values[2], 1e-9);
    EXPECT_GT(s.values[3], 1);
}

TEST(TrackSolver, MedianOfBins) {
    ResidualBins bins;
    bins.clear();
    EXPECT_EQ(bins.median(), 0);
    bins.add(-1);  // a point that does not count
    bins.add(static_cast<float>(NAN));
    EXPECT_EQ(bins.median(), 0);
    Rng rng(7);
    std::vector<double> all;
    ResidualBins other;
    other.clear();
    for (int i = 0; i < 4001; ++i) {
        const double u = std::fabs(rng.normal());
        all.push_back(u);
        (i % 2 ? bins : other).add(static_cast<float>(u));
    }
    bins.add(other);
    std::nth_element(all.begin(), all.begin() + 2000, all.end());
    EXPECT_NEAR(bins.median(), all[2000], 0.01) << "bins are 1/16 wide, and it is interpolated";
    bins.clear();
    for (const float u : {1e30f, 20.0f, static_cast<float>(INFINITY)}) bins.add(u);
    EXPECT_GE(bins.median(), 15.9);
    EXPECT_LE(bins.median(), 16);
    bins.clear();
    bins.add(2.0f);
    EXPECT_NEAR(bins.median(), 2, 1.0 / 16);
}

TEST(TrackSolver, TheScaleStaysWithinReason) {
    EXPECT_EQ(scale_of(0), 0.05);
    EXPECT_EQ(scale_of(1e-9), 0.05);
    EXPECT_DOUBLE_EQ(scale_of(0.6745), 1.4826 * 0.6745);  // of a standard normal distribution: 1
    EXPECT_EQ(scale_of(100), 1.5);
    Measured nothing;
    EXPECT_EQ(cost_at(nothing), kMissCost);
    nothing.considered = 100;
    EXPECT_EQ(cost_at(nothing), kMissCost);
    nothing.system.points = 100;
    nothing.system.cost = 20;
    EXPECT_DOUBLE_EQ(cost_at(nothing), 0.2);
    EXPECT_NEAR(kMissCost, 1.345 * (2 - 1.345 / 2), 1e-4) << "Huber's cost of two deviations";
}

}  // namespace
}  // namespace burin
