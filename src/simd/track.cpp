// SPDX-License-Identifier: MIT
// The specification of track_sums. track_highway.cpp computes the same bits.
#include "simd/track.h"

#include <cmath>

namespace burin::simd {
namespace scalar {

void track_sums(const TrackSamples& in, int count, const float R[9], const TrackRobust& robust,
                TrackSums sums, float* normalised) {
    const float k = robust.threshold, inverse_k = 1.0f / k;
    for (int i = 0; i < count; ++i) {
        const float d = in.distance[i];
        if (!(std::fabs(d) < robust.limit_m)) {
            normalised[i] = -1.0f;
            continue;
        }
        const float s = in.inverse_sigma[i], x = in.x[i], y = in.y[i], z = in.z[i];
        const float g0 = in.gradient[0][i] * s, g1 = in.gradient[1][i] * s, g2 = in.gradient[2][i] * s;
        float j[6];
        for (int c = 0; c < 3; ++c) j[c] = (R[c] * g0 + R[3 + c] * g1) + R[6 + c] * g2;
        j[3] = y * j[2] - z * j[1];
        j[4] = z * j[0] - x * j[2];
        j[5] = x * j[1] - y * j[0];
        const float u = (d * s) * robust.inverse_scale;
        const float a = std::fabs(u);
        // Comparisons and choices, no least or largest: those differ over NaN between targets.
        float w, cost;
        if (robust.tukey) {
            const float q = u * inverse_k;
            const float inside = 1.0f - q * q;
            const float rest = inside > 0 ? inside : 0.0f;
            w = rest * rest;
            cost = (k * k * (1.0f / 6.0f)) * (1.0f - w * rest);
        } else {
            w = a > k ? k / a : 1.0f;
            cost = a < k ? 0.5f * (u * u) : k * (a - 0.5f * k);
        }
        normalised[i] = a;
        const int lane = i % kTrackLanes;
        int term = kTrackA;
        for (int r = 0; r < 6; ++r) {
            const float wj = w * j[r];
            for (int c = r; c < 6; ++c) sums[term++][lane] += wj * j[c];
            sums[kTrackB + r][lane] += wj * u;
        }
        sums[kTrackCost][lane] += cost;
        sums[kTrackPoints][lane] += 1.0f;
        sums[kTrackInliers][lane] += a < k ? 1.0f : 0.0f;
    }
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
void track_sums(const TrackSamples& in, int count, const float R[9], const TrackRobust& robust,
                TrackSums sums, float* normalised) {
    scalar::track_sums(in, count, R, robust, sums, normalised);
}
#endif

}  // namespace burin::simd
