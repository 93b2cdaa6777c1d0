// SPDX-License-Identifier: MIT
#include "eval/trajectory.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace burin {
namespace {

Status check_stamps(const Trajectory& trajectory, const char* what) {
    if (trajectory.empty()) return Status::error(Code::invalid_argument, "the %s trajectory is empty", what);
    for (std::size_t i = 1; i < trajectory.size(); ++i)
        if (trajectory[i].t_ns <= trajectory[i - 1].t_ns)
            return Status::error(
                Code::invalid_argument,
                "pose %zu of the %s trajectory has stamp %.9f s after %.9f s, expected ascending stamps", i,
                what, static_cast<double>(trajectory[i].t_ns) * 1e-9,
                static_cast<double>(trajectory[i - 1].t_ns) * 1e-9);
    for (std::size_t i = 0; i < trajectory.size(); ++i) {
        const Vec3d t = trajectory[i].T_world_camera.t;
        if (!std::isfinite(t.x) || !std::isfinite(t.y) || !std::isfinite(t.z))
            return Status::error(Code::invalid_argument, "pose %zu of the %s trajectory is not finite", i,
                                 what);
    }
    return {};
}

Eigen::Vector3d position(const StampedPose& pose) {
    const Vec3d t = pose.T_world_camera.t;
    return {t.x, t.y, t.z};
}

// Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI 1991, eqs
// 34-42; without scale it is Horn's / Arun's closed form.
Status align(const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& to,
             bool with_scale, AbsoluteError* out) {
    const double n = static_cast<double>(from.size());
    Eigen::Vector3d from_mean = Eigen::Vector3d::Zero(), to_mean = from_mean;
    for (std::size_t i = 0; i < from.size(); ++i) {
        from_mean += from[i];
        to_mean += to[i];
    }
    from_mean /= n;
    to_mean /= n;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    double from_variance = 0, to_variance = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
        const Eigen::Vector3d a = from[i] - from_mean, b = to[i] - to_mean;
        covariance += b * a.transpose() / n;
        from_variance += a.squaredNorm() / n;
        to_variance += b.squaredNorm() / n;
    }
    constexpr double kLeastSpread =
        1e-9;  // metres; below it positions differ by the rounding of the file only
    if (from_variance < kLeastSpread * kLeastSpread || to_variance < kLeastSpread * kLeastSpread)
        return Status::error(
            Code::invalid_argument,
            "all %zu matched positions of the %s trajectory are equal, expected motion to align by",
            from.size(), from_variance < to_variance ? "estimated" : "true");
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d sign(1, 1, 1);
    if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) sign.z() = -1;  // no reflections
    const Eigen::Matrix3d R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
    out->scale = with_scale ? svd.singularValues().dot(sign) / from_variance : 1.0;
    const Eigen::Vector3d t = to_mean - out->scale * (R * from_mean);
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) out->T_truth_estimate.R(r, c) = R(r, c);
    out->T_truth_estimate.t = {t.x(), t.y(), t.z()};
    return {};
}

// Index of the pose with the closest stamp; of two equally close the earlier.
std::size_t closest(const Trajectory& trajectory, double t_ns) {
    const auto after =
        std::lower_bound(trajectory.begin(), trajectory.end(), t_ns,
                         [](const StampedPose& p, double t) { return static_cast<double>(p.t_ns) < t; });
    const std::size_t i = static_cast<std::size_t>(after - trajectory.begin());
    if (i == 0) return 0;
    if (i == trajectory.size()) return i - 1;
    const double before_gap = t_ns - static_cast<double>(trajectory[i - 1].t_ns);
    return before_gap <= static_cast<double>(trajectory[i].t_ns) - t_ns ? i - 1 : i;
}

double median_of(std::vector<double> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    if (values.size() % 2) return *middle;
    return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

// The angle of a rotation. atan2 of sine and cosine: acos of the trace alone loses everything below 1e-8 rad.
double angle_rad(const Mat3d& R) {
    const Vec3d axis = {R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1)};
    return std::atan2(norm(axis), R(0, 0) + R(1, 1) + R(2, 2) - 1);
}

}  // namespace

