// SPDX-License-Identifier: MIT
#include "core/camera.h"

namespace burin {
namespace {

// Brown 1966 as written in OpenCV's documentation: radial k1 k2 k3, tangential p1 p2, on normalised
// coordinates.
void distort(const Camera& c, double x, double y, double* xd, double* yd) {
    const double r2 = x * x + y * y;
    const double radial = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
    *xd = x * radial + 2 * c.p1 * x * y + c.p2 * (r2 + 2 * x * x);
    *yd = y * radial + c.p1 * (r2 + 2 * y * y) + 2 * c.p2 * x * y;
}

}  // namespace

Status check_camera(const Camera& c, const char* what) {
    if (c.width < 1 || c.height < 1 || c.width > kMaxImageSide || c.height > kMaxImageSide)
        return Status::error(Code::invalid_argument,
                             "%s camera: image size is %dx%d, expected 1..%d each way", what, c.width,
                             c.height, kMaxImageSide);
    if (!(c.fx >= 0.05 * c.width) || !(c.fy >= 0.05 * c.height) || !(c.fx < 100.0 * c.width) ||
        !(c.fy < 100.0 * c.height))
        return Status::error(Code::invalid_argument,
                             "%s camera: focal length is %g %g pixels, expected 0.05 to 100 image sizes",
                             what, c.fx, c.fy);
    if (!(c.cx >= -c.width && c.cx <= 2.0 * c.width && c.cy >= -c.height && c.cy <= 2.0 * c.height))
        return Status::error(
            Code::invalid_argument,
            "%s camera: principal point is %g %g, expected within one image size of the image", what, c.cx,
            c.cy);
    const double coefficients =
        std::fabs(c.k1) + std::fabs(c.k2) + std::fabs(c.k3) + std::fabs(c.p1) + std::fabs(c.p2);
    if (!(coefficients < 1e3))
        return Status::error(Code::invalid_argument, "%s camera: distortion is not finite or absurd", what);
    return {};
}

Pixel project(const Camera& c, Vec3d p) {
    double x = p.x / p.z, y = p.y / p.z;
    if (c.distorted()) {
        double xd, yd;
        distort(c, x, y, &xd, &yd);
        x = xd;
        y = yd;
    }
    return {c.fx * x + c.cx, c.fy * y + c.cy};
}

Vec3d unproject(const Camera& c, Pixel pixel) {
    const double xd = (pixel.u - c.cx) / c.fx, yd = (pixel.v - c.cy) / c.fy;
    double x = xd, y = yd;
    if (c.distorted()) {
        for (int i = 0; i < 20; ++i) {
            double dx, dy;
            distort(c, x, y, &dx, &dy);
            x += xd - dx;
            y += yd - dy;
        }
        if (!(std::fabs(x - xd) < 1 && std::fabs(y - yd) < 1)) {
            x = xd;
            y = yd;
        }
    }
    return {x, y, 1};
}

Camera at_level(const Camera& camera, int level) {
    Camera c = camera;
    for (int i = 0; i < level; ++i) {
        c.width /= 2;
        c.height /= 2;
        c.fx /= 2;
        c.fy /= 2;
        // Centre of a 2x2 block of pixels (2u, 2u+1) sits at 2u + 0.5.
        c.cx = (c.cx - 0.5) / 2;
        c.cy = (c.cy - 0.5) / 2;
    }
    return c;
}

}  // namespace burin
