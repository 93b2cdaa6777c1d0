// SPDX-License-Identifier: MIT
#include "simd/tsdf.h"

#include <algorithm>
#include <cstdlib>

#include "core/rounding.h"

namespace burin::simd {
namespace {

constexpr float kScale = 32767.0f;

// Weight factor behind the surface, in 1/256, for `behind` = -distance in stored units (0..32767).
// Arithmetic only, no libm: the same bits everywhere. exp(-y) ~ (1 - y/16)^16, within 0.02 of it for y in 0..5.
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

inline int observation_weight(std::int16_t distance, const std::uint16_t* weights, int i, const FuseModel& model) {
    int w = weights ? weights[i] : kWeightOne;
    if (model.drop != Drop::none && distance < 0) w = w * drop_factor(model, -static_cast<float>(distance)) >> 8;
    return w;
}

inline void average(std::int16_t distance, int w, const FuseModel& model, std::int16_t* sdf, std::uint16_t* sum) {
    const int before = *sum;
    const float step = static_cast<float>(w) * static_cast<float>(distance - *sdf) / static_cast<float>(before + w);
    *sdf = static_cast<std::int16_t>(*sdf + round_to_int(step));
    *sum = static_cast<std::uint16_t>(std::min<int>(before + w, model.max_weight));
}

}  // namespace

Observation observe_chunk(const DepthWindow& window, const ProjectiveOffsets& offsets, ProjectiveBase base,
                          const TruncationModel& truncation, std::int16_t* distances, std::uint16_t* weights) {
    const float u_max = static_cast<float>(window.width) + 1.0f, v_max = static_cast<float>(window.height) + 1.0f;
    const float to_units = kScale / truncation.truncation_m;
    Observation seen{false, false};
    for (int i = 0; i < kChunkVoxels; ++i) {
        const float z = base.z + offsets.z[i];
        const float inverse_z = 1.0f / z;
        // Nearest pixel in the bordered image: + 1 for the border, + 0.5 for rounding by truncation.
        // The order of the arguments makes NaN (z = 0) come out as 0, the border.
        const float u = std::min(u_max, std::max(0.0f, (base.u + offsets.u[i]) * inverse_z + 1.5f));
        const float v = std::min(v_max, std::max(0.0f, (base.v + offsets.v[i]) * inverse_z + 1.5f));
        const int pixel = static_cast<int>(v) * window.stride + static_cast<int>(u);
        const std::uint16_t raw = z > 0.0f ? window.pixels[pixel] : std::uint16_t{0};
        const float depth_m = static_cast<float>(raw) * window.unit_m;
        float tau = truncation.truncation_m;
        if (truncation.quadratic)
            tau = std::max(truncation.floor_m, (truncation.a * depth_m + truncation.b) * depth_m + truncation.c);
        const float s = depth_m - z;
        const bool hit = raw != 0 && s > -tau;
        distances[i] = !hit ? kUnseen
                       : s >= truncation.truncation_m ? kFree
                                                      : static_cast<std::int16_t>(round_to_int(s * to_units));
        if (weights) weights[i] = window.weights[pixel];
        seen.touched |= hit && s < tau;
        seen.free |= distances[i] == kFree;
    }
    return seen;
}

int fuse_distances(const std::int16_t* distances, const std::uint16_t* weights, const FuseModel& model,
                   std::int16_t* sdf, std::uint16_t* weight_sum) {
    int least = kFree;
    for (int i = 0; i < kChunkVoxels; ++i) {
        if (distances[i] != kUnseen) {
            const int w = observation_weight(distances[i], weights, i, model);
            if (w > 0) average(distances[i], w, model, &sdf[i], &weight_sum[i]);
        }
        if (weight_sum[i] > 0) least = std::min(least, std::abs(static_cast<int>(sdf[i])));
    }
    return least;
}

bool carve_distances(const std::int16_t* distances, const std::uint16_t* weights, const FuseModel& model,
                     std::int16_t* sdf, std::uint16_t* weight_sum) {
    bool changed = false;
    for (int i = 0; i < kChunkVoxels; ++i) {
        if (distances[i] != kFree || weight_sum[i] == 0 || sdf[i] == kFree) continue;
        const int w = observation_weight(distances[i], weights, i, model);
        average(distances[i], w, model, &sdf[i], &weight_sum[i]);
        changed = true;
    }
    return changed;
}

void fuse_colours(const std::int16_t* distances, const ColourWindow& window, const ProjectiveOffsets& offsets,
                  ProjectiveBase base, const ColourModel& model, std::uint8_t* colours) {
    for (int i = 0; i < kChunkVoxels; ++i) {
        if (distances[i] > model.band || distances[i] < -model.band) continue;
        const float z = base.z + offsets.z[i];
        if (!(z > 0.0f)) continue;
        float u = (base.u + offsets.u[i]) / z, v = (base.v + offsets.v[i]) / z;
        if (window.distorted) {
            const float x = (u - window.cx) / window.fx, y = (v - window.cy) / window.fy, r2 = x * x + y * y;
            const float radial = 1.0f + r2 * (window.k1 + r2 * (window.k2 + r2 * window.k3));
            u = window.fx * (x * radial + 2.0f * window.p1 * x * y + window.p2 * (r2 + 2.0f * x * x)) + window.cx;
            v = window.fy * (y * radial + window.p1 * (r2 + 2.0f * y * y) + 2.0f * window.p2 * x * y) + window.cy;
        }
        u += 0.5f;
        v += 0.5f;
        if (!(u >= 0.0f && v >= 0.0f && u < static_cast<float>(window.width) && v < static_cast<float>(window.height)))
            continue;
        const std::uint8_t* reading =
            window.rgb + static_cast<int>(v) * window.stride + 3 * static_cast<std::ptrdiff_t>(static_cast<int>(u));
        std::uint8_t* colour = colours + 4 * i;
        const int count = colour[3] + 1;
        // Threshold in 0..255: an odd multiplier walks through all residues over voxels and over frames.
        const int threshold = static_cast<int>((static_cast<std::uint32_t>(i) * 167u + model.frame * 101u) & 255u);
        for (int k = 0; k < 3; ++k) {
            const int scaled = (colour[k] * (count - 1) + reading[k]) * 256 / count + threshold;
            colour[k] = static_cast<std::uint8_t>(std::min(scaled >> 8, 255));
        }
        colour[3] = static_cast<std::uint8_t>(std::min(count, kColourMemory));
    }
}

}  // namespace burin::simd
