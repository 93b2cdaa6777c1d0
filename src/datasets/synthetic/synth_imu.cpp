// SPDX-License-Identifier: MIT
#include "datasets/synthetic/synth_imu.h"

#include <cmath>
#include <cstdio>

#include "core/time.h"
#include "datasets/imu_file.h"
#include "datasets/synthetic/portable_math.h"

namespace burin {
namespace {

using synthetic::hash_bits;
using synthetic::normal_pair;

constexpr int kLeastRate = 10, kMostRate = 8000;  // slower tells nothing between frames; no part is faster

constexpr double kMostSamples = 5e6;  // what imu.txt may hold: an hour at 1 kHz is 3.6 million

enum Stream : std::uint64_t { kStart = 1, kNoise };

ImuSample reading(const SmoothPath& path, const Se3& T_camera_imu, std::int64_t t_ns) {
    const SmoothPath::State s = path.at(t_ns);
    const Mat3d& R = s.T_world_camera.R;
    const Vec3d w = s.turn_rad_s, arm = T_camera_imu.t;
    const Vec3d swing = cross(s.turn_rad_s2, arm) + cross(w, cross(w, arm));
    const Vec3d force = s.acceleration_m_s2 + Vec3d{0, 0, kGravity_m_s2} + R * swing;
    const Mat3d R_imu_camera = T_camera_imu.R.transposed();
    return {t_ns, R_imu_camera * w, R_imu_camera * (R.transposed() * force)};
}

// Channel 0..2 gyro, 3..5 accelerometer.
double& channel(ImuSample* sample, int c) {
    return c < 3 ? sample->gyro_rad_s[c] : sample->accel_m_s2[c - 3];
}

std::string extrinsic_numbers() {
    const Se3 T = synth_T_camera_imu();
    const Quaternion q = quaternion_of(T.R);
    char text[200];
    std::snprintf(text, sizeof text, "%.9f %.9f %.9f %.9f %.9f %.9f %.9f", T.t.x, T.t.y, T.t.z, q.x, q.y, q.z,
                  q.w);
    return text;
}

constexpr const char* kColumns =
    "# t: seconds, on the clock of the frames. gx gy gz: angular velocity, rad/s. ax ay az: specific force,\n"
    "# m/s^2; at rest with z up it is 0 0 9.81. Axes of the IMU.\n";

}  // namespace

Se3 synth_T_camera_imu() {
    const Mat3d axes{{0, -1, 0, 0, 0, -1, 1, 0, 0}};  // columns: the IMU's axes in the camera's
    return normalised(Se3{axes * rotation_from_vector({0.02, -0.025, 0.015}), {0.031, -0.012, -0.024}});
}

Result<SynthImu> synth_imu(const Trajectory& trajectory, int rate_hz, bool noise, std::uint64_t seed) {
    if (rate_hz < kLeastRate || rate_hz > kMostRate)
        return Status::error(Code::invalid_argument, "IMU rate %d: expected %d to %d samples a second",
                             rate_hz, kLeastRate, kMostRate);
    const Result<SmoothPath> path = SmoothPath::through(trajectory);
    if (!path.ok()) return path.status();
    const Se3 T_camera_imu = synth_T_camera_imu();
    const ImuNoise figures;
    const std::uint64_t key = hash_bits(seed, 0x1A4);
    const std::int64_t begin_ns = trajectory.front().t_ns, end_ns = trajectory.back().t_ns;
    if (const double span = seconds_between(begin_ns, end_ns); span * rate_hz > kMostSamples)
        return Status::error(Code::invalid_argument, "IMU: %.0f s at %d Hz, expected at most %.0f samples",
                             span, rate_hz, kMostSamples);
    const double white = std::sqrt(static_cast<double>(rate_hz)), walk = 1 / white;
    SynthImu imu;
    ImuSample bias;
    for (int c = 0; noise && c < 6; ++c)
        channel(&bias, c) = (c < 3 ? figures.gyro_bias_rad_s : figures.accel_bias_m_s2) *
                            normal_pair(hash_bits(key, kStart, static_cast<std::uint64_t>(c))).a;
    for (std::int64_t i = 0;; ++i) {
        bias.t_ns = begin_ns + i * 1'000'000'000 / rate_hz;
        ImuSample sample = reading(*path, T_camera_imu, bias.t_ns);
        imu.biases.push_back(bias);
        for (int c = 0; noise && c < 6; ++c) {
            const auto n = normal_pair(
                hash_bits(key, kNoise, static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(c)));
            channel(&sample, c) +=
                channel(&bias, c) +
                n.a * white * (c < 3 ? figures.gyro_rad_s_sqrt_hz : figures.accel_m_s2_sqrt_hz);
            channel(&bias, c) +=
                n.b * walk * (c < 3 ? figures.gyro_walk_rad_s2_sqrt_hz : figures.accel_walk_m_s3_sqrt_hz);
        }
        imu.samples.push_back(sample);
        if (bias.t_ns >= end_ns) return imu;
    }
}

std::string synth_imu_text(const SynthImu& imu, int rate_hz, bool noise) {
    const ImuNoise n;
    std::string text = kColumns;
    text +=
        "# T_camera_imu tx ty tz qx qy qz qw, IMU coordinates to the depth camera's, also in "
        "camera.txt:\n# " +
        extrinsic_numbers() + "\n";
    char line[600];
    if (noise)
        std::snprintf(
            line, sizeof line,
            "# %d Hz. White noise: gyro %.4g rad/s, accel %.4g m/s^2 a sqrt(Hz) (data sheet of the Bosch\n"
            "# BMI088). Walk of the bias: gyro %.4g rad/s^2, accel %.4g m/s^3 a sqrt(Hz) (BMI160 in "
            "Schubert\n"
            "# et al., IROS 2018). Bias at the start, sigma an axis: gyro %.4g rad/s, accel %.4g m/s^2 "
            "(BMI088).\n",
            rate_hz, n.gyro_rad_s_sqrt_hz, n.accel_m_s2_sqrt_hz, n.gyro_walk_rad_s2_sqrt_hz,
            n.accel_walk_m_s3_sqrt_hz, n.gyro_bias_rad_s, n.accel_bias_m_s2);
    else
        std::snprintf(line, sizeof line, "# %d Hz, without noise and bias.\n", rate_hz);
    return text + line + "# t gx gy gz ax ay az\n" + format_imu(imu.samples);
}

std::string synth_imu_bias_text(const SynthImu& imu) {
    return std::string("# The true biases of imu.txt.\n") + kColumns + "# t gx gy gz ax ay az\n" +
           format_imu(imu.biases);
}

std::string synth_imu_camera_text() {
    return "# IMU coordinates to depth camera coordinates: tx ty tz qx qy qz qw\nT_camera_imu " +
           extrinsic_numbers() + "\n";
}

}  // namespace burin
