// SPDX-License-Identifier: MIT
#include "datasets/synthetic/render.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "datasets/synthetic/portable_math.h"

namespace burin {
namespace {

using synthetic::PointLight;
using synthetic::SceneData;

constexpr double kFarthest = 100;  // metres; no scene is that large

// Light that a surface of albedo 1 sends back (Lambert): lamps without shadows, plus ambient light that the
// normal's height, the place, and nearby surfaces (one probe along the normal) govern.
Vec3d irradiance(const SyntheticScene& scene, Vec3d p, Vec3d n) {
    const SceneData& data = scene.data();
    const double up = 0.5 + 0.5 * n.z;
    const double place =
        1 + data.ambient.variation *
                (2 * synthetic::value_noise(p * (1 / data.ambient.wavelength), data.ambient.seed) - 1);
    const double open =
        std::clamp(scene.distance(p + n * data.occlusion_reach) / data.occlusion_reach, 0.0, 1.0);
    const double ambient = place * (0.45 + 0.55 * open);
    Vec3d sum =
        (to_double(data.ambient.from_above) * up + to_double(data.ambient.from_below) * (1 - up)) * ambient;
    for (const PointLight& light : data.lights) {
        const Vec3d to_light = light.position - p;
        const double cosine = dot(n, to_light);
        if (cosine <= 0) continue;
        const double d2 = dot(to_light, to_light);
        sum = sum +
              to_double(light.colour) * (cosine / (std::sqrt(d2) * (1 + d2 / (light.reach * light.reach))));
    }
    return sum;
}

void put(Image<float>& image, int x, int y, Vec3d v) {
    float* out = image.pixels.data() + (static_cast<std::size_t>(y) * image.width + x) * 3;
    for (int i = 0; i < 3; ++i) out[i] = static_cast<float>(v[i]);
}

template <class T>
void fit(Image<T>& image, int width, int height, int channels) {
    if (image.width != width || image.height != height || image.channels != channels)
        image = Image<T>(width, height, channels);
}

// sRGB values at equal steps of the square root of the linear value, where the curve is nearly straight.
const std::array<float, 1026>& srgb_table() {
    static const std::array<float, 1026> table = [] {
        std::array<float, 1026> t{};
        for (int i = 0; i < 1026; ++i) {
            const double root = i / 1024.0, x = root * root;
            t[static_cast<std::size_t>(i)] = static_cast<float>(
                255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * synthetic::power(x, 1 / 2.4) - 0.055));
        }
        return t;
    }();
    return table;
}

}  // namespace

std::uint8_t encode_srgb(double linear, double dither) {
    const double at = std::sqrt(std::clamp(linear, 0.0, 1.0)) * 1024;
    const auto i = static_cast<std::size_t>(at);
    const auto& table = srgb_table();
    const double value = table[i] + (at - static_cast<double>(i)) * (table[i + 1] - table[i]);
    return static_cast<std::uint8_t>(std::clamp(std::floor(value + dither), 0.0, 255.0));
}

Image<std::uint8_t> encode_srgb(View<const float> linear) {
    Image<std::uint8_t> out(linear.width, linear.height, linear.channels);
    for (int y = 0; y < linear.height; ++y)
        for (int i = 0; i < linear.width * linear.channels; ++i)
            out.pixels[static_cast<std::size_t>(y) * linear.width * linear.channels + i] =
                encode_srgb(linear.row(y)[i]);
    return out;
}

