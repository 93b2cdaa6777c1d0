// SPDX-License-Identifier: MIT
// The sums over one level's points that every geometric measurement ends in, item by item, in a fixed order.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "track/descent.h"

namespace burin {

// Points an item: some 10 us of work.
inline constexpr int kPointsPerItem = 512;
constexpr int items_of(int points) { return (points + kPointsPerItem - 1) / kPointsPerItem; }
inline constexpr int kMostItems = items_of(TrackPoints::kMostPoints);

// body(first, count) for the points of one item, kSampleBatch or fewer at a time.
template <class Body>
void in_batches(int points, int item, Body&& body) {
    const int end = std::min(points, (item + 1) * kPointsPerItem);
    for (int first = item * kPointsPerItem; first < end; first += simd::kSampleBatch)
        body(first, std::min(simd::kSampleBatch, end - first));
}

// Huber's k: 95 % efficiency on normal residuals (Huber 1964). Tukey's biweight lost on the noise of
// structured light (prototype: 10.6 mm for 7.6 mm).
inline constexpr float kHuber = 1.345f;
inline simd::TrackRobust huber(double scale, float limit_m) {
    return {static_cast<float>(1 / scale), kHuber, false, limit_m};
}

// |residual| in 1/16 scaled standard deviations; the last bin is all beyond 16.
struct ResidualBins {
    static constexpr int kBins = 256;
    static constexpr float kPerUnit = 16;
    std::uint32_t bins[kBins];

    void clear() { std::memset(bins, 0, sizeof bins); }
    void add(float normalised) {
        if (normalised >= 0) ++bins[static_cast<int>(std::min(normalised * kPerUnit, kBins - 1.0f))];
    }
    void add(const ResidualBins& other) {
        for (int i = 0; i < kBins; ++i) bins[i] += other.bins[i];
    }
    double median() const;  // interpolated inside its bin, in scaled standard deviations; 0 of nothing
};

struct ResidualItem {
    simd::TrackSums sums;
    ResidualBins bins;
    int known = 0, close = 0;  // see Measured

    void clear() {
        std::memset(sums, 0, sizeof sums);
        bins.clear();
        known = close = 0;
    }
    // What track_sums says of a batch; `limit`: of the close ones, in scaled standard deviations.
    void take(const float* normalised, int count, float limit) {
        for (int i = 0; i < count; ++i) {
            bins.add(normalised[i]);
            close += normalised[i] >= 0 && normalised[i] < limit;
        }
    }
};

// All items into one.
Measured measured_of(const ResidualItem* items, int count, int considered, double scale);

}  // namespace burin
