// SPDX-License-Identifier: MIT
// Where the camera should be in the next frame: constant velocity, and the gyroscope where there is one. The
// gyroscope's bias and the direction of gravity are learnt on the way from the tracked poses.
//
// For each frame: predict() once with the frame's samples, track, and when that went well observe(). A frame
// that was not tracked is simply not observed; its samples are remembered. Under 3 KiB, no allocation, no
// libm but sqrt.
#pragma once

#include <cstdint>

#include "core/imu.h"
#include "core/se3.h"
#include "track/gravity_filter.h"
#include "track/imu_integral.h"

namespace burin {

struct Prediction {         // poses are T_world_camera
    Se3 constant_velocity;  // the last motion once more, scaled to the time that passed
    Se3 still;              // the last pose
    bool has_gyro = false;
    Se3 gyro;  // rotation by the gyroscope, translation by constant velocity
    const Se3& best() const { return has_gyro ? gyro : constant_velocity; }
    // Standard deviations, per axis, of the best prediction (gyro, else constant velocity): rotation about
    // the camera's own axes, and position. Infinite before the first pose: a weight of 0.
    double rotation_sigma_rad = 0, translation_sigma_m = 0;
};

class MotionPrior {
  public:
    explicit MotionPrior(const ImuNoise& noise = {}) : noise_(noise) { clear(); }

    // Everything: a new recording.
    void clear();
    // What was learnt of the IMU and of gravity stays, the motion does not: after the camera was lost, before
    // the pose it was found at again is observed.
    void forget_motion();

    // The pose of a tracked frame. The stamp of the last one again corrects that pose; an earlier stamp
    // begins a new motion. A pose that is not finite is passed over.
    void observe(std::int64_t t_ns, const Se3& T_world_camera);

    // For the frame at t_ns; samples as Frame::imu has them, none without an IMU. Asking again for the same
    // stamp gives the same answer.
    Prediction predict(std::int64_t t_ns, const ImuSample* imu, int count, const Se3& T_camera_imu);

    // To be subtracted from readings; sigma per axis. False before a frame with samples was observed.
    bool gyro_bias(Vec3d* bias_rad_s, double* sigma_rad_s) const;
    // Unit vector against gravity in the world's axes. False while too little is known (a second of tracked
    // frames with samples). sigma: standard deviation of the direction about either horizontal axis.
    bool gravity(Vec3d* up_world, double* sigma_rad) const { return gravity_.up(up_world, sigma_rad); }

  private:
    struct Pose {
        std::int64_t t_ns = 0;
        Se3 T_world_camera;
    };
    struct Motion {
        double span_s = 0;  // between the two poses; 0: there are no two
        double scale = 0;   // of the last motion
    };
    Motion motion_to(double gap_s) const;
    // How far constant velocity goes astray for one m/s^2 or rad/s^2 of acceleration.
    static double reach(double gap_s, double span_s) { return 0.5 * gap_s * (gap_s + span_s); }
    void learn_bias(double gap_s, const Mat3d& R_last_now_imu);
    void forget_pose_error();
    void learn_spread(std::int64_t t_ns, const Se3& T_world_camera);

    ImuNoise noise_;
    bool has_last_ = false, has_previous_ = false;
    Pose last_, previous_;
    ImuIntegral integral_;
    Se3 T_camera_imu_;
    GravityFilter gravity_;
    struct Bias {  // of the gyroscope, see learn_bias
        bool known = false;
        Vec3d rad_s, error_rad;
        double P_bb = 0, P_be = 0, P_ee = 0;
    } bias_;
    // What the last prediction said, to learn from how far it was off.
    bool has_predicted_ = false;
    std::int64_t predicted_ns_ = 0;
    Prediction predicted_;
    // Per axis: acceleration, angular acceleration, error of a rotation by gyroscope between two poses.
    double accel_variance_ = 0, angular_variance_ = 0, gyro_variance_ = 0;
};

}  // namespace burin
