// SPDX-License-Identifier: MIT
// The specification of the integration kernels. tsdf_highway.cpp computes the same bits many lanes at a time.
#include "simd/tsdf.h"

#include <algorithm>
#include <cstdlib>

#include "core/rounding.h"

namespace burin::simd {
namespace {

constexpr float kScale = 32767.0f;

// Weight factor behind the surface, in 1/256, for `behind` = -distance in stored units (0..32767).
// Arithmetic only, no libm: the same bits everywhere. exp(-y) ~ (1 - y/16)^16, within 0.02 of it for y in
// 0..5.
inline int drop_factor(const FuseModel& model, float behind) {
    if (behind <= model.drop_start) return 256;
    const float x = (behind - model.drop_start) * model.drop_scale;
    if (model.drop == Drop::linear) return round_to_int(256.0f * (1.0f - x));
    float y = 1.0f - 5.0f / 16.0f * x * x;  // 5: the weight at the truncation distance is below 1 %
    y = y * y;
    y = y * y;
    y = y * y;
    return round_to_int(256.0f * (y * y));
}

inline int observation_weight(std::int16_t distance, const std::uint16_t* weights, int i,
                              const FuseModel& model) {
    int w = weights ? weights[i] : kWeightOne;
    if (model.drop != Drop::none && distance < 0)
        w = w * drop_factor(model, -static_cast<float>(distance)) >> 8;
    return w;
}

inline void average(std::int16_t distance, int w, const FuseModel& model, std::int16_t* sdf,
                    std::uint16_t* sum) {
    const int before = *sum;
    const float step =
        static_cast<float>(w) * static_cast<float>(distance - *sdf) / static_cast<float>(before + w);
    *sdf = static_cast<std::int16_t>(*sdf + round_to_int(step));
    *sum = static_cast<std::uint16_t>(std::min<int>(before + w, model.max_weight));
}

}  // namespace

namespace scalar {

Observation observe_chunk(const DepthWindow& window, const ProjectiveOffsets& offsets, ProjectiveBase base,
                          const TruncationModel& truncation, std::int16_t* distances,
                          std::uint16_t* weights) {
    const float u_max = static_cast<float>(window.width) + 1.0f,
                v_max = static_cast<float>(window.height) + 1.0f;
    const float to_units = kScale / truncation.truncation_m;
    Observation seen{false, false};
    for (int i = 0; i < kChunkVoxels; ++i) {
        const float z = base.z + offsets.z[i];
        const float inverse_z = 1.0f / std::max(z, kLeastZ);
        // Nearest pixel in the bordered image: + 1 for the border, + 0.5 for rounding by truncation.
        const float u = std::min(std::max((base.u + offsets.u[i]) * inverse_z + 1.5f, 0.0f), u_max);
        const float v = std::min(std::max((base.v + offsets.v[i]) * inverse_z + 1.5f, 0.0f), v_max);
        const int pixel = static_cast<int>(v) * window.stride + static_cast<int>(u);
        const std::uint16_t raw = window.pixels[pixel];
        const float depth_m = static_cast<float>(raw) * window.unit_m;
        float tau = truncation.truncation_m;
        if (truncation.quadratic)
            tau = std::max(truncation.floor_m,
                           (truncation.a * depth_m + truncation.b) * depth_m + truncation.c);
        const float s = depth_m - z;
        const bool hit = raw != 0 && s > -tau && z > kLeastZ;
        const int distance = hit ? round_to_int(std::min(s * to_units, kScale)) : kUnseen;
        distances[i] = static_cast<std::int16_t>(distance);
        if (weights) weights[i] = window.weights[pixel];
        seen.touched |= hit && distance != kFree && (!truncation.quadratic || s < tau);
        seen.free |= distance == kFree;
    }
    return seen;
}

int fuse_distances(const std::int16_t* distances, const std::uint16_t* weights, const FuseModel& model,
                   std::int16_t* sdf, std::uint16_t* weight_sum) {
    int least = kFree;
    for (int i = 0; i < kChunkVoxels; ++i) {
        if (distances[i] == kUnseen) continue;
        const int w = observation_weight(distances[i], weights, i, model);
        if (w == 0) continue;
        average(distances[i], w, model, &sdf[i], &weight_sum[i]);
        least = std::min(least, std::abs(static_cast<int>(sdf[i])));
    }
    return least;
}

int carve_distances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                    const FuseModel& model, std::int16_t* sdf, std::uint16_t* weight_sum) {
    int least = kFree;
    bool changed = false;
    for (int i = 0; i < kChunkVoxels; ++i) {
        if (weight_sum[i] == 0) continue;
        if (distances[i] == kFree && sdf[i] != kFree) {
            average(distances[i], times * (weights ? weights[i] : kWeightOne), model, &sdf[i],
                    &weight_sum[i]);
            changed = true;
        }
        least = std::min(least, std::abs(static_cast<int>(sdf[i])));
    }
    return changed ? least : -1;
}

void fuse_colours(const std::int16_t* distances, const ColourWindow& window, const ProjectiveOffsets& offsets,
                  ProjectiveBase base, const ColourModel& model, std::uint8_t* colours) {
    const std::int32_t last =
        static_cast<std::int32_t>((window.height - 1) * window.stride + 3 * window.width - 4);
    for (int i = 0; i < kChunkVoxels; ++i) {
        if (distances[i] > model.band || distances[i] < -model.band) continue;
        const float z = base.z + offsets.z[i];
        const float inverse_z = 1.0f / std::max(z, kLeastZ);
        float u = (base.u + offsets.u[i]) * inverse_z, v = (base.v + offsets.v[i]) * inverse_z;
        if (window.distorted) {
            const float x = (u - window.cx) / window.fx, y = (v - window.cy) / window.fy, xx = x * x,
                        yy = y * y;
            const float r2 = xx + yy, two_xy = 2.0f * (x * y);
            const float radial = 1.0f + r2 * (window.k1 + r2 * (window.k2 + r2 * window.k3));
            u = window.fx * (x * radial + (window.p1 * two_xy + window.p2 * (r2 + 2.0f * xx))) + window.cx;
            v = window.fy * (y * radial + (window.p1 * (r2 + 2.0f * yy) + window.p2 * two_xy)) + window.cy;
        }
        u += 0.5f;
        v += 0.5f;
        if (!(z > kLeastZ && u >= 0.0f && v >= 0.0f && u < static_cast<float>(window.width) &&
              v < static_cast<float>(window.height)))
            continue;
        const std::int32_t offset =
            static_cast<int>(v) * static_cast<std::int32_t>(window.stride) + 3 * static_cast<int>(u);
        if (offset > last) continue;
        const std::uint8_t* reading = window.rgb + offset;
        std::uint8_t* colour = colours + 4 * i;
        const int count = colour[3];
        // Threshold in 0..255: an odd multiplier walks through all residues over voxels and over frames.
        const int threshold =
            static_cast<int>((static_cast<std::uint32_t>(i) * 167u + model.frame * 101u) & 255u);
        const float scale = 256.0f / static_cast<float>(count + 1);
        for (int k = 0; k < 3; ++k) {
            const int scaled = static_cast<int>(static_cast<float>(colour[k] * count + reading[k]) * scale);
            colour[k] = static_cast<std::uint8_t>(std::min((scaled + threshold) >> 8, 255));
        }
        colour[3] = static_cast<std::uint8_t>(std::min(count + 1, kColourMemory));
    }
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
Observation observe_chunk(const DepthWindow& window, const ProjectiveOffsets& offsets, ProjectiveBase base,
                          const TruncationModel& truncation, std::int16_t* distances,
                          std::uint16_t* weights) {
    return scalar::observe_chunk(window, offsets, base, truncation, distances, weights);
}
int fuse_distances(const std::int16_t* distances, const std::uint16_t* weights, const FuseModel& model,
                   std::int16_t* sdf, std::uint16_t* weight_sum) {
    return scalar::fuse_distances(distances, weights, model, sdf, weight_sum);
}
int carve_distances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                    const FuseModel& model, std::int16_t* sdf, std::uint16_t* weight_sum) {
    return scalar::carve_distances(distances, weights, times, model, sdf, weight_sum);
}
void fuse_colours(const std::int16_t* distances, const ColourWindow& window, const ProjectiveOffsets& offsets,
                  ProjectiveBase base, const ColourModel& model, std::uint8_t* colours) {
    scalar::fuse_colours(distances, window, offsets, base, model, colours);
}
#endif

}  // namespace burin::simd
