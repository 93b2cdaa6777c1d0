// SPDX-License-Identifier: MIT
// How far a reconstructed surface is from the true one. Points are drawn from each surface evenly by area and
// their distance to the other *surface* is measured (not to other samples, which would add the sample
// spacing). Metrics as in Knapitsch et al., "Tanks and Temples" (2017) and NICE-SLAM / NICER-SLAM. All
// lengths in metres.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/jobs.h"
#include "core/status.h"
#include "core/triangle_mesh.h"
#include "eval/triangle_bvh.h"

namespace burin {

struct SurfaceSamples {
    std::vector<Vec3d> points;
    std::vector<Vec3d> normals;  // unit, one per point, or empty; zero where there is none
};

// Whether a sample counts, e.g. whether some frame saw it. Called from several threads at once.
using SampleFilter = std::function<bool(Vec3d point, Vec3d normal)>;

// Draws `count` points evenly by area (stratified along the cumulative area) with the normal of their
// triangle, then drops those the filter (if any) rejects. The same points for the same mesh, count and seed,
// whatever the threads. Error: check_mesh, no triangles, no area, count < 1.
Result<SurfaceSamples> sample_surface(const TriangleMesh& mesh, int count, std::uint64_t seed,
                                      const SampleFilter& filter, Jobs& jobs);

// The truth: a surface to measure to (one of the first two) and points on that part of it which should have
// been reconstructed. Everything is referenced, not owned; the functions are called from several threads at
// once.
struct MeshTruth {
    const TriangleBvh* surface = nullptr;
    std::function<double(Vec3d)> distance_m;  // analytic distance to the surface; the sign is ignored
    std::function<Vec3d(Vec3d)>
        normal;  // with distance_m, may be empty: unit normal of the surface near a point
    const SurfaceSamples* samples = nullptr;
};

struct MeshMetricsOptions {
    int samples = 500'000;  // on the estimate; means over two spheres repeat within 0.02 % between seeds
    std::uint64_t seed = 1;
    std::vector<double> thresholds_m = {0.05};  // 5 cm is the threshold of NICE-SLAM and its followers
    SampleFilter keep_estimate;                 // limits the accuracy side, may be empty
};

struct DistanceStats {
    std::int64_t count = 0;
    double mean_m = 0, median_m = 0, rms_m = 0, p99_m = 0, max_m = 0;
};

struct ThresholdScore {
    double threshold_m = 0;
    double precision = 0;           // share of the estimate within the threshold of the truth
    double completeness_ratio = 0;  // share of the truth within the threshold of the estimate (recall)
    double f_score = 0;             // harmonic mean of the two
};

struct MeshMetrics {
    DistanceStats accuracy;              // estimate -> truth
    DistanceStats completeness;          // truth -> estimate
    std::vector<ThresholdScore> scores;  // one per threshold, in the order given
    // Mean |cosine| between the normals of a sample and of the closest point, averaged over both directions
    // (Mescheder et al., "Occupancy Networks", 2019); -1 when the truth has no normals.
    double normal_consistency = -1;
    double flipped_ratio = -1;  // share of the estimate whose normal points away from the true one, or -1
};

// Error: check_mesh or no triangles for the estimate, no truth to measure to, no samples left on either side,
// a threshold that is not positive, an analytic distance that is not finite, memory.
Result<MeshMetrics> evaluate_mesh(const TriangleMesh& estimate, const MeshTruth& truth,
                                  const MeshMetricsOptions& options, Jobs& jobs);

// The whole of a mesh as truth; as many samples on it as on the estimate.
Result<MeshMetrics> evaluate_mesh(const TriangleMesh& estimate, const TriangleMesh& truth,
                                  const MeshMetricsOptions& options, Jobs& jobs);

}  // namespace burin
