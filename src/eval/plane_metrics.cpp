// SPDX-License-Identifier: MIT
#include "eval/plane_metrics.h"

#include <algorithm>
#include <cmath>

namespace burin {
namespace {

constexpr double kDegrees = 180 / 3.14159265358979323846;
// What is shown as the best candidate of a plane that fits none: farther away it is another plane.
constexpr double kCandidateAngleDeg = 30, kCandidateOffset = 0.1;

double angle_deg(Vec3d a, Vec3d b) {
    return std::atan2(norm(cross(a, b)), dot(a, b)) * kDegrees;  // acos would lose what is below 1e-8
}

struct Judged {
    PlanePair pair;
    const char* reason = nullptr;  // nullptr: fits
};

// Everything that lies near one another.
std::vector<Judged> candidates(const std::vector<LabelledPlane>& found,
                               const std::vector<LabelledPlane>& truth, const PlaneMatchOptions& options) {
    std::vector<PlaneRaster> found_cells;
    for (const LabelledPlane& plane : found)
        found_cells.emplace_back(plane.normal, plane.offset, plane.rings, options.cell_m);
    std::vector<Judged> out;
    for (std::size_t t = 0; t < truth.size(); ++t) {
        const LabelledPlane& plane = truth[t];
        const PlaneRaster cells(plane.normal, plane.offset, plane.rings, options.cell_m);
        std::vector<Vec3d> centres;
        for (std::size_t c = 0; c < cells.size(); ++c)
            if (cells.inside(c)) centres.push_back(cells.centre(c));
        for (std::size_t f = 0; f < found.size(); ++f) {
            PlanePair pair = {static_cast<int>(t), static_cast<int>(f), 0, 0, 0};
            pair.angle_deg = angle_deg(plane.normal, found[f].normal);
            if (std::min(pair.angle_deg, 180 - pair.angle_deg) > kCandidateAngleDeg) continue;
            Vec3d sum;
            double count = 0;
            for (const Vec3d& p : centres) {
                if (!found_cells[f].contains(p)) continue;
                sum = sum + p;
                ++count;
            }
            if (count == 0) continue;
            pair.overlap_m2 = count * cells.cell_area_m2();
            pair.offset_m = dot(found[f].normal, sum * (1 / count)) + found[f].offset;
            if (std::fabs(pair.offset_m) > kCandidateOffset) continue;
            const double smaller = std::min(cells.area_m2(), found_cells[f].area_m2());
            const char* reason = nullptr;
            if (pair.angle_deg > options.max_angle_deg)
                reason = "normal";
            else if (std::fabs(pair.offset_m) > options.max_offset_m)
                reason = "offset";
            else if (pair.overlap_m2 < options.min_overlap_share * smaller)
                reason = "overlap";
            out.push_back({pair, reason});
        }
    }
    // Larger overlaps first; the order of the lists where they are equal.
    std::stable_sort(out.begin(), out.end(),
                     [](const Judged& a, const Judged& b) { return a.pair.overlap_m2 > b.pair.overlap_m2; });
    return out;
}

double median(std::vector<double> values) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    const std::size_t half = values.size() / 2;
    return values.size() % 2 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

// Why no candidate did: the first one that the selection keeps is the best.
template <class Mine>
PlaneFault fault_of(int plane, const std::vector<Judged>& all, const Mine& mine) {
    PlaneFault fault = {plane, {}, "nothing there"};
    const Judged* best = nullptr;
    for (const Judged& j : all)
        // One that fits (and is taken by another) explains more than a larger one that does not.
        if (mine(j.pair) && (!best || (best->reason && !j.reason))) best = &j;
    if (best) {
        fault.best = best->pair;
        fault.reason = best->reason ? best->reason : "taken";
    }
    return fault;
}

}  // namespace

PlaneMatches match_planes(const std::vector<LabelledPlane>& found, const std::vector<LabelledPlane>& truth,
                          const PlaneMatchOptions& options) {
    const std::vector<Judged> all = candidates(found, truth, options);
    const auto counts = [&](int t) {
        return truth[static_cast<std::size_t>(t)].seen_area_m2 >= options.min_area_m2;
    };
    PlaneMatches out;
    std::vector<std::uint8_t> true_taken(truth.size(), 0), found_taken(found.size(), 0),
        found_fits(found.size(), 0);
    std::vector<double> angles, offsets;
    for (const Judged& j : all) {
        if (j.reason) continue;
        const auto t = static_cast<std::size_t>(j.pair.truth), f = static_cast<std::size_t>(j.pair.found);
        found_fits[f] = 1;
        if (!counts(j.pair.truth) || true_taken[t] || found_taken[f]) continue;
        true_taken[t] = found_taken[f] = 1;
        out.pairs.push_back(j.pair);
        angles.push_back(j.pair.angle_deg);
        offsets.push_back(std::fabs(j.pair.offset_m));
    }
    std::vector<std::uint8_t> extra(found.size(), 0);
    for (const Judged& j : all)
        if (!j.reason && true_taken[static_cast<std::size_t>(j.pair.truth)])
            extra[static_cast<std::size_t>(j.pair.found)] = 1;
    for (std::size_t f = 0; f < found.size(); ++f) out.split += extra[f] && !found_taken[f];

    for (int t = 0; t < static_cast<int>(truth.size()); ++t) {
        if (!counts(t)) continue;
        ++out.true_planes;
        if (!true_taken[static_cast<std::size_t>(t)])
            out.missed.push_back(fault_of(t, all, [&](const PlanePair& p) { return p.truth == t; }));
    }
    for (int f = 0; f < static_cast<int>(found.size()); ++f) {
        if (found[static_cast<std::size_t>(f)].area_m2 < options.min_area_m2) continue;
        ++out.found_planes;
        if (!found_fits[static_cast<std::size_t>(f)])
            out.invented.push_back(fault_of(f, all, [&](const PlanePair& p) { return p.found == f; }));
    }
    if (out.true_planes > 0) out.recall = static_cast<double>(out.pairs.size()) / out.true_planes;
    if (out.found_planes > 0) out.precision = 1 - static_cast<double>(out.invented.size()) / out.found_planes;
    out.median_angle_deg = median(angles);
    out.median_offset_m = median(offsets);
    for (const double a : angles) out.worst_angle_deg = std::max(out.worst_angle_deg, a);
    for (const double o : offsets) out.worst_offset_m = std::max(out.worst_offset_m, o);
    return out;
}

}  // namespace burin
