// SPDX-License-Identifier: MIT
// Pictures of a scene without error: what an ideal camera would see. One ray a pixel through its centre.
#pragma once

#include <cstdint>
#include <vector>

#include "core/image.h"
#include "core/jobs.h"
#include "datasets/synthetic/scene.h"

namespace burin {

struct TruthImages {
    Image<float> depth_m;           // z along the optical axis; 0 where nothing was hit
    Image<float> normal;            // 3 channels: unit outward normal, scene frame; 0 where nothing was hit
    Image<float> albedo;            // 3 channels, linear reflectance
    Image<float> radiance;          // 3 channels, linear, exposed: 1 is white
    Image<std::uint8_t> label;      // none wall floor ceiling table seat window door = 0..7
    Image<std::uint16_t> instance;  // object number, 0 where nothing was hit
    Image<std::int32_t> part;       // part index, -1 where nothing was hit
    Image<std::int8_t> face;        // planar face of the part (face_of in shape.h), -1 on curved surface
};

// Renders into *out, resizing its images where needed. depth_only leaves normal, albedo, radiance, label and
// instance empty. Rows are independent: the result is the same for any number of threads. The camera's
// distortion is honoured. Error (invalid_argument): an impossible camera, or a camera position inside a
// solid; the text gives position and depth.
Status render_truth(const SyntheticScene& scene, const Camera& camera, const Se3& T_scene_camera,
                    bool depth_only, Jobs& jobs, TruthImages* out);

// sRGB, 8 bits, of linear values (IEC 61966-2-1); `dither` in [0, 1) is added before rounding down, 0.5
// rounds.
std::uint8_t encode_srgb(double linear, double dither = 0.5);
Image<std::uint8_t> encode_srgb(View<const float> linear);

// Which of the points lie in some frame's view with nothing before them: the ray from the camera to the point
// is free up to `tolerance` metres before it, and its depth lies in [min_depth, max_depth]. (*seen)[i]
// becomes 1, entries that are 1 already stay so and cost nothing; its size must be that of points. Exact: by
// tracing, not by a depth image.
void mark_seen(const SyntheticScene& scene, const Camera& camera, const Se3& T_scene_camera, double min_depth,
               double max_depth, double tolerance, const std::vector<Vec3d>& points, Jobs& jobs,
               std::vector<std::uint8_t>* seen);

}  // namespace burin