ErrorStats error_stats(std::vector<double> values) {
    ErrorStats stats;
    if (values.empty()) return stats;
    std::sort(values.begin(), values.end());  // the sums then do not depend on the order given
    const double n = static_cast<double>(values.size());
    double sum = 0, sum_of_squares = 0, sum_of_deviations = 0;
    for (const double v : values) {
        sum += v;
        sum_of_squares += v * v;
    }
    stats.mean = sum / n;
    for (const double v : values) sum_of_deviations += (v - stats.mean) * (v - stats.mean);
    stats.count = static_cast<std::int64_t>(values.size());
    stats.rmse = std::sqrt(sum_of_squares / n);
    stats.std_dev = std::sqrt(sum_of_deviations / n);
    stats.median = median_of(values);
    stats.max = values.back();
    return stats;
}

Result<std::vector<PosePair>> associate(const Trajectory& estimate, const Trajectory& truth,
                                        std::int64_t max_gap_ns) {
    BURIN_TRY(check_stamps(estimate, "estimated"));
    BURIN_TRY(check_stamps(truth, "true"));
    struct Candidate {
        std::int64_t gap_ns;
        int truth, estimate;
    };
    std::vector<Candidate> candidates;
    constexpr std::size_t kMaxCandidates = 50'000'000;  // 800 MB
    std::size_t first = 0;
    for (std::size_t e = 0; e < estimate.size(); ++e) {
        const std::int64_t t_ns = estimate[e].t_ns;
        while (first < truth.size() && t_ns - truth[first].t_ns >= max_gap_ns) ++first;
        for (std::size_t i = first; i < truth.size() && truth[i].t_ns - t_ns < max_gap_ns; ++i) {
            if (candidates.size() == kMaxCandidates)
                return Status::error(
                    Code::invalid_argument,
                    "over %zu stamp pairs lie within %.3f s, expected a gap near the frame time",
                    kMaxCandidates, static_cast<double>(max_gap_ns) * 1e-9);
            candidates.push_back({std::abs(truth[i].t_ns - t_ns), static_cast<int>(i), static_cast<int>(e)});
        }
    }
    // Closest first, as TUM's associate.py; equal gaps in the order of its tuples.
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
        if (a.gap_ns != b.gap_ns) return a.gap_ns < b.gap_ns;
        if (a.truth != b.truth) return a.truth < b.truth;
        return a.estimate < b.estimate;
    });
    std::vector<int> truth_of(estimate.size(), -1);
    std::vector<bool> taken(truth.size(), false);
    for (const Candidate& c : candidates) {
        if (taken[static_cast<std::size_t>(c.truth)] || truth_of[static_cast<std::size_t>(c.estimate)] >= 0)
            continue;
        taken[static_cast<std::size_t>(c.truth)] = true;
        truth_of[static_cast<std::size_t>(c.estimate)] = c.truth;
    }
    std::vector<PosePair> pairs;
    for (std::size_t e = 0; e < estimate.size(); ++e)
        if (truth_of[e] >= 0) pairs.push_back({static_cast<int>(e), truth_of[e]});
    return pairs;
}

