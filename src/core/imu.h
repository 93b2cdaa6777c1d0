// SPDX-License-Identifier: MIT
// Readings of an inertial measurement unit and the figures that describe its noise.
#pragma once

#include <cstdint>

#include "core/vec.h"

namespace burin {

struct ImuSample {
    std::int64_t t_ns = 0;
    Vec3d gyro_rad_s;  // angular velocity of the IMU against the world, in the IMU's own axes
    Vec3d accel_m_s2;  // specific force in the IMU's own axes: at rest with z up it reads +9.81 on z
};

// Standard gravity rounded; it varies by 0.3 % over the Earth.
inline constexpr double kGravity_m_s2 = 9.81;

// White noise as densities (a reading at F samples a second has the density times sqrt(F)), biases that walk
// (after t seconds by the density times sqrt(t)), and where a bias begins (standard deviation an axis).
// The defaults are a middling MEMS part of 2015 to 2020.
struct ImuNoise {
    // Bosch BMI088, data sheet BST-BMI088-DS001: 0.014 degrees/s and 175 ug a sqrt(Hz).
    double gyro_rad_s_sqrt_hz = 2.4435e-4;
    double accel_m_s2_sqrt_hz = 1.717e-3;
    // The data sheet has no random walk. Bosch BMI160 by Allan deviation: Schubert et al., "The TUM VI
    // Benchmark" (IROS 2018).
    double gyro_walk_rad_s2_sqrt_hz = 2.2e-6;
    double accel_walk_m_s3_sqrt_hz = 8.6e-5;
    // BMI088 data sheet, typical offsets: 1 degree/s and 20 mg.
    double gyro_bias_rad_s = 0.01745;
    double accel_bias_m_s2 = 0.196;
};

}  // namespace burin
