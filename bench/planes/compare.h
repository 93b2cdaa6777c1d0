// SPDX-License-Identifier: MIT
// Candidates of the chunks of a map: the layer's, from distances, beside the baseline's, from the mesh.
#pragma once

#include "planes/baseline.h"
#include "planes/mapping.h"

namespace burin::bench {

// Against the nearest true plane (within two voxels and 20 degrees, whose outline the centre lies in).
struct CandidateFigures {
    double us_per_chunk = 0;  // one thread, all chunks with surface; the least of three passes
    int found = 0, on_planes = 0;
    std::vector<double> angle_deg, distance_mm;  // of those on planes: normal; centre to true plane
};

struct CandidateComparison {
    int chunks = 0;
    double mesh_us_per_chunk = 0;  // what the baseline's vertices take first
    CandidateFigures distances, ransac;
    // Of chunks and true planes of which both have a candidate.
    std::vector<double> both_least_squares_deg, both_ransac_deg, both_least_squares_mm, both_ransac_mm;
};
CandidateComparison compare_candidates(const Mapping& mapping, const std::vector<LabelledPlane>& truth,
                                       const RansacOptions& options);

}  // namespace burin::bench
