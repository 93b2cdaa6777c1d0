// SPDX-License-Identifier: MIT
#include "datasets/synthetic/sensor_noise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "datasets/synthetic/portable_math.h"

namespace burin {
namespace {

using synthetic::hash_bits;
using synthetic::kPi;
using synthetic::normal_pair;
using synthetic::to_unit;

// Disparity in the sensor's own steps of 1/8 pixel, times depth in metres. The 35130 of Barron & Malik and of
// the ICL-NUIM scripts is this for depth in centimetres: 8 * 580 pixels * 7.57 cm = 35130.
constexpr double kDisparitySteps = 351.30;
// Their floor of Gaussian disparity noise, in steps; Nguyen's sigma_z asks for more at every distance.
constexpr double kLeastDisparitySigma = 1.0 / 6.0;
constexpr double kBaseline = 0.075;  // metres, camera to projector (Kinect v1: 7.5 cm)
// A step between neighbours above this share of the depth is an edge of an object: twenty times sigma_z at 1
// m.
constexpr double kEdgeStep = 0.04;
constexpr double kEdgeDropout = 0.5;  // the pattern is torn apart there; half the pixels fail
// The pattern is lost from 70 degrees on, surely at 84 (Nguyen: no data beyond 70 to 80 degrees).
constexpr double kGrazingFrom = 70 * kPi / 180, kGrazingTo = 84 * kPi / 180;
constexpr double kRandomDropout = 0.002;  // specks
// Nguyen's lateral sigma without its divergence at 90 degrees, where nothing is measured anyway.
double lateral_sigma(double theta) { return std::min(0.8 + 0.035 * theta / (kPi / 2 - theta), 1.2); }

// The angle of a cosine in 0..1: Abramowitz & Stegun 4.4.45, error below 7e-5.
double angle_of(double cosine) {
    const double x = std::clamp(cosine, 0.0, 1.0);
    return std::sqrt(1 - x) * (1.5707288 + x * (-0.2121144 + x * (0.0742610 - 0.0187293 * x)));
}

enum Stream : std::uint64_t { kShift = 1, kAxial, kDrop, kColour };

}  // namespace

double axial_sigma(double z, double theta) {
    const double sigma = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4);
    if (theta <= kPi / 3) return sigma;
    const double rest = std::max(kPi / 2 - theta, 0.02);  // bounded where the sensor has long failed
    return sigma + 0.0001 / std::sqrt(z) * theta * theta / (rest * rest);
}

