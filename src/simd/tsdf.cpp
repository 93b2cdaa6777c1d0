// SPDX-License-Identifier: MIT
// The specification of the integration kernels. tsdf_highway.cpp computes the same bits many lanes at a time.
#include "simd/tsdf.h"

#include <algorithm>
#include <cstdlib>

#include "core/rounding.h"

namespace burin::simd {
namespace {

constexpr float kScale = 32767.0f;

// Weight factor behind the surface, in 1/256, for `behind` = -s > start, at truncation tau > start; all in
// stored units. Arithmetic only, no libm: the same bits everywhere. exp(-y) ~ (1 - y/16)^16, within 0.02 of
// it for y in 0..5.
inline int drop_factor(Drop drop, float behind, float start, float tau) {
    const float x = (behind - start) * (1.0f / (tau - start));
    if (drop == Drop::linear) return round_to_int(256.0f * (1.0f - x));
    float y = 1.0f - 5.0f / 16.0f * x * x;  // 5: the weight at the truncation distance is below 1 %
    y = y * y;
    y = y * y;
    y = y * y;
    return round_to_int(256.0f * (y * y));
}

inline void average(int distance, int w, int max_weight, std::int16_t* sdf, std::uint16_t* sum) {
    const int total = *sum + w;
    const float step = static_cast<float>(w * (distance - *sdf)) / static_cast<float>(total);
    *sdf = static_cast<std::int16_t>(*sdf + round_to_int(step));
    *sum = static_cast<std::uint16_t>(std::min(total, max_weight));
}

// The same where every observation weighs kWeightOne: a step of more than 16 bits can't be.
inline void average_constant(int distance, int max_weight, std::int16_t* sdf, std::uint16_t* sum) {
    const int total = *sum + kWeightOne;
    if (*sum == 0) {
        *sdf = static_cast<std::int16_t>(distance);
    } else {
        const int share = round_to_int(32768.0f * kWeightOne / static_cast<float>(total));
        const int step = ((distance * share + 16384) >> 15) - ((*sdf * share + 16384) >> 15);
        *sdf = static_cast<std::int16_t>(*sdf + std::clamp(step, -32768, 32767));
    }
    *sum = static_cast<std::uint16_t>(std::min(total, max_weight));
}

}  // namespace

float TruncationModel::at(float depth_m) const {
    return quadratic ? std::max(floor_m, (a * depth_m + b) * depth_m + c) : truncation_m;
}

namespace scalar {

Observation observe_chunk(const DepthProjection& frame, const ProjectedChunk& chunk, std::int16_t* distances,
                          std::uint16_t* weights, const void*) {
    if (chunk.pixels != Pixels::exact) return observe_groups(frame, chunk, distances);
    const float u_max = static_cast<float>(frame.width) + 1.0f,
                v_max = static_cast<float>(frame.height) + 1.0f;
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
        const float tau = frame.truncation.quadratic
                              ? frame.truncation.at(static_cast<float>(raw) * frame.unit_m) * to_units
                              : kScale;
        int distance = round_to_int(std::min(std::max(s, -32768.0f), kScale));
        if (raw == 0 || !(z > least_z) || (frame.truncation.quadratic && !(s > -tau))) distance = kUnseen;
        seen.touched |= distance != kUnseen && distance != kFree && (!frame.truncation.quadratic || s < tau);
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
                   std::int16_t* sdf, std::uint16_t* weight_sum, std::uint16_t near, std::uint16_t* moved) {
    int least = kFree, most = 0;
    for (int i = 0; i < kChunkVoxels; ++i) {
        if (distances[i] == kUnseen) continue;
        const int before = sdf[i];
        const bool fresh = weight_sum[i] == 0;
        if (weights)
            average(distances[i], weights[i], max_weight, &sdf[i], &weight_sum[i]);
        else
            average_constant(distances[i], max_weight, &sdf[i], &weight_sum[i]);
        const int after = std::abs(static_cast<int>(sdf[i]));
        least = std::min(least, after);
        if (after <= near || (!fresh && std::abs(before) <= near))
            most = std::max(most, fresh ? 65535 : std::abs(sdf[i] - before));
    }
    if (moved) *moved = static_cast<std::uint16_t>(most);
    return least;
}

int carve_distances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                    std::uint16_t max_weight, std::int16_t* sdf, std::uint16_t* weight_sum) {
    int least = kFree;
    bool changed = false;
    for (int i = 0; i < kChunkVoxels; ++i) {
        if (weight_sum[i] == 0) continue;
        if (distances[i] == kFree && sdf[i] != kFree) {
            average(distances[i], times * (weights ? weights[i] : kWeightOne), max_weight, &sdf[i],
                    &weight_sum[i]);
            changed = true;
        }
        least = std::min(least, std::abs(static_cast<int>(sdf[i])));
    }
    return changed ? least : -1;
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
Observation observe_chunk(const DepthProjection& frame, const ProjectedChunk& chunk, std::int16_t* distances,
                          std::uint16_t* weights, const void* ahead) {
    return scalar::observe_chunk(frame, chunk, distances, weights, ahead);
}
int fuse_distances(const std::int16_t* distances, const std::uint16_t* weights, std::uint16_t max_weight,
                   std::int16_t* sdf, std::uint16_t* weight_sum, std::uint16_t near, std::uint16_t* moved) {
    return scalar::fuse_distances(distances, weights, max_weight, sdf, weight_sum, near, moved);
}
int carve_distances(const std::int16_t* distances, const std::uint16_t* weights, int times,
                    std::uint16_t max_weight, std::int16_t* sdf, std::uint16_t* weight_sum) {
    return scalar::carve_distances(distances, weights, times, max_weight, sdf, weight_sum);
}
#endif

}  // namespace burin::simd
