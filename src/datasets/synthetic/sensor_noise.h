// SPDX-License-Identifier: MIT
// What a structured-light sensor (Kinect, Xtion) makes of a true depth image.
#pragma once

#include <cstdint>

#include "core/image.h"
#include "core/jobs.h"
#include "datasets/synthetic/render.h"

namespace burin {

// Standard deviation of a depth measurement along the optical axis, metres: Nguyen, Izadi, Lovell, "Modeling
// Kinect Sensor Noise for Improved 3D Reconstruction and Tracking" (3DIMPVT 2012), eq. 3 and 4:
//   sigma_z(z)        = 0.0012 + 0.0019 (z - 0.4)^2                                    for angles up to 60
//   degrees, sigma_z(z, theta) = sigma_z(z) + 0.0001 / sqrt(z) * theta^2 / (pi/2 - theta)^2     beyond.
// theta: angle between ray and normal, radians.
double axial_sigma(double z, double theta);

struct SensorRange {
    double min_m = 0.4,
           max_m = 5.0;  // beyond, the sensor delivers nothing (Kinect: 0.4 near, useless past 5)
};

// Adds to the truth, pixel by pixel and in this order:
//  - lateral noise: the pixel looks at the surface sigma_L = 0.8 + 0.035 theta / (pi/2 - theta) pixels beside
//  it
//    (Nguyen, eq. 1) and delivers where that surface's tangent plane meets its own ray. Edges fray; planes
//    stay planes.
//  - shadow: pixels that the projector, kBaseline to the camera's right, does not reach;
//  - dropouts: at depth discontinuities, at grazing angles, at random, and beyond the range;
//  - axial noise and quantisation: disparity, in the sensor's steps of 1/8 pixel, is 351.3 / z; Gaussian
//  noise is added
//    and the sum rounded to a whole step (Barron & Malik 2013; Handa et al., ICRA 2014, who write 35130 with
//    z in centimetres: z = 35130 / floor(35130 / z + N(0, 1/36) + 0.5)). The Gaussian part is made as large
//    as it takes for noise and rounding together to have Nguyen's sigma_z.
// Output: metres, 0 for no measurement. Numbers depend on (seed, frame, pixel) only. truth must hold normals.
void sensor_depth(const TruthImages& truth, const Camera& camera, const Se3& T_scene_camera,
                  std::uint64_t seed, int frame, const SensorRange& range, Jobs& jobs, Image<float>* depth_m);

// Read and shot noise of a small colour sensor, then sRGB. noise == false only encodes (rounding).
void sensor_colour(const TruthImages& truth, bool noise, std::uint64_t seed, int frame, Jobs& jobs,
                   Image<std::uint8_t>* rgb);

}  // namespace burin
