// SPDX-License-Identifier: MIT
#include "track/residuals.h"

namespace burin {

double ResidualBins::median() const {
    std::uint64_t total = 0;
    for (const std::uint32_t bin : bins) total += bin;
    std::uint64_t below = 0;
    for (int i = 0; i < kBins; ++i) {
        if (2 * (below + bins[i]) >= total && bins[i] > 0) {
            const double into = (0.5 * static_cast<double>(total) - static_cast<double>(below)) / bins[i];
            return (i + into) / static_cast<double>(kPerUnit);
        }
        below += bins[i];
    }
    return 0;
}

Measured measured_of(const ResidualItem* items, int count, int considered, double scale) {
    Measured out;
    ResidualBins bins;
    bins.clear();
    for (int i = 0; i < count; ++i) {
        out.system.add(items[i].sums);
        bins.add(items[i].bins);
        out.known += items[i].known;
        out.close += items[i].close;
    }
    out.system.finish(1 / scale);
    out.median = bins.median() * scale;
    out.considered = out.depth_points = considered;
    return out;
}

}  // namespace burin
