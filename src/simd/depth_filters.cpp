// SPDX-License-Identifier: MIT
// The specification of the kernels on depth images. depth_filters_highway.cpp computes the same bits.
#include "simd/depth_filters.h"

#include <cmath>

#include "core/rounding.h"
#include "core/vec.h"

namespace burin::simd {
namespace scalar {

void bilateral_row(const DepthRow& in, int above, int below, std::uint16_t* out) {
    for (int x = 0; x < in.width; ++x) {
        const int centre = in.pixels[x];
        out[x] = static_cast<std::uint16_t>(centre);
        if (centre == 0) continue;
        const float sigma = 3.0f * axial_noise_m(static_cast<float>(centre) * in.unit_m) / in.unit_m;
        const float inverse = 0.125f / (2.0f * sigma * sigma);
        float sum = 0, total = 0;
        for (int dy = -above; dy <= below; ++dy)
            for (int dx = std::max(-2, -x); dx <= std::min(2, in.width - 1 - x); ++dx) {
                const int value = in.pixels[dy * in.stride + x + dx];
                if (value == 0) continue;
                const float d = static_cast<float>(value - centre);
                float w = std::max(1.0f - d * d * inverse, 0.0f);
                w = w * w;
                w = w * w;
                w = w * w * kBilateralSpatial[dx * dx + dy * dy];
                sum += w * d;
                total += w;
            }
        out[x] = static_cast<std::uint16_t>(std::clamp(centre + round_to_int(sum / total), 1, 65534));
    }
}

void remove_edges_row(const DepthRow& in, std::uint16_t* out) {
    for (int x = 0; x < in.width; ++x) {
        const std::uint16_t* p = in.pixels + x;
        bool edge = false;
        for (const std::uint16_t* q : {p - 1, p + 1, p - in.stride, p + in.stride})
            edge |= *q != 0 && across_jump(*p, *q);
        out[x] = edge ? std::uint16_t{0} : *p;
    }
}

void normal_at(const DepthRow& in, const RayModel& rays, int x, int y, float normal[3]) {
    normal[0] = normal[1] = normal[2] = 0;
    const std::uint16_t* p = in.pixels + x;
    const int centre = *p;
    if (centre == 0) return;
    const auto usable = [&](const std::uint16_t* q) { return *q != 0 && !across_jump(centre, *q); };
    const bool left = usable(p - 1), right = usable(p + 1), up = usable(p - in.stride),
               down = usable(p + in.stride);
    if (!(left || right) || !(up || down)) return;
    const auto point = [&](bool there, int dx, int dy) -> Vec3f {
        const float u = static_cast<float>(there ? x + dx : x), v = static_cast<float>(there ? y + dy : y);
        const float z = static_cast<float>(there ? p[dy * in.stride + dx] : centre) * in.unit_m;
        return {z * ((u - rays.cx) * rays.inverse_fx), z * ((v - rays.cy) * rays.inverse_fy), z};
    };
    const Vec3f across = point(right, 1, 0) - point(left, -1, 0),
                along = point(down, 0, 1) - point(up, 0, -1);
    const Vec3f n = normalised(cross(along, across));  // y down, x right: this order points to the camera
    normal[0] = n.x;
    normal[1] = n.y;
    normal[2] = n.z;
}

void normals_row(const DepthRow& in, const RayModel& rays, int y, float* normals) {
    for (int x = 0; x < in.width; ++x) normal_at(in, rays, x, y, normals + 3 * x);
}

void weights_row(const DepthRow& in, const RayModel& rays, int y, const WeightModel& model,
                 std::uint16_t* weights) {
    for (int x = 0; x < in.width; ++x) {
        weights[x] = 0;
        if (in.pixels[x] == 0) continue;
        const float z = static_cast<float>(in.pixels[x]) * in.unit_m;
        float w = model.one;
        if (model.inverse_z2) w = std::min(w / (z * z), 4.0f * model.one);
        if (model.angle) {
            const Vec3f ray = {(static_cast<float>(x) - rays.cx) * rays.inverse_fx,
                               (static_cast<float>(y) - rays.cy) * rays.inverse_fy, 1.0f};
            float n[3];
            normal_at(in, rays, x, y, n);
            const float cosine = -(n[0] * ray.x + n[1] * ray.y + n[2] * ray.z) / norm(ray);
            w = w * std::max(cosine, 0.1f);
        }
        weights[x] = static_cast<std::uint16_t>(std::max(1, round_to_int(w)));
    }
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
void bilateral_row(const DepthRow& in, int above, int below, std::uint16_t* out) {
    scalar::bilateral_row(in, above, below, out);
}
void remove_edges_row(const DepthRow& in, std::uint16_t* out) { scalar::remove_edges_row(in, out); }
void normals_row(const DepthRow& in, const RayModel& rays, int y, float* normals) {
    scalar::normals_row(in, rays, y, normals);
}
void weights_row(const DepthRow& in, const RayModel& rays, int y, const WeightModel& model,
                 std::uint16_t* weights) {
    scalar::weights_row(in, rays, y, model, weights);
}
#endif

}  // namespace burin::simd
