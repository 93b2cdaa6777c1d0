// SPDX-License-Identifier: MIT
#include "map/raycast.h"

#include <algorithm>
#include <array>
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

// Where the field is 0 between t[0], where it is d[0] > 0, and t[1], where it is d[1] <= 0: by linear
// interpolation, repeated since the field is only nearly linear.
double crossing(Sampler& sampler, Vec3d origin, Vec3d direction, std::array<double, 2> t,
                std::array<float, 2> d) {
    double at = 0;
    for (int i = 0;; ++i) {
        at = t[0] + (t[1] - t[0]) * d[0] / (d[0] - d[1]);
        float d_at = 0;
        if (i == 2 || !sampler.distance(origin + direction * at, &d_at)) return at;
        const std::size_t end = d_at > 0 ? 0 : 1;
        t[end] = at;
        d[end] = d_at;
    }
}

// Ray parameter (metres along the unit direction) of the surface, or a negative number.
double first_surface(Sampler& sampler, Vec3d origin, Vec3d direction, double t_end, double voxel_m) {
    bool before = false;  // the last step read a positive distance, interpolated
    float d_before = 0;
    double t_before = 0;
    // A step as long as the distance may jump over the surface: the nearest voxel is off by up to one, and
    // projective distances taken at a grazing angle are several times the true ones. So where a step from
    // `front` in free space lands behind the surface or in the unknown, the way up to there, `fine_end`, is
    // walked again in short steps.
    double front = -1, fine_end = 0;
    for (double t = 0; t < t_end;) {
        const Vec3d p = origin + direction * t;
        const bool fine = t < fine_end;
        bool in_chunk = false;
        float d = 0;
        bool known = sampler.nearest(p, &d, &in_chunk);
        if (known && d > 2 * voxel_m && !fine) {  // far from a crossing: the nearest voxel is good enough
            before = false;
            front = t;
            t += 0.8 * d;
            continue;
        }
        const double skip_m = known ? 0.5 * voxel_m : voxel_m;
        known = known && sampler.distance(p, &d);
        if (known && d <= 0 && before)
            return crossing(sampler, origin, direction, {t_before, t}, {d_before, d});
        if (!(known && d > 0)) {
            before = false;
            if (front >= 0) {
                fine_end = t;
                t = front;
                front = -1;
            } else if (fine) {
                t += 0.5 * voxel_m;
            } else {  // we came from behind or from the unknown
                t += in_chunk ? skip_m : to_chunk_exit(p, direction, kChunkSide * voxel_m) + 1e-3 * voxel_m;
            }
            continue;
        }
        before = true;
        d_before = d;
        t_before = t;
        if (!fine) front = t;
        t += fine ? 0.5 * voxel_m : std::max(0.8 * d, 0.25 * voxel_m);
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
