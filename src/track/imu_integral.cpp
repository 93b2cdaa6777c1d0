// SPDX-License-Identifier: MIT
#include "track/imu_integral.h"

#include <algorithm>
#include <cmath>

#include "core/time.h"

namespace burin {
namespace {

// Between samples further apart than this, or this far beyond the last one, a straight line is guesswork: a
// hand trembles at up to 10 Hz, a quarter of whose period this is. IMUs of 50 Hz and more pass.
constexpr double kMaxSampleGapS = 0.025;

bool finite(Vec3d v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

ImuSample between(const ImuSample& a, const ImuSample& b, std::int64_t t_ns) {
    const double span = seconds_between(a.t_ns, b.t_ns);
    const double s = span > 0 ? seconds_between(a.t_ns, t_ns) / span : 0;
    return {t_ns, a.gyro_rad_s + (b.gyro_rad_s - a.gyro_rad_s) * s,
            a.accel_m_s2 + (b.accel_m_s2 - a.accel_m_s2) * s};
}

void add(Mat3d* sum, const Mat3d& R, double scale) {
    for (int i = 0; i < 9; ++i) sum->m[i] += R.m[i] * scale;
}

constexpr Mat3d kZero{{0, 0, 0, 0, 0, 0, 0, 0, 0}};

}  // namespace

void ImuIntegral::begin(std::int64_t t_ns, Vec3d gyro_bias_rad_s) {
    // What lies ahead of the old time may lie behind the new one.
    if (has_ahead_ && ahead_.t_ns <= t_ns) take(ahead_, t_ns);
    // A sample of a later time than this one is of another recording.
    if (has_last_ && last_.t_ns > t_ns) has_last_ = has_ahead_ = false;
    begun_ = whole_ = true;
    used_ = false;
    begin_ns_ = now_ns_ = t_ns;
    gyro_bias_ = gyro_bias_rad_s;
    turn_ = {};
    force_ = force_moment_ = {};
    turns_ = turns_moment_ = kZero;
}

// From now to until_ns along the line between the two samples. With w linear in time, the rotation over dt is
// that of the vector w_mean dt + w_a x w_b dt^2 / 12, to fourth order in dt (Magnus 1954).
void ImuIntegral::integrate(const ImuSample& a, const ImuSample& b, std::int64_t until_ns) {
    const double dt = seconds_between(now_ns_, until_ns);
    if (!(dt > 0)) return;
    const ImuSample from = between(a, b, now_ns_), to = between(a, b, until_ns);
    const Vec3d wa = from.gyro_rad_s - gyro_bias_, wb = to.gyro_rad_s - gyro_bias_;
    const Vec3d angle = (wa + wb) * (0.5 * dt) + cross(wa, wb) * (dt * dt / 12);
    const Mat3d R = rotation_of(turn_ * quaternion_from_vector(angle * 0.5));  // in the middle
    const Vec3d impulse = R * ((from.accel_m_s2 + to.accel_m_s2) * (0.5 * dt));
    const double t = seconds_between(begin_ns_, now_ns_) + 0.5 * dt;
    force_ = force_ + impulse;
    force_moment_ = force_moment_ + impulse * t;
    add(&turns_, R, dt);
    add(&turns_moment_, R, dt * t);
    turn_ = normalised(turn_ * quaternion_from_vector(angle));
    now_ns_ = until_ns;
    used_ = true;
}

// One sample in the order of time; integrates up to it, but not beyond t_ns.
void ImuIntegral::take(const ImuSample& sample, std::int64_t t_ns) {
    const std::int64_t until_ns = std::min(sample.t_ns, t_ns);
    if (begun_ && until_ns > now_ns_) {
        // With none before, the first is taken to have held since.
        const ImuSample& a = has_last_ ? last_ : sample;
        const std::int64_t known_ns = has_last_ ? last_.t_ns : now_ns_;
        if (seconds_between(known_ns, sample.t_ns) <= kMaxSampleGapS)
            integrate(a, sample, until_ns);
        else
            whole_ = false;
        now_ns_ = until_ns;
    }
    if (sample.t_ns <= t_ns) {
        last_ = sample;
        has_last_ = true;
        has_ahead_ = false;
    } else {
        ahead_ = sample;
        has_ahead_ = true;
    }
}

void ImuIntegral::add_until(std::int64_t t_ns, const ImuSample* samples, int count) {
    if (begun_ && t_ns < now_ns_) return;
    if (has_ahead_) {
        const ImuSample kept = ahead_;
        take(kept, t_ns);
    }
    for (int i = 0; i < count && !has_ahead_; ++i) {
        const ImuSample& sample = samples[i];
        if (!finite(sample.gyro_rad_s) || !finite(sample.accel_m_s2)) continue;
        if (has_last_ && sample.t_ns <= last_.t_ns) continue;
        take(sample, t_ns);
    }
    if (!begun_ || now_ns_ == t_ns) return;
    // The last one holds for a while.
    if (has_last_ && seconds_between(last_.t_ns, t_ns) <= kMaxSampleGapS)
        integrate(last_, last_, t_ns);
    else
        whole_ = false;
    now_ns_ = t_ns;
}

}  // namespace burin
