// SPDX-License-Identifier: MIT
#include "map/raycast.h"

#include <algorithm>
#include <cmath>

#include "map/sample.h"

namespace burin {
namespace {

// Distance along the ray to where it leaves the chunk that contains p.
double to_chunk_exit(Vec3d p, Vec3d direction, double chunk_m) {
    double exit = 1e30;
    for (int r = 0; r < 3; ++r) {
        if (direction[r] == 0) continue;
        const double cell = std::floor(p[r] / chunk_m);
        const double wall = (direction[r] > 0 ? cell + 1 : cell) * chunk_m;
        exit = std::min(exit, (wall - p[r]) / direction[r]);
    }
    return std::max(exit, 0.0);
}

// Ray parameter (metres along the unit direction) of the surface, or a negative number.
double first_surface(Sampler& sampler, Vec3d origin, Vec3d direction, double t_end, double voxel_m) {
    bool before = false;  // the last step read a positive distance
    float d_before = 0;
    double t_before = 0;
    for (double t = 0; t < t_end;) {
        const Vec3d p = origin + direction * t;
        bool in_chunk = false;
        float d = 0;
        if (!sampler.nearest(p, &d, &in_chunk)) {
            before = false;
            t += in_chunk ? voxel_m : to_chunk_exit(p, direction, kChunkSide * voxel_m) + 1e-3 * voxel_m;
            continue;
        }
        if (d > 2 * voxel_m) {  // far from a crossing: the nearest voxel is good enough
            before = false;
            t += 0.8 * d;
            continue;
        }
        if (!sampler.distance(p, &d)) {
            before = false;
            t += 0.5 * voxel_m;
            continue;
        }
        if (d <= 0) {
            if (before) {
                // t* = t - dt d / (d - d_before), twice, since the field is only nearly linear.
                double low = t_before, high = t;
                float d_low = d_before, d_high = d;
                for (int i = 0; i < 2; ++i) {
                    const double mid = low + (high - low) * d_low / (d_low - d_high);
                    float d_mid;
                    if (!sampler.distance(origin + direction * mid, &d_mid)) return mid;
                    if (d_mid > 0) {
                        low = mid;
                        d_low = d_mid;
                    } else {
                        high = mid;
                        d_high = d_mid;
                    }
                }
                return low + (high - low) * d_low / (d_low - d_high);
            }
            t += voxel_m;  // we came from behind or from the unknown
            continue;
        }
        before = true;
        d_before = d;
        t_before = t;
        t += std::max(0.8 * d, 0.25 * voxel_m);
    }
    return -1;
}

}  // namespace

void raycast(const Volume& volume, const Camera& camera, const Se3& T, float max_depth_m,
             const RaycastImages& out, Jobs& jobs) {
    const double voxel_m = volume.voxel_m();
    jobs.run(camera.height, [&](int y, int) {
        Sampler sampler(volume);
        for (int x = 0; x < camera.width; ++x) {
            const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                                  static_cast<std::size_t>(x);
            const Vec3d ray = unproject(camera, {static_cast<double>(x), static_cast<double>(y)});
            const double length = norm(ray);
            const Vec3d direction = T.R * (ray * (1 / length));
            const double t = first_surface(sampler, T.t, direction, max_depth_m * length, voxel_m);
            const Vec3d p = T.t + direction * t;
            if (out.depth_m) out.depth_m[i] = t >= 0 ? static_cast<float>(t / length) : 0.0f;
            if (out.normals) {
                Vec3f n{};
                float d;
                if (t >= 0 && sampler.distance_and_gradient(p, &d, &n)) n = normalised(n);
                for (int k = 0; k < 3; ++k) out.normals[3 * i + static_cast<std::size_t>(k)] = n[k];
            }
            if (out.rgb) {
                float rgb[3] = {};
                if (t >= 0 && !sampler.colour(p, rgb)) rgb[0] = rgb[1] = rgb[2] = 255;
                for (int k = 0; k < 3; ++k)
                    out.rgb[3 * i + static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(rgb[k] + 0.5f);
            }
        }
    });
}

}  // namespace burin
