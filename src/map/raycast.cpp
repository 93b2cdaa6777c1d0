// SPDX-License-Identifier: MIT
#include "map/raycast.h"

#include <algorithm>
#include <cmath>

#include "map/field_reader.h"
#include "map/sample.h"
#include "map/surface_bounds.h"

namespace burin {
namespace {

constexpr int kTile = 8;  // pixels: the rays of a tile pass through the same few chunks

// v(t) = start + direction t, in lattice coordinates; t in voxels.
struct Ray {
    Vec3f start, direction, inverse;

    Vec3f at(float t) const { return start + direction * t; }
    // Where the ray leaves the chunk that holds the voxel nearest to v.
    float chunk_exit(Vec3f v) const {
        float exit = 1e30f;
        for (int k = 0; k < 3; ++k) {
            if (direction[k] == 0) continue;
            const int chunk = nearest_int(v[k]) >> 3;
            const float wall = static_cast<float>(8 * chunk) + (direction[k] > 0 ? 7.5f : -0.5f);
            exit = std::min(exit, (wall - start[k]) * inverse[k]);
        }
        return exit;
    }
};

// Where the field is 0 between t[0], where it is d[0] > 0, and t[1], where it is d[1] <= 0: by linear
// interpolation, repeated since the field is only nearly linear.
float crossing(FieldReader& field, const Ray& ray, float t0, float d0, float t1, float d1) {
    for (int i = 0;; ++i) {
        const float at = t0 + (t1 - t0) * d0 / (d0 - d1);
        float d = 0;
        if (i == 1 || !field.trilinear(ray.at(at), &d)) return at;
        if (d > 0) {
            t0 = at;
            d0 = d;
        } else {
            t1 = at;
            d1 = d;
        }
    }
}

// Ray parameter of the surface between t and t_end, or a negative number.
float first_surface(FieldReader& field, const Ray& ray, float t, float t_end) {
    bool before = false;  // the last step read a positive distance, interpolated
    float d_before = 0, t_before = 0;
    // A step as long as the distance may jump over the surface: the nearest voxel is off by up to one, and
    // projective distances taken at a grazing angle are several times the true ones. So where a step from
    // `front` in free space lands behind the surface or in the unknown, the way up to there, `fine_end`, is
    // walked again in short steps.
    float front = -1, fine_end = -1;
    while (t < t_end) {
        const Vec3f v = ray.at(t);
        const bool fine = t < fine_end;
        float d = 0;
        const FieldReader::Nearest nearest = field.nearest(v, &d);
        bool known = nearest == FieldReader::kKnown;
        if (known && d > 2.0f && !fine) {  // far from a crossing: the nearest voxel is good enough
            before = false;
            front = t;
            t += 0.8f * d;
            continue;
        }
        // A thin known layer in front of the surface must not be jumped over: the nearest voxel is known from
        // half a voxel before its centre on, a cell only from there.
        const float skip = known ? 0.25f : 0.5f;
        known = known && field.trilinear(v, &d);
        if (known && d <= 0 && before) return crossing(field, ray, t_before, d_before, t, d);
        if (!(known && d > 0)) {
            before = false;
            if (front >= 0) {
                fine_end = t;
                t = front;
                front = -1;
            } else if (fine) {
                t += 0.5f;
            } else {  // we came from behind or from the unknown
                t = nearest == FieldReader::kNoChunkThere ? std::max(t, ray.chunk_exit(v)) + 0.01f : t + skip;
            }
            continue;
        }
        before = true;
        d_before = d;
        t_before = t;
        if (!fine) front = t;
        t += fine ? 0.5f : std::max(0.8f * d, 0.25f);
    }
    return -1;
}

struct Caster {
    const Volume& volume;
    const Camera& camera;
    const Se3& T;
    const LatticeFrame& frame;
    const SurfaceBounds& bounds;
    float max_depth_m;
    float longest_step;  // voxels; a ray may look behind its last chunk, and walk back from there
    const RaycastImages& out;

    void pixel(FieldReader& field, Sampler& sampler, int x, int y, SurfaceBounds::Depths depths) const {
        const Vec3d pixel_ray = unproject(camera, {static_cast<double>(x), static_cast<double>(y)});
        const Vec3f r = to_float(pixel_ray);
        const float* m = frame.map.m;
        const Vec3f along{m[0] * r.x + m[1] * r.y + m[2] * r.z, m[3] * r.x + m[4] * r.y + m[5] * r.z,
                          m[6] * r.x + m[7] * r.y + m[8] * r.z};
        const float voxels_per_m = norm(along);  // of depth
        Ray ray{{frame.map.offset[0], frame.map.offset[1], frame.map.offset[2]},
                along * (1.0f / voxels_per_m),
                {}};
        for (int k = 0; k < 3; ++k) ray.inverse[k] = ray.direction[k] != 0 ? 1.0f / ray.direction[k] : 1e30f;
        float t = -1;
        if (depths.nearest_m <= depths.farthest_m)
            t = first_surface(
                field, ray, depths.nearest_m * voxels_per_m,
                std::min(depths.farthest_m * voxels_per_m + longest_step, max_depth_m * voxels_per_m));
        write(field, sampler,
              static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                  static_cast<std::size_t>(x),
              pixel_ray, ray, t, t / voxels_per_m);
    }

    void write(FieldReader& field, Sampler& sampler, std::size_t i, Vec3d pixel_ray, const Ray& ray, float t,
               float depth) const {
        if (out.depth_m) out.depth_m[i] = t >= 0 ? depth : 0.0f;
        if (out.normals) {
            Vec3f n{};
            if (t >= 0 && field.gradient(ray.at(t), &n)) n = normalised(n);
            for (int k = 0; k < 3; ++k) out.normals[3 * i + static_cast<std::size_t>(k)] = n[k];
        }
        if (out.rgb) {
            float rgb[3] = {};
            if (t >= 0 && !sampler.colour(T * (pixel_ray * static_cast<double>(depth)), rgb))
                rgb[0] = rgb[1] = rgb[2] = 255;
            for (int k = 0; k < 3; ++k)
                out.rgb[3 * i + static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(rgb[k] + 0.5f);
        }
    }
};

}  // namespace

void raycast(const Volume& volume, const Camera& camera, const Se3& T, float max_depth_m,
             const RaycastImages& out, Jobs& jobs) {
    const LatticeFrame frame(volume, T);
    const SurfaceBounds bounds(volume, camera, T, max_depth_m, jobs);
    const Caster caster{
        volume, camera, T, frame, bounds, max_depth_m, volume.shape().truncation_m / volume.voxel_m(), out};
    const int columns = (camera.width + kTile - 1) / kTile, rows = (camera.height + kTile - 1) / kTile;
    jobs.run(columns * rows, [&](int tile, int) {
        FieldReader field(volume, frame.origin);
        Sampler sampler(volume);
        const int x0 = tile % columns * kTile, y0 = tile / columns * kTile;
        const SurfaceBounds::Depths depths = bounds.at(x0, y0);
        for (int y = y0; y < std::min(y0 + kTile, camera.height); ++y)
            for (int x = x0; x < std::min(x0 + kTile, camera.width); ++x)
                caster.pixel(field, sampler, x, y, depths);
    });
}

}  // namespace burin
