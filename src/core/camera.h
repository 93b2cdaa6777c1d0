// SPDX-License-Identifier: MIT
// Pinhole camera with Brown's distortion (k1 k2 p1 p2 k3, the order of OpenCV and of the TUM data sets).
// Axes: x right, y down, z forward. Pixel centres lie at integer coordinates: u = 0 is the centre of column
// 0.
#pragma once

#include "core/status.h"
#include "core/vec.h"

namespace burin {

struct Camera {
    int width = 0, height = 0;              // pixels
    double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels
    double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;

    bool distorted() const { return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0 || k3 != 0; }
};

struct Pixel {
    double u = 0, v = 0;
};

// Largest image side accepted anywhere; keeps every product of sizes inside 32 bits.
inline constexpr int kMaxImageSide = 16384;

// Error: a size outside 1..kMaxImageSide, a focal length outside 0.05..100 image sizes (a view of
// 168 degrees, or parallel rays), a non-finite number, or a principal point more than one image size outside
// the image. `what` names the camera in the message, e.g. "depth".
Status check_camera(const Camera& camera, const char* what);

// p in camera coordinates, p.z > 0.
Pixel project(const Camera& camera, Vec3d p);

// The ray direction with z = 1 through a pixel; inverts the distortion by fixed-point iteration (20 rounds,
// enough for 1e-9 pixel on consumer lenses; a diverging model yields the undistorted direction).
Vec3d unproject(const Camera& camera, Pixel pixel);

// Undistorted camera model scaled to a pyramid level: half the size each level, pixel centres kept aligned.
Camera at_level(const Camera& camera, int level);

}  // namespace burin
