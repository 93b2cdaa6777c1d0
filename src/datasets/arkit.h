// SPDX-License-Identifier: MIT
// Inside of the room: what the exports of phones with ARKit share.
#pragma once

#include <cstdint>
#include <string>

#include "core/camera.h"
#include "core/image.h"
#include "core/se3.h"

namespace burin {

// ARKit's axes: camera x right, y up, z towards the viewer; world metres, y up (developer.apple.com,
// ARCamera.transform, ARConfiguration.WorldAlignment.gravity). Burin's: OpenCV's camera; the world's z is up,
// as in its own sequences and where a map of unknown origin is taken to have it. Both are exchanges of axes,
// exact in floating point.
Se3 opencv_from_arkit(const Se3& T_world_camera_arkit);
// The same when the exporter has turned the camera's axes already.
Se3 z_up_from_y_up(const Se3& T_world_camera);

// The camera of an image of another size that shows the same view, pixel centres at integers.
Camera scaled_camera(const Camera& camera, int width, int height);

// ARConfidenceLevel: 0 low, 1 medium, 2 high. Low marks guesses: no return of the laser nearby, silhouettes,
// glass. Medium is the default: "the low confidence values are quite unreliable, and for most applications it
// would be best to filter them out" (github.com/PolyCam/polyform, README), while high alone leaves holes
// beside every edge.
inline constexpr std::uint8_t kDefaultMinConfidence = 1;

enum class ConfidenceScale : std::uint8_t { levels, bytes };  // 0 1 2; or 0 127 255, as Polycam writes them
// An 8-bit image, as levels. On an error *out is empty.
Status read_confidence(const std::string& path, ConfidenceScale scale, Image<std::uint8_t>* out);

}  // namespace burin
