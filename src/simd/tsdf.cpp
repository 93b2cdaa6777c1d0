// SPDX-License-Identifier: MIT
// The specification of the integration kernels. tsdf_highway.cpp computes the same bits many lanes at a time.
#include "simd/tsdf.h"

#include <algorithm>
#include <cstdlib>

#include "core/rounding.h"

namespace burin::simd {
namespace {

constexpr float kScale = 32767.0f;

// Weight factor behind the surface, in 1/256, for `behind` = -s > start, at truncation tau > start; all in stored
// units. Arithmetic only, no libm: the same bits everywhere. exp(-y) ~ (1 - y/16)^16, within 0.02 of it for y
// in 0..5.
inline int drop_factor(Drop drop, float behind, float start, float tau) {
    const float x = (behind - start) * (1.0f / (tau - start));
    if (drop == Drop::linear) return round_to_int(256.0f * (1.0f - x));
    float y = 1.0f - 5.0f / 16.0f * x * x;  // 5: the weight at the truncation distance is below 1 %
    y = y * y;
    y = y * y;
    y = y * y;
    return round_to_int(256.0f * (y * y));
}

// limit: of a step.
inline void average(int distance, int w, int max_weight, float limit, std::int16_t* sdf,
                    std::uint16_t* sum) {
    const int total = *sum + w;
    const float step = static_cast<float>(w * (distance - *sdf)) / static_cast<float>(total);
    *sdf = static_cast<std::int16_t>(*sdf + round_to_int(std::min(std::max(step, -limit), limit)));
    *sum = static_cast<std::uint16_t>(std::min(total, max_weight));
}

}  // namespace

float TruncationModel::at(float depth_m) const {
    return quadratic ? std::max(floor_m, (a * depth_m + b) * depth_m + c) : truncation_m;
}

namespace scalar {

Observation observe_chunk(const DepthProjection& frame, const ProjectedChunk& chunk, std::int16_t* distances,
                          std::uint16_t* weights, const void*) {
    const float u_max = static_cast<float>(frame.width) + 1.0f, v_max = static_cast<float>(frame.height) + 1.0f;
    const float to_units = frame.truncation.units_per_m();
    const float unit = frame.unit_m * to_units, least_z = kLeastZ * to_units,
                start = frame.drop_start_m * to_units;
    Observation seen{false, false};
    for (int i = 0; i < kChunkVoxels; ++i) {
        const ProjectiveOffsets::Block& block =
            frame.offsets.block[(i >> 2 & 1) + 2 * (i >> 5 & 1) + 4 * (i >> 6)];
        const int at = 4 * (i >> 3 & 3) + (i & 3);
        const float z = chunk.z + block.z[at];
        const float inverse_z = 1.0f / std::max(z, least_z);
        const float u = std::min(std::max((chunk.u + block.u[at]) * inverse_z, 0.0f), u_max);
        const float v = std::min(std::max((chunk.v + block.v[at]) * inverse_z, 0.0f), v_max);
        const int pixel = round_to_int(v) * frame.stride + round_to_int(u);
        const std::uint16_t raw = frame.pixels[pixel];
        const float s = (static_cast<float>(raw) * unit - z) * chunk.along;
        const float tau =
            frame.truncation.quadratic
                ? frame.truncation.at(static_cast<float>(raw) * frame.unit_m) * to_units
                : kScale;
        int distance = round_to_int(std::min(std::max(s, -32768.0f), kScale));
        if (raw == 0 || !(z > least_z) || (frame.truncation.quadratic && !(s > -tau))) distance = kUnseen;
        seen.touched |=
            distance != kUnseen && distance != kFree && (!frame.truncation.quadratic || s < tau);
        seen.free |= distance == kFree;
        distances[i] = static_cast<std::int16_t>(distance);
        if (!frame.weighted()) continue;
        int w = frame.weights ? frame.weights[pixel] : kWeightOne;
        if (frame.drop != Drop::none && distance != kUnseen && -s > start)
            w = w * drop_factor(frame.drop, -s, start, tau) >> 8;
        weights[i] = static_cast<std::uint16_t>(w);
        if (w == 0) distances[i] = kUnseen;
    }
    return seen;
}

int fuse_distances(const std::int16_t* distances, const std::uint16_t* weights, std::uint16_t max_weight,
                   std::int16_t* sdf, std::uint16_t* weight_sum) {
    int least = kFree;
    for (int i = 0; i < kChunkVoxels; ++i) {
        if (distances[i] == kUnseen) continue;
        average(distances[i], weights ? weights[i] : kWeightOne, max_weight, weights ? 65535.0f : kScale,
                &sdf[i], &weight_sum[i]);
        least = std::min(least, std::abs(static_cast<int>(sdf[i])));
    }
    return least;
}

int carve_distances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                    std::uint16_t max_weight, std::int16_t* sdf, std::uint16_t* weight_sum) {
    int least = kFree;
    bool changed = false;
    for (int i = 0; i < kChunkVoxels; ++i) {
        if (weight_sum[i] == 0) continue;
        if (distances[i] == kFree && sdf[i] != kFree) {
            average(distances[i], times * (weights ? weights[i] : kWeightOne), max_weight, 65535.0f, &sdf[i],
                    &weight_sum[i]);
            changed = true;
        }
        least = std::min(least, std::abs(static_cast<int>(sdf[i])));
    }
    return changed ? least : -1;
}

void fuse_colours(const std::int16_t* distances, const ColourWindow& window, const ColourOffsets& offsets,
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
Observation observe_chunk(const DepthProjection& frame, const ProjectedChunk& chunk, std::int16_t* distances,
                          std::uint16_t* weights, const void* ahead) {
    return scalar::observe_chunk(frame, chunk, distances, weights, ahead);
}
int fuse_distances(const std::int16_t* distances, const std::uint16_t* weights, std::uint16_t max_weight,
                   std::int16_t* sdf, std::uint16_t* weight_sum) {
    return scalar::fuse_distances(distances, weights, max_weight, sdf, weight_sum);
}
int carve_distances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                    std::uint16_t max_weight, std::int16_t* sdf, std::uint16_t* weight_sum) {
    return scalar::carve_distances(distances, weights, times, max_weight, sdf, weight_sum);
}
void fuse_colours(const std::int16_t* distances, const ColourWindow& window, const ColourOffsets& offsets,
                  ProjectiveBase base, const ColourModel& model, std::uint8_t* colours) {
    scalar::fuse_colours(distances, window, offsets, base, model, colours);
}
#endif

}  // namespace burin::simd
