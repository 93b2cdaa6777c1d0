// SPDX-License-Identifier: MIT
// Absolute trajectory error and relative pose error as the TUM RGB-D benchmark defines them (Sturm et al., "A
// benchmark for the evaluation of RGB-D SLAM systems", IROS 2012; its tools evaluate_ate.py and
// evaluate_rpe.py). Trajectories are read only; positions in metres.
#pragma once

#include <cstdint>
#include <vector>

#include "core/status.h"
#include "core/trajectory.h"

namespace burin {

struct ErrorStats {
    double rmse = 0, mean = 0, median = 0, max = 0;
    double std_dev = 0;  // of the population, as numpy.std
    std::int64_t count = 0;
};
// All zero for no values. The order of the values does not matter.
ErrorStats error_stats(std::vector<double> values);

enum class Alignment {
    none,  // compare in the given world frames
    se3,   // Horn: best rotation and translation
    sim3,  // Umeyama: and scale, for trajectories without metric scale
};

struct PosePair {
    int estimate = 0, truth = 0;  // indices
};

// Pairs stamps less than max_gap_ns apart, closest first, each pose used once; ascending in the estimate. The
// default is TUM's 20 ms. Error: a trajectory that is empty or not strictly ascending in time, or stamps so
// dense that over 50 million pairs lie within the gap.
inline constexpr std::int64_t kAssociationGapNs = 20'000'000;
Result<std::vector<PosePair>> associate(const Trajectory& estimate, const Trajectory& truth,
                                        std::int64_t max_gap_ns = kAssociationGapNs);

struct AbsoluteError {
    ErrorStats translation_m;
    Se3 T_truth_estimate;  // p_truth ~ R (scale * p_estimate) + t; identity for Alignment::none
    double scale = 1;
    std::vector<PosePair> pairs;
    std::vector<double> error_m;  // one per pair
};

// ATE. Error: as associate(); fewer than 3 pairs (no overlap in time); with an alignment, all positions of
// one trajectory equal, since no rotation follows from them.
Result<AbsoluteError> absolute_error(const Trajectory& estimate, const Trajectory& truth, Alignment alignment,
                                     std::int64_t max_gap_ns = kAssociationGapNs);

struct RelativeDelta {
    enum class Unit { seconds, frames } unit = Unit::seconds;
    double value = 1;  // seconds, or poses of the estimate
};

struct RelativeError {
    ErrorStats translation_m;
    ErrorStats rotation_rad;
};

// RPE over a fixed delta: for every pose of the estimate and the one closest to `delta` later, the difference
// of the two relative motions. As evaluate_rpe.py: poses pair with the closest true stamp and are skipped
// where that is more than two median truth intervals off; pairs that end in the last pose are left out (there
// "closest" may be clamped). Unlike it, all pairs count, not a random 10000. Needs no alignment. Error: as
// associate(); fewer than 2 pairs.
Result<RelativeError> relative_error(const Trajectory& estimate, const Trajectory& truth,
                                     RelativeDelta delta);

// Sum of the distances between consecutive positions, metres.
double path_length_m(const Trajectory& trajectory);

}  // namespace burin
