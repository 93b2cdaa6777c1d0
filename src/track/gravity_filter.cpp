// SPDX-License-Identifier: MIT
#include "track/gravity_filter.h"

#include <algorithm>
#include <cmath>

#include "core/time.h"

namespace burin {
namespace {

// Length of an arm. Poses are noisy and the second difference of positions divides by it: at 0.2 s a
// millimetre tilts one triple by 0.4 degrees, at one frame by 13.
constexpr double kArmS = 0.2;
// Noise of tracked poses: some millimetres and tenths of a degree at most (../shared/notes/tracking.md: 2.9
// mm and 0.065 degrees on one sequence, 6.6 mm and 0.44 degrees on another, of which most is the truth's).
constexpr double kPositionNoiseM = 0.002, kRotationNoiseRad = 0.002;
// Drift of the tracker's own orientation and of the bias with temperature are felt after minutes.
constexpr double kForgetS = 60;
// Fewer triples than in a second say little, and one bad among them much.
constexpr double kLeastKnownS = 1;
// Gravity itself varies by 0.3 %, a scale error of the accelerometer by 1 %; a tenth off is no gravity.
constexpr double kLengthTolerance = 0.1;
// Residuals beyond three sigma (a jump of the tracker, a knock) count as much as three sigma would.
constexpr double kHuber = 3;

void add(Mat3d* sum, const Mat3d& A, double scale) {
    for (int i = 0; i < 9; ++i) sum->m[i] += A.m[i] * scale;
}

Mat3d minus(const Mat3d& A, const Mat3d& B) {
    Mat3d out;
    for (int i = 0; i < 9; ++i) out.m[i] = A.m[i] - B.m[i];
    return out;
}

Mat3d inverse(const Mat3d& A) {
    const Vec3d a = A.column(0), b = A.column(1), c = A.column(2);
    const double det = A.determinant();
    const Vec3d rows[3] = {cross(b, c), cross(c, a), cross(a, b)};
    Mat3d out;
    for (int r = 0; r < 3; ++r)
        for (int k = 0; k < 3; ++k) out(r, k) = rows[r][k] / det;
    return out;
}

}  // namespace

void GravityFilter::add(std::int64_t t0_ns, const Se3& T_world_imu0, std::int64_t t1_ns,
                        const Se3& T_world_imu1, const ImuIntegral& integral, const ImuNoise& noise) {
    if (has_knot_ && end_ns_ != t0_ns) break_chain();
    constexpr Mat3d kZero{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
    if (!has_knot_) {
        knot_ns_ = t0_ns;
        knot_m_ = T_world_imu0.t;
        sum_ = {0, {}, {}, {}, kZero, kZero};
        has_knot_ = true;
    }
    const double since = seconds_between(knot_ns_, t0_ns);
    const Mat3d& R = T_world_imu0.R;
    sum_.force = sum_.force + R * integral.force();
    sum_.force_ramp = sum_.force_ramp + R * (integral.force_moment() + integral.force() * since);
    const Mat3d turns = R * integral.turns();
    burin::add(&sum_.turns, turns, 1);
    burin::add(&sum_.turns_ramp, turns, since);
    burin::add(&sum_.turns_ramp, R * integral.turns_moment(), 1);
    end_ns_ = t1_ns;
    const double span = seconds_between(knot_ns_, t1_ns);
    if (span < kArmS) return;

    Arm arm = sum_;
    arm.span_s = span;
    arm.velocity_m_s = (T_world_imu1.t - knot_m_) * (1 / span);
    arm.force_ramp = arm.force_ramp * (1 / span);
    for (double& m : arm.turns_ramp.m) m /= span;
    if (has_arm_) update(arm_, arm, noise);
    arm_ = arm;
    has_arm_ = true;
    knot_ns_ = t1_ns;
    knot_m_ = T_world_imu1.t;
    sum_ = {0, {}, {}, {}, kZero, kZero};
}

void GravityFilter::update(const Arm& rising, const Arm& falling, const ImuNoise& noise) {
    const Vec3d reading = rising.force_ramp + (falling.force - falling.force_ramp) -
                          (falling.velocity_m_s - rising.velocity_m_s);
    Mat3d B = rising.turns_ramp;
    burin::add(&B, minus(falling.turns, falling.turns_ramp), 1);
    const double h = 0.5 * (rising.span_s + falling.span_s);

    const double i0 = 1 / rising.span_s, i1 = 1 / falling.span_s;
    const double position = kPositionNoiseM * kPositionNoiseM * (i0 * i0 + (i0 + i1) * (i0 + i1) + i1 * i1);
    const double white = noise.accel_m_s2_sqrt_hz * noise.accel_m_s2_sqrt_hz * h * (2.0 / 3.0);
    const double tilt = kGravity_m_s2 * h * kRotationNoiseRad;
    const double variance = position + white + tilt * tilt;
    double w = 1 / variance;
    if (known_s_ >= kLeastKnownS) {
        const Solution now = solve();
        const Vec3d off = reading - now.up_m_s2 * h - B * now.bias_m_s2;
        const double sigmas = std::sqrt(dot(off, off) / (3 * variance));
        if (sigmas > kHuber) w *= kHuber / sigmas;
    }
    if (!std::isfinite(w) || !std::isfinite(dot(reading, reading))) return;

    accel_bias_prior_m_s2_ = noise.accel_bias_m_s2;
    const double keep = 1 / (1 + falling.span_s / kForgetS);
    const Mat3d Bt = B.transposed();
    weight_ = weight_ * keep + w * h * h;
    for (int i = 0; i < 9; ++i) C_.m[i] *= keep, D_.m[i] *= keep;
    burin::add(&C_, B, w * h);
    burin::add(&D_, Bt * B, w);
    y_up_ = y_up_ * keep + reading * (w * h);
    y_bias_ = y_bias_ * keep + (Bt * reading) * w;
    known_s_ += falling.span_s;
}

// Up eliminated first, whose block is a multiple of the identity (Schur complement).
GravityFilter::Solution GravityFilter::solve() const {
    const Mat3d Ct = C_.transposed();
    Mat3d S = D_;
    burin::add(&S, Ct * C_, -1 / weight_);
    const double prior = 1 / (accel_bias_prior_m_s2_ * accel_bias_prior_m_s2_);
    for (int i = 0; i < 3; ++i) S(i, i) += prior;
    const Mat3d inverse_S = inverse(S);
    Solution out;
    out.bias_m_s2 = inverse_S * (y_bias_ - (Ct * y_up_) * (1 / weight_));
    out.up_m_s2 = (y_up_ - C_ * out.bias_m_s2) * (1 / weight_);
    out.covariance = C_ * inverse_S * Ct;
    for (double& m : out.covariance.m) m /= weight_ * weight_;
    for (int i = 0; i < 3; ++i) out.covariance(i, i) += 1 / weight_;
    return out;
}

bool GravityFilter::up(Vec3d* up_world, double* sigma_rad) const {
    if (known_s_ < kLeastKnownS) return false;
    const Solution now = solve();
    const double length = norm(now.up_m_s2);
    if (!(std::fabs(length - kGravity_m_s2) <= kLengthTolerance * kGravity_m_s2)) return false;
    const Vec3d up = now.up_m_s2 * (1 / length);
    const Mat3d& P = now.covariance;
    const double across = P(0, 0) + P(1, 1) + P(2, 2) - dot(up, P * up);
    *up_world = up;
    *sigma_rad = std::sqrt(std::max(across, 0.0) / 2) / length;
    return true;
}

}  // namespace burin
