// SPDX-License-Identifier: MIT
#include "depth/filters.h"

#include <algorithm>

#include "depth/row_blocks.h"

namespace burin {
namespace {

simd::DepthRow row_of(const DepthImage& image, int y) {
    return {image.pixels + image.offset(0, y), image.stride, image.width, image.unit_m};
}

simd::RayModel rays_of(const Camera& c) {
    return {static_cast<float>(c.cx), static_cast<float>(c.cy), 1.0f / static_cast<float>(c.fx),
            1.0f / static_cast<float>(c.fy)};
}

}  // namespace

void bilateral_filter(const DepthImage& in, std::uint16_t* out, Jobs& jobs) {
    for_row_blocks(in.height, jobs, [&](int y) {
        simd::bilateral_row(row_of(in, y), std::min(2, y), std::min(2, in.height - 1 - y),
                            out + in.offset(0, y));
    });
}

void remove_edges(const DepthImage& in, std::uint16_t* out, Jobs& jobs) {
    for_row_blocks(in.height, jobs,
                   [&](int y) { simd::remove_edges_row(row_of(in, y), out + in.offset(0, y)); });
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
                if (d != 0 && !simd::across_jump(d, nearest)) {
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
    float n[3];
    simd::scalar::normal_at(row_of(depth, y), rays_of(depth.camera), x, y, n);
    return {n[0], n[1], n[2]};
}

void compute_normals(const DepthImage& depth, float* normals, Jobs& jobs) {
    for_row_blocks(depth.height, jobs, [&](int y) {
        simd::normals_row(row_of(depth, y), rays_of(depth.camera), y,
                          normals + 3 * static_cast<std::ptrdiff_t>(y) * depth.width);
    });
}

void observation_weights(const DepthImage& depth, const simd::WeightModel& model, std::uint16_t* weights,
                         Jobs& jobs) {
    for_row_blocks(depth.height, jobs, [&](int y) {
        simd::weights_row(row_of(depth, y), rays_of(depth.camera), y, model, weights + depth.offset(0, y));
    });
}

}  // namespace burin
