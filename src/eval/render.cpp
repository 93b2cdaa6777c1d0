// SPDX-License-Identifier: MIT
#include "eval/render.h"

#include <algorithm>
#include <cmath>
#include <exception>

namespace burin {
namespace {

constexpr Vec3d kGrey = {205, 205,
                         205};  // bright enough that shading keeps its range, darker than white paper
constexpr Vec3d kBackFace = {95, 120, 215};  // a blue no shaded front face takes
constexpr double kAmbient = 0.25;            // surfaces seen edge-on stay readable

// What the ray of a pixel meets.
struct SurfacePoint {
    double a = 0, b = 0, c = 0;  // weights of the corners
    Vec3d normal;                // unit, world frame
    Vec3d towards_viewer;        // unit, world frame
    bool back_face = false;
};

SurfacePoint surface_at(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t,
                        const Se3& T_world_camera, Vec3d ray_camera) {
    SurfacePoint out;
    const Vec3d ray = T_world_camera.R * ray_camera;
    const Vec3d a = to_double(mesh.positions[t[0]]) - T_world_camera.t,
                b = to_double(mesh.positions[t[1]]) - T_world_camera.t,
                c = to_double(mesh.positions[t[2]]) - T_world_camera.t;
    const Vec3d n = cross(b - a, c - a);
    // The volumes the ray spans with the edges are the perspective-correct weights. The rasteriser found the
    // ray inside; its arithmetic is not quite the same, so they may come out a little negative, or without a
    // sum when edge-on.
    const Vec3d volumes = {dot(ray, cross(b, c)), dot(ray, cross(c, a)), dot(ray, cross(a, b))};
    const Vec3d weights = volumes * (1 / (volumes.x + volumes.y + volumes.z));
    const bool usable = std::isfinite(weights.x) && std::isfinite(weights.y) && std::isfinite(weights.z);
    out.a = usable ? std::clamp(weights.x, 0.0, 1.0) : 1.0 / 3;
    out.b = usable ? std::clamp(weights.y, 0.0, 1.0 - out.a) : 1.0 / 3;
    out.c = 1 - out.a - out.b;
    out.back_face = dot(ray, n) > 0;
    out.towards_viewer = normalised(-ray);
    if (!mesh.normals.empty())
        out.normal =
            normalised(to_double(mesh.normals[t[0]]) * out.a + to_double(mesh.normals[t[1]]) * out.b +
                       to_double(mesh.normals[t[2]]) * out.c);
    if (dot(out.normal, out.normal) == 0) out.normal = normalised(n);
    return out;
}

Vec3d colour_at(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t, const SurfacePoint& at) {
    if (mesh.colours.empty()) return kGrey;
    const auto vertex = [&](std::size_t k) {
        const auto& c = mesh.colours[t[k]];
        return Vec3d{static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])};
    };
    return vertex(0) * at.a + vertex(1) * at.b + vertex(2) * at.c;
}

// RGB, 0..255.
Vec3d shade(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t, const SurfacePoint& at,
            RenderMode mode) {
    const double light = kAmbient + (1 - kAmbient) * std::fabs(dot(at.normal, at.towards_viewer));
    if (at.back_face) return kBackFace * light;
    switch (mode) {
        case RenderMode::shaded:
            return kGrey * light;
        case RenderMode::shaded_colour:
            return colour_at(mesh, t, at) * light;
        case RenderMode::colour:
            return colour_at(mesh, t, at);
        case RenderMode::normals:
            return (at.normal + Vec3d{1, 1, 1}) * 127.5;
        case RenderMode::depth:
            break;
    }
    return {};
}

struct DepthRange {
    double near_m = 0, far_m = 0;
    Vec3d grey(double depth_m) const {
        constexpr double kNearest = 245, kFarthest = 35;  // apart from a white and from a black background
        const double s = far_m > near_m ? std::clamp((depth_m - near_m) / (far_m - near_m), 0.0, 1.0) : 0.0;
        const double g = kNearest + (kFarthest - kNearest) * s;
        return {g, g, g};
    }
};

DepthRange depth_range(const Image<float>& depth_m, const RenderOptions& options) {
    DepthRange range = {options.min_depth_m, options.max_depth_m};
    if (range.far_m > 0) return range;
    float low = HUGE_VALF, high = 0;
    for (const float z : depth_m.pixels) {
        if (z == 0) continue;
        low = std::min(low, z);
        high = std::max(high, z);
    }
    return {low, high};
}

std::uint8_t to_byte(double value) { return static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0)); }

// The camera with `factor` rays per pixel and direction; pixel centres at integers, so borders lie at -0.5.
Camera denser(Camera camera, int factor) {
    camera.width *= factor;
    camera.height *= factor;
    camera.fx *= factor;
    camera.fy *= factor;
    camera.cx = (camera.cx + 0.5) * factor - 0.5;
    camera.cy = (camera.cy + 0.5) * factor - 0.5;
    return camera;
}

}  // namespace

Result<Image<std::uint8_t>> render_mesh(const TriangleMesh& mesh, const Camera& camera,
                                        const Se3& T_world_camera, const RenderOptions& options,
                                        Jobs& jobs) try {
    BURIN_TRY(check_camera(camera, "rendering"));
    if (options.supersample < 1 || options.supersample > 4)
        return Status::error(Code::invalid_argument, "supersampling is %d, expected 1 to 4",
                             options.supersample);
    if (!(options.min_depth_m >= 0) || !(options.max_depth_m >= 0) ||
        ((options.min_depth_m > 0 || options.max_depth_m > 0) &&
         !(options.max_depth_m > options.min_depth_m)))
        return Status::error(Code::invalid_argument, "depth range is %g to %g m, expected 0 <= near < far",
                             options.min_depth_m, options.max_depth_m);
    const int factor =
        std::max(1, std::min(options.supersample, kMaxImageSide / std::max(camera.width, camera.height)));
    const Camera rays = denser(camera, factor);
    Result<MeshRaster> raster =
        rasterise(mesh, rays, T_world_camera, options.near_m, options.cull_back_faces, jobs);
    if (!raster) return raster.status();
    const DepthRange range = depth_range(raster->depth_m, options);
    const Vec3d background = {static_cast<double>(options.background[0]),
                              static_cast<double>(options.background[1]),
                              static_cast<double>(options.background[2])};

    Image<std::uint8_t> image(camera.width, camera.height, 3);
    jobs.run(camera.height, [&](int y, int) {
        for (int x = 0; x < camera.width; ++x) {
            Vec3d sum;
            for (int v = y * factor; v < (y + 1) * factor; ++v)
                for (int u = x * factor; u < (x + 1) * factor; ++u) {
                    const std::uint32_t index = raster->triangle.view().at(u, v);
                    if (index == kNoTriangle) {
                        sum = sum + background;
                    } else if (options.mode == RenderMode::depth) {
                        sum = sum + range.grey(raster->depth_m.view().at(u, v));
                    } else {
                        const auto& t = mesh.triangles[index];
                        const Vec3d ray = {(u - rays.cx) / rays.fx, (v - rays.cy) / rays.fy, 1};
                        sum = sum + shade(mesh, t, surface_at(mesh, t, T_world_camera, ray), options.mode);
                    }
                }
            for (int k = 0; k < 3; ++k) image.view().at(x, y, k) = to_byte(sum[k] / (factor * factor));
        }
    });
    return image;
} catch (const std::exception&) {
    return Status::error(Code::insufficient_memory, "no memory for an image of %dx%d", camera.width,
                         camera.height);
}

}  // namespace burin
