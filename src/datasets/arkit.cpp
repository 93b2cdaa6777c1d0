// SPDX-License-Identifier: MIT
#include "datasets/arkit.h"

#include "datasets/image_file.h"

namespace burin {

Se3 z_up_from_y_up(const Se3& T) {
    // A quarter turn about x: (x, y, z) -> (x, -z, y).
    Se3 out;
    for (int c = 0; c < 3; ++c) {
        out.R.m[c] = T.R.m[c];
        out.R.m[3 + c] = -T.R.m[6 + c];
        out.R.m[6 + c] = T.R.m[3 + c];
    }
    out.t = {T.t.x, -T.t.z, T.t.y};
    return out;
}

Se3 opencv_from_arkit(const Se3& T_arkit) {
    Se3 T = z_up_from_y_up(T_arkit);
    for (int r = 0; r < 3; ++r) {
        T.R.m[3 * r + 1] = -T.R.m[3 * r + 1];
        T.R.m[3 * r + 2] = -T.R.m[3 * r + 2];
    }
    return T;
}

Camera scaled_camera(const Camera& camera, int width, int height) {
    if (width == camera.width && height == camera.height) return camera;
    const double x = double(width) / camera.width, y = double(height) / camera.height;
    Camera out = camera;
    out.width = width;
    out.height = height;
    out.fx *= x;
    out.fy *= y;
    out.cx = (camera.cx + 0.5) * x - 0.5;
    out.cy = (camera.cy + 0.5) * y - 0.5;
    return out;
}

Status read_confidence(const std::string& path, ConfidenceScale scale, Image<std::uint8_t>* out) {
    Image<std::uint8_t> rgb;
    const Status status = read_rgb(path, &rgb);
    out->pixels.clear();
    out->width = out->height = 0;
    if (!status) return status;
    out->width = rgb.width;
    out->height = rgb.height;
    out->pixels.resize(rgb.pixels.size() / 3);
    for (std::size_t i = 0; i < out->pixels.size(); ++i) {
        const std::uint8_t value = rgb.pixels[3 * i];
        out->pixels[i] =
            scale == ConfidenceScale::levels ? value : static_cast<std::uint8_t>((value + 64) / 128);
    }
    return {};
}

}  // namespace burin
