// SPDX-License-Identifier: MIT
#include "eval/mesh_metrics.h"

#include <algorithm>
#include <cmath>
#include <exception>

namespace burin {
namespace {

constexpr std::size_t kBatch = 1024;  // samples a job, about a millisecond

// Uniform in [0, 1) from a counter: the i-th number needs no state, so samples can be drawn in any order. The
// mixing is SplitMix64 (Steele et al. 2014).
double uniform(std::uint64_t seed, std::uint64_t counter) {
    std::uint64_t x = seed * 0xd1342543de82ef95u + (counter + 1) * 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    x ^= x >> 31;
    return static_cast<double>(x >> 11) * 0x1p-53;
}

struct Measured {
    std::vector<double> distance_m;
    std::vector<double> cosine;  // NaN where a normal is missing
};

DistanceStats distance_stats(std::vector<double> distance_m) {
    DistanceStats stats;
    stats.count = static_cast<std::int64_t>(distance_m.size());
    if (distance_m.empty()) return stats;
    double sum = 0, sum_of_squares = 0;
    for (const double d : distance_m) {  // in sample order, whatever thread measured them
        sum += d;
        sum_of_squares += d * d;
    }
    const double n = static_cast<double>(distance_m.size());
    std::sort(distance_m.begin(), distance_m.end());
    const std::size_t half = distance_m.size() / 2;
    stats.mean_m = sum / n;
    stats.rms_m = std::sqrt(sum_of_squares / n);
    stats.median_m =
        distance_m.size() % 2 ? distance_m[half] : 0.5 * (distance_m[half - 1] + distance_m[half]);
    stats.p99_m = distance_m[static_cast<std::size_t>(std::ceil(0.99 * n)) - 1];  // nearest rank
    stats.max_m = distance_m.back();
    return stats;
}

double share_within(const std::vector<double>& distance_m, double threshold_m) {
    const auto count =
        std::count_if(distance_m.begin(), distance_m.end(), [&](double d) { return d <= threshold_m; });
    return static_cast<double>(count) / static_cast<double>(distance_m.size());
}

// Mean of |cosine| and the share of negative ones. False when no sample had two normals.
bool normal_stats(const std::vector<double>& cosine, double* mean, double* negative) {
    double sum = 0, count = 0, below = 0;
    for (const double c : cosine) {
        if (std::isnan(c)) continue;
        sum += std::fabs(c);
        below += c < 0;
        ++count;
    }
    if (count == 0) return false;
    *mean = sum / count;
    *negative = below / count;
    return true;
}

double cosine_between(Vec3d a, Vec3d b) { return dot(a, a) > 0 && dot(b, b) > 0 ? dot(a, b) : std::nan(""); }

Measured measure(const SurfaceSamples& samples, const TriangleBvh& surface, Jobs& jobs) {
    Measured out;
    const std::size_t count = samples.points.size();
    out.distance_m.resize(count);
    out.cosine.assign(count, std::nan(""));
    jobs.run_pieces(count, kBatch, [&](std::size_t i) {
        const ClosestPoint closest = surface.closest(samples.points[i]);
        out.distance_m[i] = closest.distance_m;
        if (!samples.normals.empty())
            out.cosine[i] = cosine_between(samples.normals[i], surface.normal(closest.triangle));
    });
    return out;
}

Measured measure(const SurfaceSamples& samples, const MeshTruth& truth, Jobs& jobs) {
    if (truth.surface) return measure(samples, *truth.surface, jobs);
    Measured out;
    const std::size_t count = samples.points.size();
    out.distance_m.resize(count);
    out.cosine.assign(count, std::nan(""));
    jobs.run_pieces(count, kBatch, [&](std::size_t i) {
        out.distance_m[i] = std::fabs(truth.distance_m(samples.points[i]));
        if (truth.normal) out.cosine[i] = cosine_between(samples.normals[i], truth.normal(samples.points[i]));
    });
    return out;
}

Status check_truth(const MeshTruth& truth, const MeshMetricsOptions& options) {
    if (!truth.surface && !truth.distance_m)
        return Status::error(Code::invalid_argument,
                             "no true surface given, expected a mesh or a distance function");
    if (!truth.samples || truth.samples->points.empty())
        return Status::error(Code::invalid_argument,
                             "no samples on the true surface, expected at least 1 (was any of it seen?)");
    if (!truth.samples->normals.empty() && truth.samples->normals.size() != truth.samples->points.size())
        return Status::error(Code::invalid_argument,
                             "%zu normals of %zu true samples, expected none or one each",
                             truth.samples->normals.size(), truth.samples->points.size());
    for (std::size_t i = 0; i < truth.samples->points.size(); ++i) {
        const Vec3d p = truth.samples->points[i];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
            return Status::error(Code::invalid_argument, "true sample %zu is not finite", i);
    }
    for (const double t : options.thresholds_m)
        if (!(t > 0) || !std::isfinite(t))
            return Status::error(Code::invalid_argument, "threshold is %g m, expected a positive length", t);
    return {};
}

}  // namespace

Result<SurfaceSamples> sample_surface(const TriangleMesh& mesh, int count, std::uint64_t seed,
                                      const SampleFilter& filter, Jobs& jobs) try {
    BURIN_TRY(check_mesh(mesh));
    if (count < 1)
        return Status::error(Code::invalid_argument, "%d samples requested, expected at least 1", count);
    if (mesh.triangles.empty())
        return Status::error(Code::invalid_argument, "the mesh has no triangles, expected a surface");
    // area_m2[i]: of the triangles up to and with i, times two.
    std::vector<double> area_m2(mesh.triangles.size());
    double total = 0;
    for (std::size_t i = 0; i < area_m2.size(); ++i) {
        const auto& t = mesh.triangles[i];
        const Vec3d a = to_double(mesh.positions[t[0]]);
        total += norm(cross(to_double(mesh.positions[t[1]]) - a, to_double(mesh.positions[t[2]]) - a));
        area_m2[i] = total;
    }
    if (!(total > 0) || !std::isfinite(total))
        return Status::error(Code::invalid_argument, "the mesh has an area of %g m2, expected a surface",
                             0.5 * total);

    SurfaceSamples samples;
    samples.points.resize(static_cast<std::size_t>(count));
    samples.normals.resize(static_cast<std::size_t>(count));
    std::vector<std::uint8_t> keep(static_cast<std::size_t>(count), 1);
    jobs.run_pieces(static_cast<std::size_t>(count), kBatch, [&](std::size_t i) {
        const double along = (static_cast<double>(i) + uniform(seed, 3 * i)) / count * total;
        // The first whose sum exceeds the target: never one without area.
        const auto found =
            std::upper_bound(area_m2.begin(), area_m2.end(), std::min(along, std::nextafter(total, 0.0)));
        const auto& t = mesh.triangles[static_cast<std::size_t>(found - area_m2.begin())];
        const Vec3d a = to_double(mesh.positions[t[0]]), ab = to_double(mesh.positions[t[1]]) - a,
                    ac = to_double(mesh.positions[t[2]]) - a;
        // Even over the triangle: Osada et al., "Shape distributions", 2002, eq. 1.
        const double r = std::sqrt(uniform(seed, 3 * i + 1)), s = uniform(seed, 3 * i + 2);
        samples.points[i] = a + ab * (r * (1 - s)) + ac * (r * s);
        samples.normals[i] = normalised(cross(ab, ac));
        if (filter) keep[i] = filter(samples.points[i], samples.normals[i]) ? 1 : 0;
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < keep.size(); ++i) {
        if (!keep[i]) continue;
        samples.points[kept] = samples.points[i];
        samples.normals[kept++] = samples.normals[i];
    }
    samples.points.resize(kept);
    samples.normals.resize(kept);
    return samples;
} catch (const std::exception&) {
    return Status::error(Code::insufficient_memory, "no memory for %d surface samples", count);
}

Result<MeshMetrics> evaluate_mesh(const TriangleMesh& estimate, const MeshTruth& truth,
                                  const MeshMetricsOptions& options, Jobs& jobs) try {
    BURIN_TRY(check_truth(truth, options));
    Result<SurfaceSamples> samples =
        sample_surface(estimate, options.samples, options.seed, options.keep_estimate, jobs);
    if (!samples) return samples.status();
    if (samples->points.empty())
        return Status::error(Code::invalid_argument,
                             "none of %d samples on the estimate is to be counted, expected at least 1",
                             options.samples);
    const Measured accuracy = measure(*samples, truth, jobs);
    for (std::size_t i = 0; i < accuracy.distance_m.size(); ++i)
        if (!std::isfinite(accuracy.distance_m[i]))
            return Status::error(Code::invalid_argument, "the true distance at (%g, %g, %g) is not finite",
                                 samples->points[i].x, samples->points[i].y, samples->points[i].z);
    Result<TriangleBvh> surface = TriangleBvh::build(estimate, jobs);
    if (!surface) return surface.status();
    const Measured completeness = measure(*truth.samples, *surface, jobs);

    MeshMetrics metrics;
    metrics.accuracy = distance_stats(accuracy.distance_m);
    metrics.completeness = distance_stats(completeness.distance_m);
    for (const double t : options.thresholds_m) {
        ThresholdScore score = {t, share_within(accuracy.distance_m, t),
                                share_within(completeness.distance_m, t), 0};
        const double sum = score.precision + score.completeness_ratio;
        score.f_score = sum > 0 ? 2 * score.precision * score.completeness_ratio / sum : 0;
        metrics.scores.push_back(score);
    }
    double there = 0, back = 0, flipped = 0, ignored = 0;
    const bool has_there = normal_stats(accuracy.cosine, &there, &flipped);
    const bool has_back = normal_stats(completeness.cosine, &back, &ignored);
    if (has_there) metrics.flipped_ratio = flipped;
    if (has_there && has_back)
        metrics.normal_consistency = 0.5 * (there + back);
    else if (has_there || has_back)
        metrics.normal_consistency = has_there ? there : back;
    return metrics;
} catch (const std::exception&) {
    return Status::error(Code::insufficient_memory, "no memory to compare meshes by %d samples",
                         options.samples);
}

Result<MeshMetrics> evaluate_mesh(const TriangleMesh& estimate, const TriangleMesh& truth,
                                  const MeshMetricsOptions& options, Jobs& jobs) {
    // Another seed than the estimate's, lest equal meshes be compared in the very same points.
    Result<SurfaceSamples> samples = sample_surface(truth, options.samples, options.seed + 1, {}, jobs);
    if (!samples) return samples.status();
    Result<TriangleBvh> surface = TriangleBvh::build(truth, jobs);
    if (!surface) return surface.status();
    MeshTruth whole;
    whole.surface = &*surface;
    whole.samples = &*samples;
    return evaluate_mesh(estimate, whole, options, jobs);
}

}  // namespace burin
