// SPDX-License-Identifier: MIT
// One frame as every sensor and every data set delivers it. Depth and colour keep their own size, intrinsics,
// time stamp and the extrinsic between them; intrinsics belong to the frame (phones move the lens).
#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/imu.h"
#include "core/se3.h"

namespace burin {

// The numeric values are those of burin_pixel_format, where each is described.
enum class PixelFormat : std::uint8_t { rgb8, bgr8, rgba8, bgra8, grey8, yuyv, nv12, nv21 };

// A frame in somebody else's memory, for the length of a call. Exactly one depth image is non-empty.
struct FrameView {
    std::int64_t t_ns = 0;
    View<const std::uint16_t> depth_u16;
    View<const float> depth_f32;
    double depth_unit_m = 0.001;
    Camera depth_camera;
    View<const std::uint8_t> confidence;  // of each depth pixel; may be empty
    std::uint8_t min_confidence = 0;      // depth of less counts as none
    View<const std::uint8_t> colour;      // strides in bytes
    View<const std::uint8_t> chroma;      // the second plane of nv12 and nv21
    PixelFormat colour_format = PixelFormat::rgb8;
    Camera colour_camera;
    Se3 T_colour_depth;
    Se3 T_world_camera;
    const ImuSample* imu = nullptr;  // as Frame::imu
    int imu_count = 0;
    Se3 T_camera_imu;
};

struct Frame {
    std::int64_t t_ns = 0;  // of the depth image

    // Depth along the optical axis (z, not ray length). Exactly one of the two images is non-empty.
    // metres = value * depth_unit_m. 0, 65535, negative, NaN and inf mean "no depth".
    Image<std::uint16_t> depth_u16;
    Image<float> depth_f32;
    double depth_unit_m = 0.001;
    Camera depth_camera;

    // A level for each depth pixel, empty when the sensor gives none; depth of less than min_confidence
    // counts as none. ARKit's levels are 0 low, 1 medium, 2 high.
    Image<std::uint8_t> confidence;
    std::uint8_t min_confidence = 0;

    // RGB, 3 channels, sRGB. Empty when the frame has no colour.
    Image<std::uint8_t> colour;
    Camera colour_camera;
    std::int64_t colour_t_ns = 0;
    Se3 T_colour_depth;  // maps depth camera coordinates to colour camera coordinates

    bool has_pose = false;
    Se3 T_world_camera;  // of the depth camera

    // Stamps rise: the samples after the previous frame's stamp, up to and with the first at or after t_ns.
    // Of the first frame: from the last sample at or before t_ns on. So the samples of two frames overlap by
    // the one past the first of them, and every stretch between frames is bracketed. Empty without an IMU.
    std::vector<ImuSample> imu;
    Se3 T_camera_imu;  // maps IMU coordinates to depth camera coordinates
};

}  // namespace burin