void sensor_depth(const TruthImages& truth, const Camera& camera, const Se3& T_scene_camera,
                  std::uint64_t seed, int frame, const SensorRange& range, Jobs& jobs,
                  Image<float>* depth_m) {
    const int w = truth.depth_m.width, h = truth.depth_m.height;
    if (depth_m->width != w || depth_m->height != h || depth_m->channels != 1) *depth_m = Image<float>(w, h);
    const Mat3d R_camera_scene = T_scene_camera.R.transposed();
    const std::uint64_t key = hash_bits(seed, 0xDE97, static_cast<std::uint64_t>(frame));
    const auto depth_at = [&](int x, int y) {
        return static_cast<double>(truth.depth_m.pixels[static_cast<std::size_t>(y) * w + x]);
    };
    const auto normal_at = [&](int x, int y) {
        const float* n = truth.normal.pixels.data() + (static_cast<std::size_t>(y) * w + x) * 3;
        return R_camera_scene * Vec3d{n[0], n[1], n[2]};
    };
    std::vector<double> projector(static_cast<std::size_t>(w) * h);

    jobs.run(h, [&](int y, int) {
        // Where the projector sees each pixel's surface (columns of an image like the camera's). From the
        // right, the side of the projector, the least column so far stands before all that lie further right
        // in its view.
        double* least = projector.data() + static_cast<std::size_t>(y) * w;
        double running = std::numeric_limits<double>::infinity();
        for (int x = w - 1; x >= 0; --x) {
            least[x] = running;
            if (const double z = depth_at(x, y); z > 0)
                running = std::min(running, x - camera.fx * kBaseline / z);
        }
        for (int x = 0; x < w; ++x) {
            const std::size_t i = static_cast<std::size_t>(y) * w + x;
            float& out = depth_m->pixels[i];
            out = 0;
            const double own = depth_at(x, y);
            if (own <= 0) continue;
            constexpr double kShadowSlack = 1;  // pixel; keeps slanted surfaces out of their own shadow
            if (x - camera.fx * kBaseline / own > least[x] + kShadowSlack) continue;

            const Vec3d ray = unproject(camera, {static_cast<double>(x), static_cast<double>(y)});
            const double ray_length = norm(ray);
            const double own_theta = angle_of(-dot(normal_at(x, y), ray) / ray_length);
            const auto shift = normal_pair(hash_bits(key, i, kShift));
            const double sigma_l = lateral_sigma(own_theta);
            const int sx = std::clamp(static_cast<int>(std::floor(x + sigma_l * shift.a + 0.5)), 0, w - 1);
            const int sy = std::clamp(static_cast<int>(std::floor(y + sigma_l * shift.b + 0.5)), 0, h - 1);
            double z = depth_at(sx, sy);
            if (z <= 0) continue;
            const Vec3d n = normal_at(sx, sy);
            if (sx != x || sy != y) {
                const Vec3d seen = unproject(camera, {static_cast<double>(sx), static_cast<double>(sy)}) * z;
                const double facing = dot(n, ray);
                // Carrying a plane over a pixel or two stays honest until about 80 degrees.
                if (facing < -0.17 * ray_length) z = dot(n, seen) / facing;
            }

            double chance = kRandomDropout;
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) {
                    const double other =
                        depth_at(std::clamp(sx + dx, 0, w - 1), std::clamp(sy + dy, 0, h - 1));
                    if (other <= 0 || std::fabs(other - z) > kEdgeStep * z) chance = kEdgeDropout;
                }
            const double theta = angle_of(-dot(n, ray) / ray_length);
            if (theta > kGrazingFrom)
                chance = std::max(chance, (theta - kGrazingFrom) / (kGrazingTo - kGrazingFrom));
            if (to_unit(hash_bits(key, i, kDrop)) < chance) continue;
            if (!(z >= range.min_m && z <= range.max_m)) continue;

            // One step of disparity moves z by z^2 / kDisparitySteps; rounding alone has variance 1/12
            // step^2.
            const double disparity = kDisparitySteps / z;
            const double sigma = axial_sigma(z, theta) * disparity / z;  // in steps
            const double gauss =
                std::sqrt(std::max(sigma * sigma - 1.0 / 12, kLeastDisparitySigma * kLeastDisparitySigma));
            const double rounded =
                std::floor(disparity + gauss * normal_pair(hash_bits(key, i, kAxial)).a + 0.5);
            if (rounded < 1) continue;
            const double measured = kDisparitySteps / rounded;
            if (measured >= range.min_m && measured <= range.max_m) out = static_cast<float>(measured);
        }
    });
}

void sensor_colour(const TruthImages& truth, bool noise, std::uint64_t seed, int frame, Jobs& jobs,
                   Image<std::uint8_t>* rgb) {
    const int w = truth.radiance.width, h = truth.radiance.height;
    if (rgb->width != w || rgb->height != h || rgb->channels != 3) *rgb = Image<std::uint8_t>(w, h, 3);
    const std::uint64_t key = hash_bits(seed, 0xC0102, static_cast<std::uint64_t>(frame));
    // A white pixel holds about 4000 electrons and reading adds some 12 of them: typical of small phone-like
    // sensors, after the denoising inside them. In units of white: variance = linear / 4000 + (12 / 4000)^2.
    constexpr double kShot = 1.0 / 4000, kRead = 12.0 / 4000;
    jobs.run(h, [&](int y, int) {
        const std::size_t first = static_cast<std::size_t>(y) * w * 3;
        for (std::size_t i = first; i < first + static_cast<std::size_t>(w) * 3; ++i) {
            double value = truth.radiance.pixels[i];
            if (noise) {
                // The sum of the eight bytes of a hash: mean 1020, variance 8 * (256^2 - 1) / 12, close to
                // normal.
                const std::uint64_t bits = hash_bits(key, i, kColour);
                const std::uint64_t even = bits & 0x00FF00FF00FF00FFull,
                                    odd = bits >> 8 & 0x00FF00FF00FF00FFull;
                const auto sum = static_cast<double>((even + odd) * 0x0001000100010001ull >> 48);
                value += (sum - 1020) / 209.0222 * std::sqrt(std::max(value, 0.0) * kShot + kRead * kRead);
            }
            rgb->pixels[i] = encode_srgb(value);
        }
    });
}

}  // namespace burin
