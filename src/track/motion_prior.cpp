// SPDX-License-Identifier: MIT
#include "track/motion_prior.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/time.h"

namespace burin {
namespace {

// Least standard deviations an axis of what a hand does to a camera, m/s^2 and rad/s^2. Measured from frame
// to frame: 0.5 to 3.0 and 1.3 to 1.8 on the four ICL living-room tracks, 0.4 to 0.5 and 3.3 to 3.7 on TUM's
// fr1_xyz and fr3_structure_notexture_far, with the noise of the motion capture in it.
constexpr double kLeastAccel = 0.5, kLeastAngularAccel = 1.5;
// Measured spreads are believed up to this many times the least: beyond, a pose was wrong.
constexpr double kMostTimesLeast = 20;
// Frames over which a spread is averaged: one second at 30 Hz.
constexpr double kSpreadFrames = 30;
// Speed of a hand-held camera before any is known, per axis: walking pace and a brisk turn.
constexpr double kSpeed_m_s = 0.5, kTurn_rad_s = 1.0;
// Noise of a tracked pose per axis against its neighbour: a millimetre or two and 0.06 degrees
// (../shared/notes/tracking.md: 2.9 mm and 0.065 degrees, most of it drift that neighbours share).
constexpr double kPositionNoiseM = 0.001, kRotationNoiseRad = 0.001;
// A motion measured over more than this is an average over turns and stops.
constexpr double kMaxSpanS = 0.3;
// No velocity lasts longer: the slowest strong component of a hand's motion is at about 0.4 Hz, and an
// eighth of its period is where the velocity has changed by 30 %.
constexpr double kMaxAheadS = 0.3;
// Gyroscope readings of this many sigmas off teach nothing: the tracker jumped.
constexpr double kBiasGate = 4;
// The bias follows the temperature: 0.015 degrees/s a kelvin (BMI088) and a few kelvin in the first minutes.
constexpr double kBiasWarmUp_rad_s2_sqrt_hz = 1e-4;

double square(double v) { return v * v; }
bool finite(const Se3& T) {
    double sum = T.t.x + T.t.y + T.t.z;
    for (const double m : T.R.m) sum += m;
    return std::isfinite(sum);
}
// The average of the last kSpreadFrames, held between the least and the most.
void average(double* variance, double reading, double least_sigma) {
    const double least = square(least_sigma), most = least * square(kMostTimesLeast);
    *variance += (std::clamp(reading, least, most) - *variance) * (1 / kSpreadFrames);
}

}  // namespace

void MotionPrior::clear() {
    has_last_ = has_previous_ = has_predicted_ = false;
    integral_.clear();
    gravity_.clear();
    bias_ = {};
    bias_.P_bb = square(noise_.gyro_bias_rad_s);
    accel_variance_ = square(kLeastAccel);
    angular_variance_ = square(kLeastAngularAccel);
    gyro_variance_ = square(kRotationNoiseRad);
    forget_pose_error();
}

void MotionPrior::forget_motion() {
    has_last_ = has_previous_ = has_predicted_ = false;
    gravity_.break_chain();
    forget_pose_error();
}

MotionPrior::Motion MotionPrior::motion_to(double gap_s) const {
    if (!has_previous_) return {};
    const double span = seconds_between(previous_.t_ns, last_.t_ns);
    return {span, std::min(gap_s, kMaxAheadS) / span};
}

Prediction MotionPrior::predict(std::int64_t t_ns, const ImuSample* imu, int count, const Se3& T_camera_imu) {
    integral_.add_until(t_ns, imu, count);
    T_camera_imu_ = T_camera_imu;
    Prediction out;
    has_predicted_ = has_last_;
    if (!has_last_) {
        out.rotation_sigma_rad = out.translation_sigma_m = std::numeric_limits<double>::infinity();
        return out;
    }
    const Se3& T = last_.T_world_camera;
    out.still = out.constant_velocity = T;
    const double gap = std::max(seconds_between(last_.t_ns, t_ns), 0.0);
    const Motion motion = motion_to(gap);
    double rotation2 = square(kRotationNoiseRad), position2 = square(kPositionNoiseM);
    if (motion.span_s > 0) {
        const Se3& P = previous_.T_world_camera;
        const Mat3d R_previous_last = P.R.transposed() * T.R;
        const Mat3d R = rotation_from_vector(rotation_vector(R_previous_last) * motion.scale);
        out.constant_velocity = normalised(Se3{T.R * R, T.t + (T.t - P.t) * motion.scale});
        // Accelerations as they were seen, with the noise of the poses in them, then any speed; no better
        // than the noise of two poses stretched along.
        const double noise = 1 + 2 * motion.scale * (1 + motion.scale);
        const double f = reach(std::min(gap, kMaxAheadS), motion.span_s);
        const double beyond = std::max(gap - kMaxAheadS, 0.0);
        rotation2 =
            std::max(rotation2 * noise, square(std::sqrt(angular_variance_) * f + kTurn_rad_s * beyond));
        position2 = std::max(position2 * noise, square(std::sqrt(accel_variance_) * f + kSpeed_m_s * beyond));
    } else {
        rotation2 += square(kTurn_rad_s * gap);
        position2 += square(kSpeed_m_s * gap);
    }
    out.gyro = out.constant_velocity;
    if (gap > 0 && integral_.covers(last_.t_ns, t_ns)) {
        const Mat3d& R_ci = T_camera_imu.R;
        out.has_gyro = true;
        out.gyro.R = normalised(Se3{T.R * (R_ci * rotation_of(integral_.turn()) * R_ci.transposed()), {}}).R;
        rotation2 = gyro_variance_ + bias_.P_bb * square(gap) + square(noise_.gyro_rad_s_sqrt_hz) * gap;
    }
    out.rotation_sigma_rad = std::sqrt(rotation2);
    out.translation_sigma_m = std::sqrt(position2);
    predicted_ns_ = t_ns;
    predicted_ = out;
    return out;
}

void MotionPrior::observe(std::int64_t t_ns, const Se3& T_world_camera) {
    if (!finite(T_world_camera)) return;
    const Pose now{t_ns, normalised(T_world_camera)};
    if (has_last_ && t_ns == last_.t_ns) {
        last_ = now;
        return;
    }
    if (has_last_ && t_ns < last_.t_ns) forget_motion();
    if (has_last_) {
        learn_spread(t_ns, now.T_world_camera);
        const double gap = seconds_between(last_.t_ns, t_ns);
        if (integral_.covers(last_.t_ns, t_ns)) {
            const Se3 T_world_imu0 = last_.T_world_camera * T_camera_imu_;
            const Se3 T_world_imu1 = now.T_world_camera * T_camera_imu_;
            gravity_.add(last_.t_ns, T_world_imu0, t_ns, T_world_imu1, integral_, noise_);
            learn_bias(gap, T_world_imu0.R.transposed() * T_world_imu1.R);
        } else {
            gravity_.break_chain();
            forget_pose_error();
        }
        previous_ = last_;
        has_previous_ = gap <= kMaxSpanS;
    }
    last_ = now;
    has_last_ = true;
    integral_.begin(t_ns, bias_.rad_s);
}

// A Kalman filter of (bias b, error e of the last pose about that axis), the same for three axes: the
// readings turn too far by b gap + e_last - e_now + noise. Without e in the state, what one frame lends the
// next would pass for independent noise, and the filter would learn 30 times slower. The IMU turns so little
// between two frames that the axes at either end are the same for this.
void MotionPrior::learn_bias(double gap_s, const Mat3d& R_last_now_imu) {
    if (!(gap_s <= kMaxSpanS)) return forget_pose_error();
    Bias& k = bias_;
    const double pose = std::max(square(kRotationNoiseRad), gyro_variance_ / 2);
    k.P_bb += (square(kBiasWarmUp_rad_s2_sqrt_hz) + square(noise_.gyro_walk_rad_s2_sqrt_hz)) * gap_s;
    const Vec3d off =
        rotation_vector(R_last_now_imu.transposed() * rotation_of(integral_.turn())) - k.error_rad;
    const double S = square(gap_s) * k.P_bb + 2 * gap_s * k.P_be + k.P_ee + pose +
                     square(noise_.gyro_rad_s_sqrt_hz) * gap_s;
    if (dot(off, off) > 3 * square(kBiasGate) * S) return forget_pose_error();
    const double gain = (gap_s * k.P_bb + k.P_be) / S;
    k.rad_s = k.rad_s + off * gain;
    k.error_rad = off * (-pose / S);
    k.P_bb -= square(gain) * S;
    k.P_be = gain * pose;
    k.P_ee = pose - square(pose) / S;
    k.known = true;
}

void MotionPrior::forget_pose_error() {
    bias_.error_rad = {};
    bias_.P_be = 0;
    bias_.P_ee = std::max(square(kRotationNoiseRad), gyro_variance_ / 2);
}

void MotionPrior::learn_spread(std::int64_t t_ns, const Se3& T_world_camera) {
    if (!has_predicted_ || predicted_ns_ != t_ns) return;
    const double gap = seconds_between(last_.t_ns, t_ns);
    const Motion motion = motion_to(gap);
    if (predicted_.has_gyro) {
        const Vec3d off = rotation_vector(predicted_.gyro.R.transposed() * T_world_camera.R);
        average(&gyro_variance_, dot(off, off) / 3, kRotationNoiseRad);
    }
    if (!(motion.span_s > 0) || gap > kMaxAheadS) return;
    const double f = square(reach(gap, motion.span_s));
    const Vec3d turn = rotation_vector(predicted_.constant_velocity.R.transposed() * T_world_camera.R);
    const Vec3d shift = T_world_camera.t - predicted_.constant_velocity.t;
    average(&angular_variance_, dot(turn, turn) / (3 * f), kLeastAngularAccel);
    average(&accel_variance_, dot(shift, shift) / (3 * f), kLeastAccel);
}

bool MotionPrior::gyro_bias(Vec3d* bias_rad_s, double* sigma_rad_s) const {
    if (!bias_.known) return false;
    *bias_rad_s = bias_.rad_s;
    *sigma_rad_s = std::sqrt(bias_.P_bb);
    return true;
}

}  // namespace burin
