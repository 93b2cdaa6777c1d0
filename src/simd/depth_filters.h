// SPDX-License-Identifier: MIT
// Kernels on bordered depth images: bilateral filter, removal of edges, normals, weights. Each works on one
// row.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace burin::simd {

// One row of a bordered depth image: `pixels` is its column 0. Two columns left and right of the row are 0
// (where the stride is width + 2, the border of one row is also that of the next), as is one row above and
// below the image. From pixels[width] on, kOverread elements of every row that is read must be readable:
// vectors overrun.
inline constexpr int kOverread = 32;
struct DepthRow {
    const std::uint16_t* pixels;
    std::ptrdiff_t stride;
    int width;
    float unit_m;
};

// Axial noise of a structured-light sensor, metres (Nguyen, Izadi, Lovell 2012): 0.0012 + 0.0019 (z - 0.4)^2.
inline float axial_noise_m(float z) { return 0.0012f + 0.0019f * (z - 0.4f) * (z - 0.4f); }

// Two neighbouring readings at depths a and b belong to one surface when |a - b| <= kJump * min(a, b). A
// plane at 86 degrees to the view changes by 2.7 % from pixel to pixel at 525 pixels of focal length; the
// disparity steps of a Kinect reach 1.5 % at 5 m.
inline constexpr float kJump = 0.03f;
inline bool across_jump(int a, int b) {
    return static_cast<float>(std::abs(a - b)) > kJump * static_cast<float>(std::min(a, b));
}

// Tomasi & Manduchi 1998 over 5 x 5 pixels, sigma 1.5 pixels and 3 axial_noise_m(z); rows `above` (0..2) and
// `below` (0..2) of the window are inside the image. With d = value - centre and s = 3 noise in units,
//   w = exp(-(dx^2 + dy^2) / 4.5) (1 - min(d^2 / (2 s^2), 8) / 8)^8,  out = centre + round(sum w d / sum w):
// (1 - t / 8)^8 stands for exp(-t), and is 0 from 4 sigma on. No depth stays no depth.
void bilateral_row(const DepthRow& in, int above, int below, std::uint16_t* out);

// Readings one of whose four neighbours has depth across a jump become 0, others stay.
void remove_edges_row(const DepthRow& in, std::uint16_t* out);

// Pixel (x, y) at depth z is the point z ((x - cx) inverse_fx, (y - cy) inverse_fy, 1).
struct RayModel {
    float cx, cy, inverse_fx, inverse_fy;
};

// Unit normals of row `y` in camera coordinates, towards the camera, 3 floats a pixel: cross product of the
// differences down - up and right - left. A neighbour without depth or across a jump is replaced by the
// centre; without any on one axis the normal is 0, 0, 0.
void normals_row(const DepthRow& in, const RayModel& rays, int y, float* normals);

// Weight of an observation in units of `one`: 0 without depth, else at least 1 and
//   round(one * min(1 / z^2, 4) [inverse_z2] * max(0.1, cosine of normal and ray) [angle]).
// Without a normal the cosine counts as 0.
struct WeightModel {
    bool inverse_z2, angle;
    float one;
};
void weights_row(const DepthRow& in, const RayModel& rays, int y, const WeightModel& model,
                 std::uint16_t* weights);

// What the functions above specify, one lane at a time.
namespace scalar {
void bilateral_row(const DepthRow& in, int above, int below, std::uint16_t* out);
void remove_edges_row(const DepthRow& in, std::uint16_t* out);
void normals_row(const DepthRow& in, const RayModel& rays, int y, float* normals);
void normal_at(const DepthRow& in, const RayModel& rays, int x, int y, float normal[3]);
void weights_row(const DepthRow& in, const RayModel& rays, int y, const WeightModel& model,
                 std::uint16_t* weights);
}  // namespace scalar

// exp(-(dx^2 + dy^2) / 4.5) for squared offsets 0, 1, 2, 4, 5, 8.
inline constexpr float kBilateralSpatial[9] = {1.0f,        0.80073740f, 0.64118039f, 0,          0.41111229f,
                                               0.32919299f, 0,           0,           0.16901332f};

}  // namespace burin::simd
