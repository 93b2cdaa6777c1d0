// SPDX-License-Identifier: MIT
// Ray against scene: the half spaces at once, the rest cell by cell through the grid (Amanatides & Woo 1987),
// each solid by sphere tracing (Hart 1996) on its own distance field. Convex solids take Newton steps
// instead: along a ray their distance is a convex function, so a tangent never passes the root, and a flat
// face is met in one step at any angle. All others step by their distance until the sign changes, and the
// crossing is then found by regula falsi.
#include <algorithm>
#include <cmath>
#include <limits>

#include "datasets/synthetic/scene.h"

namespace burin {

using synthetic::Part;
using synthetic::Shape;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A convex solid is hit when it is this near (metres): the depth error is this over the cosine of incidence,
// under 1e-6 m down to 0.06 degrees of grazing.
constexpr double kHitDistance = 1e-9;
// Below this slope (cosine of incidence) a ray no longer comes nearer: it passes by.
constexpr double kGrazing = 1e-7;
constexpr int kNewtonRounds = 64;
// Smallest step of sphere tracing (metres): a sliver thinner than this along the ray may be stepped over.
constexpr double kMinStep = 2e-6;
// Nearer than this the step is the secant's prediction, at most twice the distance, to end the slow approach
// at grazing angles; a feature missed that way is smaller than half a millimetre along the ray.
constexpr double kSecantDistance = 2.5e-4;
constexpr int kMaxSteps = 20000;

}  // namespace

double SyntheticScene::trace_convex(const Part& part, Vec3d origin, Vec3d direction, double t0,
                                    double t1) const {
    const Vec3d o = part.to_part(origin), v = part.R_part_scene * direction;
    double t = t0;
    Vec3d g;
    for (int round = 0; round < kNewtonRounds; ++round) {
        const double d = synthetic::part_distance(part, o + v * t, &g);
        if (d < kHitDistance) return t;
        const double slope = dot(g, v);
        if (slope > -kGrazing) return kInfinity;
        t -= d / slope;
        if (t > t1) return kInfinity;
    }
    return kInfinity;
}

double SyntheticScene::trace_field(Range items, Vec3d origin, Vec3d direction, double t0, double t1) const {
    double t = t0, d = fold(items, origin + direction * t);
    if (d <= 0) return t0;
    double step = d;
    for (int i = 0; i < kMaxSteps; ++i) {
        if (t >= t1) return kInfinity;
        const double next = std::min(t + std::max(step, kMinStep), t1);
        const double d_next = fold(items, origin + direction * next);
        if (d_next <= 0) {
            double a = t, b = next, da = d, db = d_next;  // da > 0 >= db
            for (int round = 0; round < 60 && b - a > 1e-10; ++round) {
                // The Illinois variant halves the weight of an end that stays; each third round bisects.
                double m = round % 3 == 2 ? 0.5 * (a + b) : a + (b - a) * da / (da - db);
                if (!(m > a && m < b)) m = 0.5 * (a + b);
                const double dm = fold(items, origin + direction * m);
                if (dm > 0)
                    a = m, da = dm, db *= 0.5;
                else
                    b = m, db = dm, da *= 0.5;
                if (db > -1e-18) db = -1e-18;
            }
            return b;
        }
        step = d_next;
        if (d_next < kSecantDistance && d_next < d) {
            const double predicted = 1.02 * d_next * (next - t) / (d - d_next);
            step = std::clamp(predicted, d_next, 2 * d_next);
        }
        t = next;
        d = d_next;
    }
    return kInfinity;
}

SyntheticScene::Hit SyntheticScene::trace(Vec3d origin, Vec3d direction, double max_distance) const {
    Hit hit{kInfinity, -1};
    double limit = max_distance;
    for (std::uint16_t i : half_spaces_) {
        const Part& part = data_.parts[i];
        const Vec3d n{part.R_part_scene.m[6], part.R_part_scene.m[7], part.R_part_scene.m[8]};
        const double slope = dot(n, direction);
        if (slope >= 0) continue;
        const double t = -dot(n, origin - part.position) / slope;
        if (t >= 0 && t < limit) hit = {t, i}, limit = t;
    }

    // Clip the ray to the grid.
    double t_in = 0, t_out = limit;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = data_.bounds.low[axis] - origin[axis];
        const double high = low + size_[axis] * data_.cell;
        if (direction[axis] == 0) {
            if (low > 0 || high < 0) return hit;
            continue;
        }
        const double a = low / direction[axis], b = high / direction[axis];
        t_in = std::max(t_in, std::min(a, b));
        t_out = std::min(t_out, std::max(a, b));
    }
    if (!(t_in < t_out)) return hit;

    int cell[3], step[3];
    double next[3], delta[3];
    for (int axis = 0; axis < 3; ++axis) {
        const double x = (origin[axis] + direction[axis] * t_in - data_.bounds.low[axis]) / data_.cell;
        cell[axis] = std::clamp(static_cast<int>(std::floor(x)), 0, size_[axis] - 1);
        step[axis] = direction[axis] > 0 ? 1 : -1;
        if (direction[axis] == 0) {
            next[axis] = delta[axis] = kInfinity;
        } else {
            const double border = data_.bounds.low[axis] + (cell[axis] + (step[axis] > 0)) * data_.cell;
            next[axis] = (border - origin[axis]) / direction[axis];
            delta[axis] = data_.cell / std::fabs(direction[axis]);
        }
    }
    double t = t_in;
    while (t < limit) {
        const int axis = next[0] <= next[1] ? (next[0] <= next[2] ? 0 : 2) : (next[1] <= next[2] ? 1 : 2);
        const double leave = std::min(next[axis], t_out);
        const std::size_t index =
            (static_cast<std::size_t>(cell[2]) * size_[1] + cell[1]) * size_[0] + cell[0];
        const std::uint16_t* end = crossing_.data() + crossing_begin_[index + 1];
        for (const std::uint16_t* i = crossing_.data() + crossing_begin_[index]; i != end;) {
            const Part& part = data_.parts[*i];
            const std::uint16_t* j = i + 1;
            while (part.blend >= 0 && j != end && data_.parts[*j].blend == part.blend) ++j;
            const double far = std::min(leave, limit);
            const double found = part.blend < 0 && is_convex(part.shape)
                                     ? trace_convex(part, origin, direction, t, far)
                                     : trace_field({i, j}, origin, direction, t, far);
            if (found < limit) {
                limit = found;
                hit = {found, *i};
                if (part.blend >= 0) hit.part = nearest({i, j}, origin + direction * found).part;
            }
            i = j;
        }
        if (limit <= leave) break;
        t = leave;
        cell[axis] += step[axis];
        if (cell[axis] < 0 || cell[axis] >= size_[axis]) break;
        next[axis] += delta[axis];
    }
    return hit;
}

}  // namespace burin
