// SPDX-License-Identifier: MIT
// What a structured-light sensor tells of itself, and what follows from it: depth of a shift, intrinsics.
//
// The device measures by how many pixels the projected pattern is shifted against the one it recorded at a
// plane at reference_cm. All lengths in the device are centimetres; the pixel is that of the 1280 x 1024
// sensor as it covers the reference plane, so reference_cm / pixel_cm is the focal length in those pixels.
#pragma once

#include <cstdint>

#include "core/camera.h"
#include "core/se3.h"
#include "core/status.h"

namespace burin {

struct DepthGeometry {
    double emitter_cm = 0;    // projector to depth camera
    double colour_cm = 0;     // depth camera to colour camera
    double reference_cm = 0;  // plane of shift `const_shift`
    double pixel_cm = 0;
    int const_shift = 0;  // pixels by which the reference plane itself is shifted
};

// The reply to Opcode::fixed_params, which has the four lengths as floats from byte 92 on. `name` begins the
// message. Error: format, with the value, when the reply is shorter than 108 bytes or a length is not finite
// or beyond anything that could be built.
Status parse_fixed_params(const std::uint8_t* data, int bytes, const char* name, DepthGeometry* geometry);
// The reply to Opcode::algorithm_params with id 0. Error: format, as above.
Status parse_const_shift(const std::uint8_t* data, int bytes, const char* name, DepthGeometry* geometry);

// Shifts are below this; the highest one and 0 mean "no depth". OpenNI2; libfreenect has a depth for 0.
inline constexpr int kShifts = 2048;
// The devices' own cut-off (OpenNI2, XN_DEVICE_SENSOR_MAX_DEPTH_1_MM; libfreenect has the same).
inline constexpr int kMaxDepth_mm = 10000;

// Depth of a shift in millimetres; 0: none. factor: pixels of the full sensor a pixel of the recorded
// pattern: 1, or 2 where the device runs on 640 x 480 pixels by itself (60 images a second). OpenNI2,
// XnShiftToDepth.cpp; libfreenect, registration.c: the same formula.
int shift_depth_mm(const DepthGeometry& geometry, int factor, int shift);
// All of them; table[kShifts - 1] is 0.
void build_depth_table(const DepthGeometry& geometry, int factor, std::uint16_t table[kShifts]);

// Intrinsics of an image of this size out of the full sensor's width.
Camera depth_camera(const DepthGeometry& geometry, int width, int height);

// Depth camera to colour camera: by the distance alone, axes parallel, the colour camera towards the
// projector (seen from behind the device: to the right).
Se3 colour_from_depth(const DepthGeometry& geometry);

}  // namespace burin
