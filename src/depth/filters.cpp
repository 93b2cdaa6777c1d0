// SPDX-License-Identifier: MIT
#include "depth/filters.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/rounding.h"

namespace burin {
namespace {

bool across_jump(int a, int b) {
    return static_cast<float>(std::abs(a - b)) > kJump * static_cast<float>(std::min(a, b));
}

Vec3f point_at(const DepthImage& depth, int x, int y, float z) {
    const Camera& c = depth.camera;
    return {z * (static_cast<float>(x) - static_cast<float>(c.cx)) / static_cast<float>(c.fx),
            z * (static_cast<float>(y) - static_cast<float>(c.cy)) / static_cast<float>(c.fy), z};
}

}  // namespace

float axial_noise_m(float z) { return 0.0012f + 0.0019f * (z - 0.4f) * (z - 0.4f); }

void bilateral_filter(const DepthImage& in, std::uint16_t* out, Jobs& jobs) {
    // exp(-(dx^2 + dy^2) / (2 * 1.5^2)) for squared offsets 0, 1, 2, 4, 5, 8.
    static constexpr float kSpatial[9] = {1.0f,        0.80073740f, 0.64118039f, 0,          0.41111229f,
                                          0.32919299f, 0,           0,           0.16901332f};
    jobs.run(in.height, [&](int y, int) {
        for (int x = 0; x < in.width; ++x) {
            const int centre = in.at(x, y);
            std::uint16_t* to = &out[(y + 1) * in.stride + x + 1];
            *to = static_cast<std::uint16_t>(centre);
            if (centre == 0) continue;
            const float sigma = 3.0f * axial_noise_m(static_cast<float>(centre) * in.unit_m) / in.unit_m;
            const float inverse = 1.0f / (2.0f * sigma * sigma);
            float sum = 0, total = 0;
            for (int dy = std::max(-2, -y); dy <= std::min(2, in.height - 1 - y); ++dy)
                for (int dx = std::max(-2, -x); dx <= std::min(2, in.width - 1 - x); ++dx) {
                    const int value = in.at(x + dx, y + dy);
                    if (value == 0) continue;
                    const float d = static_cast<float>(value - centre);
                    // exp(-t) ~ (1 - t/8)^8, zero from t = 8 (4 sigma) on: arithmetic only, the same bits
                    // everywhere.
                    float w = std::max(0.0f, 1.0f - d * d * inverse / 8.0f);
                    w = w * w;
                    w = w * w;
                    w = w * w * kSpatial[dx * dx + dy * dy];
                    sum += w * d;
                    total += w;
                }
            *to = static_cast<std::uint16_t>(std::clamp(centre + round_to_int(sum / total), 1, 65534));
        }
    });
}

void remove_edges(const DepthImage& in, std::uint16_t* out, Jobs& jobs) {
    jobs.run(in.height, [&](int y, int) {
        for (int x = 0; x < in.width; ++x) {
            const int i = (y + 1) * in.stride + x + 1;
            const int centre = in.pixels[i];
            bool edge = false;
            for (const int j : {i - 1, i + 1, i - in.stride, i + in.stride})
                edge |= in.pixels[j] != 0 && across_jump(centre, in.pixels[j]);
            out[i] = edge ? std::uint16_t{0} : static_cast<std::uint16_t>(centre);
        }
    });
}

DepthImage half_sample(const DepthImage& in, std::uint16_t* out) {
    DepthImage half = in;
    half.camera = at_level(in.camera, 1);
    half.width = in.width / 2;
    half.height = in.height / 2;
    half.stride = half.width + 2;
    half.pixels = out;
    half.weights = nullptr;
    half.valid = 0;
    std::fill_n(out, static_cast<std::size_t>(half.stride) * (half.height + 2), std::uint16_t{0});
    for (int y = 0; y < half.height; ++y)
        for (int x = 0; x < half.width; ++x) {
            const int four[4] = {in.at(2 * x, 2 * y), in.at(2 * x + 1, 2 * y), in.at(2 * x, 2 * y + 1),
                                 in.at(2 * x + 1, 2 * y + 1)};
            int nearest = 65535;
            for (const int d : four)
                if (d != 0) nearest = std::min(nearest, d);
            int sum = 0, count = 0;
            for (const int d : four)
                if (d != 0 && !across_jump(d, nearest)) {
                    sum += d;
                    ++count;
                }
            if (count == 0) continue;
            out[(y + 1) * half.stride + x + 1] = static_cast<std::uint16_t>((sum + count / 2) / count);
            ++half.valid;
        }
    return half;
}

Vec3f normal_at(const DepthImage& depth, int x, int y) {
    const int i = (y + 1) * depth.stride + x + 1;
    const int centre = depth.pixels[i];
    if (centre == 0) return {};
    // A neighbour counts when it has depth and belongs to the same surface; otherwise the centre stands in
    // for it.
    const auto usable = [&](int j) { return depth.pixels[j] != 0 && !across_jump(centre, depth.pixels[j]); };
    const bool left = usable(i - 1), right = usable(i + 1), up = usable(i - depth.stride),
               down = usable(i + depth.stride);
    if (!(left || right) || !(up || down)) return {};
    const auto at = [&](bool there, int dx, int dy) {
        const int value = there ? depth.pixels[i + dy * depth.stride + dx] : centre;
        return point_at(depth, there ? x + dx : x, there ? y + dy : y,
                        static_cast<float>(value) * depth.unit_m);
    };
    const Vec3f across = at(right, 1, 0) - at(left, -1, 0), along = at(down, 0, 1) - at(up, 0, -1);
    const Vec3f n = normalised(cross(along, across));  // y down, x right: this order points to the camera
    return n;
}

void compute_normals(const DepthImage& depth, float* normals, Jobs& jobs) {
    jobs.run(depth.height, [&](int y, int) {
        for (int x = 0; x < depth.width; ++x) {
            const Vec3f n = normal_at(depth, x, y);
            float* to = normals + 3 * (static_cast<std::ptrdiff_t>(y) * depth.width + x);
            to[0] = n.x;
            to[1] = n.y;
            to[2] = n.z;
        }
    });
}

}  // namespace burin
