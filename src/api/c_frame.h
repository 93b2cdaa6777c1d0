// SPDX-License-Identifier: MIT
// Frames of data sets as the C interface takes them: for programs above it.
#pragma once

#include "burin/burin.h"
#include "capture/frame.h"
#include "core/camera.h"
#include "core/se3.h"

namespace burin {

inline burin_camera c_camera(const Camera& c) {
    return {static_cast<std::uint32_t>(c.width),
            static_cast<std::uint32_t>(c.height),
            c.fx,
            c.fy,
            c.cx,
            c.cy,
            c.k1,
            c.k2,
            c.p1,
            c.p2,
            c.k3};
}

inline burin_pose c_pose(const Se3& T) {
    const Quaternion q = quaternion_of(T.R);
    return {T.t.x, T.t.y, T.t.z, q.x, q.y, q.z, q.w};
}

// Its images must outlive the result.
inline burin_frame c_frame(const Frame& f) {
    burin_frame out = burin_frame_default();
    const bool u16 = !f.depth_u16.empty();
    out.depth_type = u16 ? BURIN_DEPTH_U16 : BURIN_DEPTH_F32;
    out.t_ns = f.t_ns;
    out.depth = u16 ? static_cast<const void*>(f.depth_u16.pixels.data()) : f.depth_f32.pixels.data();
    out.depth_stride_bytes = static_cast<std::uint64_t>(f.depth_camera.width) * (u16 ? 2 : 4);
    out.depth_unit_m = f.depth_unit_m;
    out.depth_camera = c_camera(f.depth_camera);
    out.T_world_camera = c_pose(f.T_world_camera);
    if (!f.confidence.empty()) {
        out.confidence = f.confidence.pixels.data();
        out.confidence_stride_bytes = static_cast<std::uint64_t>(f.depth_camera.width);
        out.min_confidence = f.min_confidence;
    }
    if (!f.imu.empty()) {
        out.imu =
            reinterpret_cast<const burin_imu_sample*>(f.imu.data());  // the same layout, see frame_check.cpp
        out.imu_count = static_cast<std::uint32_t>(f.imu.size());
        out.T_camera_imu = c_pose(f.T_camera_imu);
    }
    if (f.colour.empty()) return out;
    out.colour = f.colour.pixels.data();
    out.colour_stride_bytes = static_cast<std::uint64_t>(f.colour_camera.width) * 3;
    out.colour_camera = c_camera(f.colour_camera);
    out.T_colour_depth = c_pose(f.T_colour_depth);
    return out;
}

}  // namespace burin
