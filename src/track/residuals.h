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
inline constexpr int kMostItems = (TrackPoints::kMostPoints + kPointsPerItem - 1) / kPointsPerItem;

// Huber's k: 95 % efficiency on normal residuals (Huber 1964). Tukey's biweight lost on the noise of
// structured light (prototype: 10.6 mm for 7.6 mm).
inline constexpr float kHuber = 1.345f;

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
};

// All items into one.
Measured measured_of(const ResidualItem* items, int count, int considered, double scale);

}  // namespace burin
