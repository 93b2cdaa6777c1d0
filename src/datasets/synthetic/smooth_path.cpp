// SPDX-License-Identifier: MIT
#include "datasets/synthetic/smooth_path.h"

#include <algorithm>
#include <cmath>

#include "core/time.h"

namespace burin {
namespace {

constexpr int kChannels = 7;
constexpr double kMostTurnRad = 2;

}  // namespace

Result<SmoothPath> SmoothPath::through(const Trajectory& trajectory) {
    if (trajectory.empty()) return Status::error(Code::invalid_argument, "0 poses, expected at least 1");
    SmoothPath path;
    const std::size_t n = trajectory.size();
    for (std::size_t i = 0; i < n; ++i) {
        const StampedPose& pose = trajectory[i];
        Quaternion q = quaternion_of(pose.T_world_camera.R);
        if (i > 0) {
            if (pose.t_ns <= path.t_ns_.back())
                return Status::error(Code::invalid_argument,
                                     "pose %zu: stamp not after the last, expected rising", i);
            const Channels& p = path.value_.back();
            const double cosine = p[3] * q.x + p[4] * q.y + p[5] * q.z + p[6] * q.w;
            const Mat3d R = trajectory[i - 1].T_world_camera.R.transposed() * pose.T_world_camera.R;
            if (const double turn = norm(rotation_vector(R)); turn > kMostTurnRad)
                return Status::error(
                    Code::invalid_argument,
                    "pose %zu: turned by %.2f radians since the last, expected at most %g for an IMU", i,
                    turn, kMostTurnRad);
            if (cosine < 0) q = {-q.x, -q.y, -q.z, -q.w};
        }
        const Vec3d t = pose.T_world_camera.t;
        path.t_ns_.push_back(pose.t_ns);
        path.value_.push_back({t.x, t.y, t.z, q.x, q.y, q.z, q.w});
    }
    // Second derivatives m of a natural cubic spline: with h the lengths of the pieces,
    //   h[i-1] m[i-1] + 2 (h[i-1] + h[i]) m[i] + h[i] m[i+1] = 6 ((v[i+1] - v[i]) / h[i] - (v[i] - v[i-1]) /
    //   h[i-1]),
    // m = 0 at both ends; tridiagonal, eliminated downwards and solved upwards (Thomas).
    path.second_.assign(n, Channels{});
    std::vector<double> above(n, 0.0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
        const double h0 = seconds_between(path.t_ns_[i - 1], path.t_ns_[i]);
        const double h1 = seconds_between(path.t_ns_[i], path.t_ns_[i + 1]);
        const double pivot = 2 * (h0 + h1) - h0 * above[i - 1];
        above[i] = h1 / pivot;
        for (int c = 0; c < kChannels; ++c) {
            const auto k = static_cast<std::size_t>(c);
            const double bend = 6 * ((path.value_[i + 1][k] - path.value_[i][k]) / h1 -
                                     (path.value_[i][k] - path.value_[i - 1][k]) / h0);
            path.second_[i][k] = (bend - h0 * path.second_[i - 1][k]) / pivot;
        }
    }
    for (std::size_t i = n; i-- > 1;)
        for (std::size_t k = 0; k < kChannels; ++k)
            if (i + 1 < n) path.second_[i][k] -= above[i] * path.second_[i + 1][k];
    return path;
}

SmoothPath::State SmoothPath::at(std::int64_t t_ns) const {
    Channels v = value_.front(), d{}, dd{};
    if (value_.size() > 1) {
        const auto after = std::upper_bound(t_ns_.begin() + 1, t_ns_.end() - 1, t_ns);
        const auto i = static_cast<std::size_t>(after - t_ns_.begin()) - 1;
        const double h = seconds_between(t_ns_[i], t_ns_[i + 1]);
        const double whole = seconds_between(t_ns_[i], t_ns), x = std::clamp(whole, 0.0, h), y = h - x;
        for (std::size_t k = 0; k < kChannels; ++k) {
            const double a = value_[i][k], b = value_[i + 1][k], m0 = second_[i][k], m1 = second_[i + 1][k];
            v[k] = (m0 * y * y * y + m1 * x * x * x) / (6 * h) + (a / h - m0 * h / 6) * y +
                   (b / h - m1 * h / 6) * x;
            d[k] = (m1 * x * x - m0 * y * y) / (2 * h) + (b - a) / h - (m1 - m0) * h / 6;
            dd[k] = (m0 * y + m1 * x) / h;
            v[k] += d[k] * (whole - x);  // beyond an end
        }
    }
    // q = unnormalised: the angular velocity in the camera's axes is the vector part of 2 q* q' / |q|^2,
    // since what changes the length alone only moves the scalar part; its derivative by the quotient rule.
    const Quaternion q{v[3], v[4], v[5], v[6]}, conjugate{-q.x, -q.y, -q.z, q.w};
    const double n2 = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    const Quaternion first = conjugate * Quaternion{d[3], d[4], d[5], d[6]};
    const Quaternion second = conjugate * Quaternion{dd[3], dd[4], dd[5], dd[6]};
    State s;
    s.T_world_camera = {rotation_of(normalised(q)), {v[0], v[1], v[2]}};
    s.velocity_m_s = {d[0], d[1], d[2]};
    s.acceleration_m_s2 = {dd[0], dd[1], dd[2]};
    s.turn_rad_s = Vec3d{first.x, first.y, first.z} * (2 / n2);
    s.turn_rad_s2 = Vec3d{second.x, second.y, second.z} * (2 / n2) - s.turn_rad_s * (2 * first.w / n2);
    return s;
}

}  // namespace burin
