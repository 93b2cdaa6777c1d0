// SPDX-License-Identifier: MIT
// The sums of a camera's normal equations, from residuals and gradients at the points of a depth image: the
// step that tracking against the field (Bylow 2013) and against a raycast (KinectFusion 2011) share.
#pragma once

#include <cstdint>

#include "simd/sample.h"

namespace burin::simd {

// Every sum is kept in 16 lanes, point i in lane i % 16, whatever the width of the vectors: the same bits
// everywhere.
inline constexpr int kTrackLanes = 16;
enum : int {
    kTrackA = 0,        // sum w J_r J_c, rows of the upper triangle: 21
    kTrackB = 21,       // sum w J_r u: 6
    kTrackCost = 27,    // sum of the robust function
    kTrackPoints = 28,  // points that count, and of those the ones inside the robust threshold
    kTrackInliers = 29,
    kTrackTerms = 30,
};
using TrackSums = float[kTrackTerms][kTrackLanes];

// Of up to kSampleBatch points. All arrays but `distance` and `gradient` may be read, not used, up to the
// next multiple of 16; those two, and `normalised`, have kSampleBatch elements.
struct TrackSamples {
    const float *x, *y, *z;        // camera coordinates, metres
    const float* inverse_sigma;    // 1 / standard deviation of the point along its ray, 1 / metres
    const float* distance;         // residual, metres; NaN: none
    const float* const* gradient;  // three arrays: of the distance by the point, in the axes of the reference
};

struct TrackRobust {
    float inverse_scale;  // of residuals in sigmas
    float threshold;      // Huber's k or Tukey's c, in scaled sigmas
    bool tukey;
    float limit_m;  // larger residuals are no correspondence
};

// With g = R^T gradient (R row-major, camera to reference axes), J = inverse_sigma (g, p x g), u =
// inverse_sigma distance inverse_scale: adds the terms above, where w is
//   Huber: min(1, k / |u|), cost u^2 / 2 inside k, else k (|u| - k / 2)
//   Tukey: (1 - (u/c)^2)^2, cost c^2 / 6 (1 - (1 - (u/c)^2)^3), 0 and c^2 / 6 outside
// J in A and B is not divided by the scale. normalised[i] = |u|, or -1 for points that do not count.
void track_sums(const TrackSamples& samples, int count, const float R[9], const TrackRobust& robust,
                TrackSums sums, float* normalised);

namespace scalar {
void track_sums(const TrackSamples& samples, int count, const float R[9], const TrackRobust& robust,
                TrackSums sums, float* normalised);
}

}  // namespace burin::simd
