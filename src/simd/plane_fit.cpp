// SPDX-License-Identifier: MIT
#include "simd/plane_fit.h"

#include <cmath>
#include <cstdlib>

namespace burin::simd {

namespace scalar {

int choose_voxels(const std::int16_t* sdf, const std::uint16_t* weight, std::uint16_t min_weight,
                  std::int16_t band, std::uint8_t* weights) {
    int count = 0;
    for (int i = 0; i < 512; ++i) {
        const bool chosen = weight[i] >= min_weight && sdf[i] <= band && sdf[i] >= -band;
        weights[i] = chosen ? kFullWeight : 0;
        count += chosen;
    }
    return count;
}

void sum_octants(const std::int16_t* sdf, const std::uint8_t* weights, PlaneSums sums[8]) {
    for (int o = 0; o < 8; ++o) sums[o] = {};
    for (int i = 0; i < 512; ++i) {
        const int x = i & 7, y = i >> 3 & 7, z = i >> 6;
        PlaneSums& s = sums[(x >> 2) | (y >> 2) << 1 | (z >> 2) << 2];
        const std::int32_t w = weights[i], f = w * sdf[i], u[3] = {2 * x - 7, 2 * y - 7, 2 * z - 7};
        s.w += w;
        s.f += f;
        int at = 0;
        for (int r = 0; r < 3; ++r) {
            s.u[r] += w * u[r];
            s.fu[r] += f * u[r];
            for (int c = r; c < 3; ++c) s.uu[at++] += w * u[r] * u[c];
        }
    }
}

void plane_residuals(const std::int16_t* sdf, const PlaneModel& model, std::uint16_t* residuals) {
    for (int row = 0; row < 64; ++row) {
        const float y = static_cast<float>(2 * (row & 7) - 7), z = static_cast<float>(2 * (row >> 3) - 7);
        const float base = (model.a[1] * y + model.a[2] * z) + model.c;
        for (int x = 0; x < 8; ++x) {
            const float at = base + model.a[0] * static_cast<float>(2 * x - 7);
            const float r = std::fabs(static_cast<float>(sdf[8 * row + x]) - at);
            residuals[8 * row + x] = static_cast<std::uint16_t>((r < 65535.0f ? r : 65535.0f) + 0.5f);
        }
    }
}

int tukey_weights(const std::uint16_t* residuals, const std::uint8_t* chosen, float cut,
                  std::uint8_t* weights) {
    const float per_cut = 1.0f / cut;
    int sum = 0;
    for (int i = 0; i < 512; ++i) {
        const float t = static_cast<float>(residuals[i]) * per_cut, q = 1.0f - t * t;
        const int w = q > 0 ? static_cast<int>(static_cast<float>(kFullWeight) * (q * q) + 0.5f) : 0;
        weights[i] = static_cast<std::uint8_t>(chosen[i] ? w : 0);
        sum += weights[i];
    }
    return sum;
}

void pull_to_planes(const std::int16_t* sdf, const std::uint16_t* weight, const Pull* pulls, int count,
                    std::int16_t* out) {
    for (int row = 0; row < 64; ++row) {
        const float y = static_cast<float>(2 * (row & 7) - 7), z = static_cast<float>(2 * (row >> 3) - 7);
        for (int x = 0; x < 8; ++x) {
            const int i = 8 * row + x;
            const float f = static_cast<float>(sdf[i]), u = static_cast<float>(2 * x - 7);
            float least = 0, strength = 0, per_reach = 0;
            for (int k = 0; k < count; ++k) {
                const PlaneModel& m = pulls[k].plane;
                const float r = (((m.a[1] * y + m.a[2] * z) + m.c) + m.a[0] * u) - f;
                if (k > 0 && !(std::fabs(r) < std::fabs(least))) continue;
                least = r;
                strength = pulls[k].strength;
                per_reach = 1.0f / pulls[k].reach;
            }
            const float w = static_cast<float>(weight[i]), often = w * (1.0f / kSeenOften);
            const float seen = often < kLeastSeen ? kLeastSeen : often < 1.0f ? often : 1.0f;
            const float t = least * per_reach, q = 1.0f - (t * t) * seen, s = strength * (q * q);
            const float near = least * (s / (w + s));
            const bool stays = !(q > 0) || weight[i] == 0 || sdf[i] > kPullLimit || sdf[i] < -kPullLimit;
            const float to = std::nearbyint(f + near);
            out[i] = stays ? sdf[i]
                           : static_cast<std::int16_t>(to < -32768  ? -32768.0f
                                                       : to > 32767 ? 32767.0f
                                                                    : to);
        }
    }
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
int choose_voxels(const std::int16_t* sdf, const std::uint16_t* weight, std::uint16_t min_weight,
                  std::int16_t band, std::uint8_t* weights) {
    return scalar::choose_voxels(sdf, weight, min_weight, band, weights);
}
void sum_octants(const std::int16_t* sdf, const std::uint8_t* weights, PlaneSums sums[8]) {
    scalar::sum_octants(sdf, weights, sums);
}
void plane_residuals(const std::int16_t* sdf, const PlaneModel& model, std::uint16_t* residuals) {
    scalar::plane_residuals(sdf, model, residuals);
}
int tukey_weights(const std::uint16_t* residuals, const std::uint8_t* chosen, float cut,
                  std::uint8_t* weights) {
    return scalar::tukey_weights(residuals, chosen, cut, weights);
}
void pull_to_planes(const std::int16_t* sdf, const std::uint16_t* weight, const Pull* pulls, int count,
                    std::int16_t* out) {
    scalar::pull_to_planes(sdf, weight, pulls, count, out);
}
#endif

}  // namespace burin::simd
