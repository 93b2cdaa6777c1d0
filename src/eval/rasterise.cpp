// SPDX-License-Identifier: MIT
// Every pixel of a triangle's rectangle is tested by its ray in camera coordinates, not by projected corners:
// triangles through the camera plane then need no special care but for that rectangle (as in Olano & Greer,
// "Triangle scan conversion using 2D homogeneous coordinates", 1997).
#include <algorithm>
#include <cmath>
#include <exception>
#include <vector>

#include "eval/ray_triangle.h"
#include "eval/render.h"

namespace burin {
namespace {

constexpr int kBandRows = 16;  // rows a job: dozens of jobs in any image, so that threads end together
constexpr std::size_t kBatch = 16384;  // vertices or triangles a job, well under a millisecond

// The pixels a triangle may cover; empty when u0 > u1. kMaxImageSide fits 16 bits.
struct PixelRect {
    std::uint16_t u0 = 1, u1 = 0, v0 = 1, v1 = 0;
};

struct Corners {
    Vec3d a, b, c;  // camera coordinates, metres
};

struct Bounds {
    double u0 = HUGE_VAL, u1 = -HUGE_VAL, v0 = HUGE_VAL, v1 = -HUGE_VAL;
    void add(const Camera& camera, Vec3d p) {
        const double u = camera.fx * p.x / p.z + camera.cx, v = camera.fy * p.y / p.z + camera.cy;
        u0 = std::min(u0, u);
        u1 = std::max(u1, u);
        v0 = std::min(v0, v);
        v1 = std::max(v1, v);
    }
};

PixelRect cover(const Camera& camera, const Corners& t, double near_m, bool cull_back_faces) {
    // The sign of this volume tells the side the camera is on: negative in front.
    const double volume = dot(t.a, cross(t.b - t.a, t.c - t.a));
    if (volume == 0 || (cull_back_faces && volume > 0)) return {};
    // The part at z >= near_m is a polygon of these corners and of the points where the edges cross that
    // plane.
    Bounds bounds;
    const Vec3d corner[3] = {t.a, t.b, t.c};
    for (int i = 0; i < 3; ++i) {
        const Vec3d p = corner[i], q = corner[(i + 1) % 3];
        if (p.z >= near_m) bounds.add(camera, p);
        if ((p.z >= near_m) != (q.z >= near_m)) {
            Vec3d cut = p + (q - p) * ((near_m - p.z) / (q.z - p.z));
            cut.z = near_m;
            bounds.add(camera, cut);
        }
    }
    // Widened by far more than the rounding of the projection; the rays decide.
    constexpr double kSlack = 1e-6;
    const double u0 = std::max(std::ceil(bounds.u0 - kSlack), 0.0);
    const double u1 = std::min(std::floor(bounds.u1 + kSlack), camera.width - 1.0);
    const double v0 = std::max(std::ceil(bounds.v0 - kSlack), 0.0);
    const double v1 = std::min(std::floor(bounds.v1 + kSlack), camera.height - 1.0);
    if (!(u0 <= u1 && v0 <= v1)) return {};
    return {static_cast<std::uint16_t>(u0), static_cast<std::uint16_t>(u1), static_cast<std::uint16_t>(v0),
            static_cast<std::uint16_t>(v1)};
}

void draw(const Camera& camera, const Corners& t, std::uint32_t index, const PixelRect& rect, int v_begin,
          int v_end, double near_m, MeshRaster* out) {
    const Vec3d n = cross(t.b - t.a, t.c - t.a);
    const double volume = dot(t.a, n);
    const int first = std::max<int>(rect.v0, v_begin), last = std::min<int>(rect.v1, v_end - 1);
    for (int v = first; v <= last; ++v) {
        const double y = (v - camera.cy) / camera.fy;
        float* depth = out->depth_m.view().row(v);
        std::uint32_t* triangle = out->triangle.view().row(v);
        for (int u = rect.u0; u <= rect.u1; ++u) {
            const double x = (u - camera.cx) / camera.fx;
            const auto shear = [&](Vec3d p) { return Sheared{p.x - x * p.z, p.y - y * p.z}; };
            if (!EdgeAreas(shear(t.a), shear(t.b), shear(t.c)).inside()) continue;
            const double z = volume / (n.x * x + n.y * y + n.z);
            if (!(z >= near_m) || !(z < HUGE_VAL)) continue;
            const float z_f = static_cast<float>(z);
            if (depth[u] != 0 && !(z_f < depth[u])) continue;  // of equal depths the first triangle stays
            depth[u] = z_f;
            triangle[u] = index;
        }
    }
}

}  // namespace

Result<MeshRaster> rasterise(const TriangleMesh& mesh, const Camera& camera, const Se3& T_world_camera,
                             double near_m, bool cull_back_faces, Jobs& jobs) try {
    BURIN_TRY(check_mesh(mesh));
    BURIN_TRY(check_camera(camera, "rendering"));
    if (camera.distorted())
        return Status::error(Code::unsupported,
                             "the rendering camera has distortion (k1 = %g), expected a pinhole", camera.k1);
    if (!(near_m > 0) || !std::isfinite(near_m))
        return Status::error(Code::invalid_argument, "near plane is at %g m, expected a positive distance",
                             near_m);

    const Se3 T_camera_world = T_world_camera.inverse();
    std::vector<Vec3d> points(mesh.positions.size());
    jobs.run_pieces(points.size(), kBatch,
                    [&](std::size_t i) { points[i] = T_camera_world * to_double(mesh.positions[i]); });
    const auto corners_of = [&](std::size_t i) {
        const auto& t = mesh.triangles[i];
        return Corners{points[t[0]], points[t[1]], points[t[2]]};
    };
    std::vector<PixelRect> rects(mesh.triangles.size());
    jobs.run_pieces(rects.size(), kBatch,
                    [&](std::size_t i) { rects[i] = cover(camera, corners_of(i), near_m, cull_back_faces); });

    // The triangles of every band of rows, in their order in the mesh: entries[starts[b]] to entries[starts[b
    // + 1]].
    const std::size_t bands = static_cast<std::size_t>((camera.height + kBandRows - 1) / kBandRows);
    std::vector<std::size_t> starts(bands + 1, 0);
    for (const PixelRect& r : rects)
        if (r.u0 <= r.u1)
            for (int b = r.v0 / kBandRows; b <= r.v1 / kBandRows; ++b)
                ++starts[static_cast<std::size_t>(b) + 1];
    for (std::size_t b = 0; b < bands; ++b) starts[b + 1] += starts[b];
    std::vector<std::uint32_t> entries(starts[bands]);
    std::vector<std::size_t> next(starts.begin(), starts.end() - 1);
    for (std::size_t i = 0; i < rects.size(); ++i)
        if (rects[i].u0 <= rects[i].u1)
            for (int b = rects[i].v0 / kBandRows; b <= rects[i].v1 / kBandRows; ++b)
                entries[next[static_cast<std::size_t>(b)]++] = static_cast<std::uint32_t>(i);

    MeshRaster out;
    out.depth_m = Image<float>(camera.width, camera.height);
    out.triangle = Image<std::uint32_t>(camera.width, camera.height, 1, kNoTriangle);
    jobs.run(static_cast<int>(bands), [&](int band, int) {
        const int v_begin = band * kBandRows, v_end = std::min(v_begin + kBandRows, camera.height);
        for (std::size_t k = starts[static_cast<std::size_t>(band)];
             k < starts[static_cast<std::size_t>(band) + 1]; ++k)
            draw(camera, corners_of(entries[k]), entries[k], rects[entries[k]], v_begin, v_end, near_m, &out);
    });
    return out;
} catch (const std::exception&) {
    return Status::error(Code::insufficient_memory, "no memory to render %zu triangles at %dx%d",
                         mesh.triangles.size(), camera.width, camera.height);
}

}  // namespace burin
