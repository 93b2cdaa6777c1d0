// SPDX-License-Identifier: MIT
// The device's registration table: where each depth pixel lies in the colour image, as a cubic polynomial in
// 29 integers (Opcode::algorithm_params, id 2; Kinect: 0x40), plus a shift that depends on depth alone. From
// it the colour camera's intrinsics follow, which the device tells nowhere else.
#pragma once

#include <cstdint>
#include <memory>

#include "core/camera.h"
#include "platform/usb/depth_geometry.h"

namespace burin {

inline constexpr int kRegistrationBytes = 116;
inline constexpr int kPaddingBytes = 6;

// In the order on the wire (OpenNI2, RegistrationInfo; libfreenect, freenect_reg_info).
struct RegistrationPolynomial {
    std::int32_t ax = 0, bx = 0, cx = 0, dx = 0, dx_start = 0;
    std::int32_t ay = 0, by = 0, cy = 0, dy = 0, dy_start = 0;
    std::int32_t dxdx = 0, dxdy = 0, dydx = 0, dydy = 0;
    std::int32_t dxdxdx = 0, dydxdx = 0, dxdxdy = 0, dydxdy = 0, dydydx = 0, dydydy = 0;
    int start_lines = 0;  // rows above the colour image that the polynomial counts

    bool empty() const { return dx_start == 0 && dy_start == 0 && dxdx == 0 && dydy == 0; }
};

// Error: format (fewer bytes than there must be).
Status parse_registration(const std::uint8_t* data, int bytes, const char* name, RegistrationPolynomial* out);
Status parse_padding(const std::uint8_t* data, int bytes, const char* name, RegistrationPolynomial* out);

// Maps depth pixels of 640 x 480 to colour pixels.
class Registration {
  public:
    // Evaluates the polynomial for every pixel. False: no memory. Allocates.
    bool build(const RegistrationPolynomial& polynomial, const DepthGeometry& geometry);
    bool ready() const { return x_ != nullptr; }

    // Column in 1/256 pixel, beyond 640 * 256 when it lies outside, and row, of depth pixel (x, y) at
    // depth_mm in 1..kMaxDepth_mm - 1. The same numbers as libfreenect's.
    std::int32_t column_256(int x, int y, int depth_mm) const {
        return x_[y * kWidth + x] + shift_[depth_mm];
    }
    int row(int y, int x) const { return y_[y * kWidth + x]; }

    // Depth as the colour camera sees it: each pixel at its place there, the nearest wins. Both images
    // 640 x 480, rows packed, in millimetres.
    void apply(const std::uint16_t* depth_mm, std::uint16_t* registered_mm) const;

    // The colour camera that fits the table best, axes parallel to the depth camera's: intrinsics by least
    // squares over all pixels, and the distance that moves pixels as the table does, which is the device's
    // own stretched by the ratio of the focal lengths. *residual_px: root mean square. False: the table does
    // not describe a camera (focal length beyond a factor of two of the depth camera's, or the residual above
    // kMaxResidual_px).
    bool fit_camera(const Camera& depth, const DepthGeometry& geometry, Camera* colour, Se3* T_colour_depth,
                    double* residual_px) const;

    static constexpr int kWidth = 640, kHeight = 480;
    // Above it the images are turned against each other or the table is none: the mean of 5 pixels is where
    // depth and colour no longer agree by eye.
    static constexpr double kMaxResidual_px = 5;

  private:
    std::unique_ptr<std::int32_t[]> x_, shift_;
    std::unique_ptr<std::int16_t[]> y_;
    int start_lines_ = 0;
};

}  // namespace burin
