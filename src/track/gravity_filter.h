// SPDX-License-Identifier: MIT
// The direction of gravity in the world of the tracked poses, from the accelerometer.
//
// Between three poses of the IMU at t0, t1, t2 the velocity drops out: with h(t) the triangle that rises from
// 0 at t0 to 1 at t1 and falls to 0 at t2,
//   (p2 - p1) / (t2 - t1) - (p1 - p0) / (t1 - t0) = integral of h (R (f - b) - g up),
// f the specific force, b the accelerometer's bias in its own axes. That is exact under any acceleration, and
// linear in g up and b, which are found by least squares over all triples with forgetting. The bias tells
// itself from gravity when the camera turns; as long as it has not, its prior says how far up may be off.
#pragma once

#include <cstdint>

#include "core/imu.h"
#include "core/se3.h"
#include "track/imu_integral.h"

namespace burin {

class GravityFilter {
  public:
    void clear() { *this = {}; }
    // The next stretch does not join the last one. What was learnt stays.
    void break_chain() { has_knot_ = has_arm_ = false; }
    // The IMU's poses at both ends of an integral that covers t0_ns to t1_ns.
    void add(std::int64_t t0_ns, const Se3& T_world_imu0, std::int64_t t1_ns, const Se3& T_world_imu1,
             const ImuIntegral& integral, const ImuNoise& noise);
    // False until a second is known, and when the readings do not have the length of gravity (other units).
    // sigma: standard deviation of the direction about either horizontal axis.
    bool up(Vec3d* up_world, double* sigma_rad) const;

  private:
    struct Solution {
        Vec3d up_m_s2, bias_m_s2;
        Mat3d covariance;  // of up_m_s2
    };
    // One side of the triangle: the stretch between two knots, weighted by 1 or by the rising ramp.
    struct Arm {
        double span_s = 0;
        Vec3d velocity_m_s;
        Vec3d force, force_ramp;
        Mat3d turns, turns_ramp;
    };
    void update(const Arm& rising, const Arm& falling, const ImuNoise& noise);
    Solution solve() const;

    bool has_knot_ = false, has_arm_ = false;
    std::int64_t knot_ns_ = 0, end_ns_ = 0;
    Vec3d knot_m_;
    Arm arm_, sum_;  // the last whole one; the one under way, its ramp not yet divided by its length
    double known_s_ = 0;
    // Normal equations over (up, bias): [weight I, C; C^T, D] and the right-hand sides.
    double weight_ = 0;
    Mat3d C_{{0, 0, 0, 0, 0, 0, 0, 0, 0}}, D_{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
    Vec3d y_up_, y_bias_;
    double accel_bias_prior_m_s2_ = ImuNoise{}.accel_bias_m_s2;
};

}  // namespace burin