Result<AbsoluteError> absolute_error(const Trajectory& estimate, const Trajectory& truth, Alignment alignment,
                                     std::int64_t max_gap_ns) {
    Result<std::vector<PosePair>> pairs = associate(estimate, truth, max_gap_ns);
    if (!pairs) return pairs.status();
    constexpr std::size_t kLeastPairs = 3;  // two positions leave the rotation about their line free
    if (pairs->size() < kLeastPairs)
        return Status::error(
            Code::invalid_argument,
            "%zu of %zu estimated poses have a true pose within %.3f s, expected at least %zu", pairs->size(),
            estimate.size(), static_cast<double>(max_gap_ns) * 1e-9, kLeastPairs);
    AbsoluteError out;
    out.pairs = std::move(*pairs);
    std::vector<Eigen::Vector3d> from, to;
    for (const PosePair& pair : out.pairs) {
        from.push_back(position(estimate[static_cast<std::size_t>(pair.estimate)]));
        to.push_back(position(truth[static_cast<std::size_t>(pair.truth)]));
    }
    if (alignment != Alignment::none) BURIN_TRY(align(from, to, alignment == Alignment::sim3, &out));
    for (std::size_t i = 0; i < from.size(); ++i) {
        const Eigen::Vector3d scaled = out.scale * from[i];
        const Vec3d aligned = out.T_truth_estimate * Vec3d{scaled.x(), scaled.y(), scaled.z()};
        out.error_m.push_back(norm(aligned - Vec3d{to[i].x(), to[i].y(), to[i].z()}));
    }
    out.translation_m = error_stats(out.error_m);
    return out;
}

Result<RelativeError> relative_error(const Trajectory& estimate, const Trajectory& truth,
                                     RelativeDelta delta) {
    BURIN_TRY(check_stamps(estimate, "estimated"));
    BURIN_TRY(check_stamps(truth, "true"));
    const bool by_frame = delta.unit == RelativeDelta::Unit::frames;
    if (!(delta.value > 0) || !std::isfinite(delta.value) ||
        (by_frame && delta.value != std::floor(delta.value)))
        return Status::error(Code::invalid_argument, "RPE delta is %g, expected a positive %s", delta.value,
                             by_frame ? "whole number of frames" : "number of seconds");

    std::vector<double> intervals;
    for (std::size_t i = 1; i < truth.size(); ++i)
        intervals.push_back(static_cast<double>(truth[i].t_ns - truth[i - 1].t_ns));
    const double max_gap_ns = 2 * median_of(std::move(intervals));

    std::vector<double> translation_m, rotation_rad;
    for (std::size_t i = 0; i < estimate.size(); ++i) {
        std::size_t j = by_frame
                            ? static_cast<std::size_t>(std::min(static_cast<double>(i) + delta.value,
                                                                static_cast<double>(estimate.size() - 1)))
                            : closest(estimate, static_cast<double>(estimate[i].t_ns) + delta.value * 1e9);
        if (j + 1 >= estimate.size()) continue;
        const double t_i = static_cast<double>(estimate[i].t_ns), t_j = static_cast<double>(estimate[j].t_ns);
        const StampedPose &truth_i = truth[closest(truth, t_i)], &truth_j = truth[closest(truth, t_j)];
        if (std::fabs(static_cast<double>(truth_i.t_ns) - t_i) > max_gap_ns ||
            std::fabs(static_cast<double>(truth_j.t_ns) - t_j) > max_gap_ns)
            continue;
        const Se3 estimated = estimate[i].T_world_camera.inverse() * estimate[j].T_world_camera;
        const Se3 actual = truth_i.T_world_camera.inverse() * truth_j.T_world_camera;
        // The order of evaluate_rpe.py (the paper's eq. 1 has the factors swapped): its figures are what is
        // published.
        const Se3 error = estimated * actual.inverse();
        translation_m.push_back(norm(error.t));
        rotation_rad.push_back(angle_rad(error.R));
    }
    if (translation_m.size() < 2)
        return Status::error(
            Code::invalid_argument,
            "%zu pose pairs are %g %s apart with true poses beside them, expected at least 2",
            translation_m.size(), delta.value, by_frame ? "frames" : "s");
    return RelativeError{error_stats(std::move(translation_m)), error_stats(std::move(rotation_rad))};
}

double path_length_m(const Trajectory& trajectory) {
    double length = 0;
    for (std::size_t i = 1; i < trajectory.size(); ++i)
        length += norm(trajectory[i].T_world_camera.t - trajectory[i - 1].T_world_camera.t);
    return length;
}

}  // namespace burin
