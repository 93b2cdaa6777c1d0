// SPDX-License-Identifier: MIT
// The IMU of a rendered sequence: exact readings along a smooth path through the frames' poses, and what a
// MEMS part makes of them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/imu.h"
#include "datasets/synthetic/smooth_path.h"

namespace burin {

// Where the IMU sits on the camera: centimetres away, its x axis along the camera's z, y against x, z against
// y (as on a board that stands behind the lens), two degrees off that as mounted by hand.
Se3 synth_T_camera_imu();

struct SynthImu {
    std::vector<ImuSample> samples;
    std::vector<ImuSample> biases;  // the truth: what has been added besides white noise
};

// `rate_hz` samples a second from the first pose's stamp to the first at or after the last pose's. Gravity of
// 9.81 m/s^2 along -z of the world. With noise: the defaults of ImuNoise; numbers depend on (seed, sample)
// only. Errors: those of SmoothPath, a rate outside 10..8000, more than 5 million samples.
Result<SynthImu> synth_imu(const Trajectory& trajectory, int rate_hz, bool noise, std::uint64_t seed);

// imu.txt and truth/imu_bias.txt with their headers.
std::string synth_imu_text(const SynthImu& imu, int rate_hz, bool noise);
std::string synth_imu_bias_text(const SynthImu& imu);
// The line of camera.txt.
std::string synth_imu_camera_text();

}  // namespace burin
