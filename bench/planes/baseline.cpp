// SPDX-License-Identifier: MIT
#include "planes/baseline.h"

#include <cmath>

#include "core/hash.h"
#include "planes/scatter.h"

namespace burin::bench {
namespace {

Scatter scatter_of(const std::vector<Vec3f>& points, const std::vector<std::uint32_t>& members) {
    Scatter s;
    for (const std::uint32_t m : members) {
        const Vec3d p = to_double(points[m]);
        s.n += 1;
        s.p = s.p + p;
        int at = 0;
        for (int r = 0; r < 3; ++r)
            for (int c = r; c < 3; ++c) s.pp[at++] += p[r] * p[c];
    }
    return s;
}

}  // namespace

std::vector<Candidate> ransac_planes(const float* positions, const float* normals, std::uint64_t count,
                                     const RansacOptions& options, std::uint64_t* state) {
    std::vector<Candidate> found;
    if (count < static_cast<std::uint64_t>(options.least)) return found;
    // From the first vertex on, so that single precision does.
    const Vec3d origin{positions[0], positions[1], positions[2]};
    std::vector<Vec3f> points(count), facing(count);
    for (std::uint64_t i = 0; i < count; ++i) {
        points[i] = {positions[3 * i] - positions[0], positions[3 * i + 1] - positions[1],
                     positions[3 * i + 2] - positions[2]};
        facing[i] = {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]};
    }
    const auto reach = static_cast<float>(options.inlier_m);
    while (static_cast<int>(found.size()) < options.most_planes &&
           points.size() >= static_cast<std::size_t>(options.least)) {
        int most = 0;
        Vec3f normal;
        float offset = 0;
        for (int h = 0; h < options.hypotheses; ++h) {
            const auto pick = [&] {
                *state += 0x9e3779b97f4a7c15ULL;
                return points[static_cast<std::size_t>((mix64(*state) >> 32) * points.size() >> 32)];
            };
            const Vec3f a = pick(), b = pick(), c = pick();
            const Vec3f n = cross(b - a, c - a);
            const float length = norm(n);
            if (!(length > 1e-8f)) continue;  // m^2: the same vertex twice, or three in a row
            const Vec3f u = n * (1 / length);
            const float d = -dot(u, a);
            int votes = 0;
            for (const Vec3f& p : points) votes += std::fabs(dot(u, p) + d) <= reach;
            if (votes > most) most = votes, normal = u, offset = d;
        }
        if (most < options.least) break;
        std::vector<std::uint32_t> members;
        Vec3d towards;
        for (std::uint32_t i = 0; i < points.size(); ++i) {
            if (!(std::fabs(dot(normal, points[i]) + offset) <= reach)) continue;
            members.push_back(i);
            towards = towards + to_double(facing[i]);
        }
        const PlaneFit fit = fit_plane(scatter_of(points, members), towards);
        found.push_back({fit.normal, fit.centroid + origin, static_cast<int>(members.size())});
        std::size_t kept = 0, m = 0;
        for (std::uint32_t i = 0; i < points.size(); ++i) {
            if (m < members.size() && members[m] == i) {
                ++m;
                continue;
            }
            points[kept] = points[i];
            facing[kept++] = facing[i];
        }
        points.resize(kept);
        facing.resize(kept);
    }
    return found;
}

}  // namespace burin::bench