Status render_truth(const SyntheticScene& scene, const Camera& camera, const Se3& T_scene_camera,
                    bool depth_only, Jobs& jobs, TruthImages* out) {
    BURIN_TRY(check_camera(camera, "synthetic"));
    const Vec3d eye = T_scene_camera.t;
    if (const double d = scene.distance(eye); !(d > 0))
        return Status::error(Code::invalid_argument,
                             "scene %s: the camera at (%.3f, %.3f, %.3f) is inside a solid (distance %.3f "
                             "m), expected free space",
                             scene.data().name.c_str(), eye.x, eye.y, eye.z, d);
    const int w = camera.width, h = camera.height;
    fit(out->depth_m, w, h, 1);
    fit(out->part, w, h, 1);
    fit(out->face, w, h, 1);
    if (depth_only) {
        out->normal = {}, out->albedo = {}, out->radiance = {}, out->label = {}, out->instance = {};
    } else {
        fit(out->normal, w, h, 3);
        fit(out->albedo, w, h, 3);
        fit(out->radiance, w, h, 3);
        fit(out->label, w, h, 1);
        fit(out->instance, w, h, 1);
    }
    const SceneData& data = scene.data();
    const double pixel_angle = 1 / std::min(camera.fx, camera.fy);
    jobs.run(h, [&](int y, int) {
        for (int x = 0; x < w; ++x) {
            const Vec3d ray = unproject(camera, {static_cast<double>(x), static_cast<double>(y)});
            const double length = norm(ray);
            const Vec3d direction = T_scene_camera.R * (ray * (1 / length));
            const SyntheticScene::Hit hit = scene.trace(eye, direction, kFarthest);
            const std::size_t i = static_cast<std::size_t>(y) * w + x;
            out->part.pixels[i] = hit.part;
            if (hit.part < 0) {
                out->depth_m.pixels[i] = 0;
                out->face.pixels[i] = -1;
                if (depth_only) continue;
                out->label.pixels[i] = 0;
                out->instance.pixels[i] = 0;
                put(out->normal, x, y, {});
                put(out->albedo, x, y, {});
                put(out->radiance, x, y,
                    to_double(data.backdrop) * (0.8 + 0.4 * (1 - static_cast<double>(y) / h)));
                continue;
            }
            const synthetic::Part& part = scene.part(hit.part);
            const Vec3d p = eye + direction * hit.distance;
            out->depth_m.pixels[i] = static_cast<float>(hit.distance / length);
            out->face.pixels[i] =
                static_cast<std::int8_t>(part.blend >= 0 ? -1 : synthetic::face_of(part, part.to_part(p)));
            if (depth_only) continue;
            const Vec3d n = scene.normal_at(p, hit.part);
            const double facing = std::max(-dot(n, direction), 0.1);
            const double footprint = hit.distance * pixel_angle / std::sqrt(facing);
            const Vec3d albedo = to_double(scene.albedo_at(p, n, hit.part, footprint));
            const Vec3d light = irradiance(scene, p, n) * data.exposure;
            out->label.pixels[i] = part.label;
            out->instance.pixels[i] = part.instance;
            put(out->normal, x, y, n);
            put(out->albedo, x, y, albedo);
            put(out->radiance, x, y, {albedo.x * light.x, albedo.y * light.y, albedo.z * light.z});
        }
    });
    return {};
}

void mark_seen(const SyntheticScene& scene, const Camera& camera, const Se3& T_scene_camera, double min_depth,
               double max_depth, double tolerance, const std::vector<Vec3d>& points, Jobs& jobs,
               std::vector<std::uint8_t>* seen) {
    constexpr std::size_t kBatch = 1024;
    const Se3 T_camera_scene = T_scene_camera.inverse();
    const auto batches = static_cast<int>((points.size() + kBatch - 1) / kBatch);
    jobs.run(batches, [&](int batch, int) {
        const std::size_t end = std::min(points.size(), (static_cast<std::size_t>(batch) + 1) * kBatch);
        for (std::size_t i = static_cast<std::size_t>(batch) * kBatch; i < end; ++i) {
            if ((*seen)[i]) continue;
            const Vec3d p = T_camera_scene * points[i];
            if (!(p.z >= min_depth && p.z <= max_depth)) continue;
            const Pixel pixel = project(camera, p);
            if (!(pixel.u >= -0.5 && pixel.v >= -0.5 && pixel.u < camera.width - 0.5 &&
                  pixel.v < camera.height - 0.5))
                continue;
            const Vec3d way = points[i] - T_scene_camera.t;
            const double length = norm(way);
            const auto hit = scene.trace(T_scene_camera.t, way * (1 / length), length + tolerance);
            if (hit.part < 0 || hit.distance >= length - tolerance) (*seen)[i] = 1;
        }
    });
}

}  // namespace burin
