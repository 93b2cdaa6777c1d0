// SPDX-License-Identifier: MIT
#include "eval/triangle_bvh.h"

#include <algorithm>
#include <cmath>

#include "eval/ray_triangle.h"

namespace burin {
namespace {

// A split deeper than 60 halves the items (triangle_bvh_build.cpp), and each level leaves one entry behind.
constexpr int kStackSize = 96;

double box_distance_squared(Vec3f low, Vec3f high, Vec3d p) {
    const double x = std::max({low.x - p.x, p.x - high.x, 0.0}),
                 y = std::max({low.y - p.y, p.y - high.y, 0.0}),
                 z = std::max({low.z - p.z, p.z - high.z, 0.0});
    return x * x + y * y + z * z;
}

struct Candidate {
    double distance_squared;
    Vec3d point;
    Barycentric weights;
};

// Closest point on the segment ab; `s` is its place between them.
Candidate closest_on_segment(Vec3d p, Vec3d a, Vec3d b, double* s) {
    const Vec3d ab = b - a;
    const double length_squared = dot(ab, ab);
    *s = length_squared > 0 ? std::clamp(dot(p - a, ab) / length_squared, 0.0, 1.0) : 0.0;
    const Vec3d q = *s == 1 ? b : a + ab * *s;
    return {dot(p - q, p - q), q, {}};
}

Candidate closest_on_border(Vec3d p, Vec3d a, Vec3d b, Vec3d c) {
    double s = 0;
    Candidate best = closest_on_segment(p, a, b, &s);
    best.weights = {1 - s, s, 0};
    Candidate other = closest_on_segment(p, b, c, &s);
    other.weights = {0, 1 - s, s};
    if (other.distance_squared < best.distance_squared) best = other;
    other = closest_on_segment(p, c, a, &s);
    other.weights = {s, 0, 1 - s};
    if (other.distance_squared < best.distance_squared) best = other;
    return best;
}

// The foot of the perpendicular when it falls into the triangle, otherwise a point of the border.
Candidate closest_on_triangle(Vec3d p, Vec3d a, Vec3d b, Vec3d c) {
    const Vec3d ab = b - a, ac = c - a, ap = p - a;
    const Vec3d n = cross(ab, ac);  // its square is 4 area^2
    const double n2 = dot(n, n);
    // The weights below carry an error of about 1e-16 / sin^2 of the angle at a, leaving out the interior one
    // of about sin: they meet at sin = 5e-6.
    constexpr double kThinnest = 2.5e-11;
    if (!(n2 > kThinnest * dot(ab, ab) * dot(ac, ac))) return closest_on_border(p, a, b, c);
    const double weight_b = dot(cross(ap, ac), n), weight_c = dot(cross(ab, ap), n);  // times n2
    if (weight_b < 0 || weight_c < 0 || weight_b + weight_c > n2) return closest_on_border(p, a, b, c);
    const double height = dot(ap, n) / n2;
    const double vb = weight_b / n2, vc = weight_c / n2;
    return {height * height * n2, p - n * height, {1 - vb - vc, vb, vc}};
}

}  // namespace

ClosestPoint TriangleBvh::closest(Vec3d p, double max_distance_m) const {
    ClosestPoint best;
    if (nodes_.empty() || !(max_distance_m >= 0)) return best;
    struct Entry {
        std::uint32_t node;
        double distance_squared;
    };
    Entry stack[kStackSize];
    int depth = 0;
    double bound = max_distance_m * max_distance_m;
    Entry at = {0, box_distance_squared(nodes_[0].low, nodes_[0].high, p)};
    if (!(at.distance_squared <= bound)) return best;
    for (;;) {
        const Node& node = nodes_[at.node];
        if (node.count == 0) {
            Entry near = {at.node + 1, 0}, far = {node.first, 0};
            near.distance_squared = box_distance_squared(nodes_[near.node].low, nodes_[near.node].high, p);
            far.distance_squared = box_distance_squared(nodes_[far.node].low, nodes_[far.node].high, p);
            if (far.distance_squared < near.distance_squared) std::swap(near, far);
            if (near.distance_squared <= bound) {
                if (far.distance_squared <= bound) stack[depth++] = far;
                at = near;
                continue;
            }
        } else {
            for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
                const Triangle& t = triangles_[i];
                const Candidate c = closest_on_triangle(p, to_double(t.a), to_double(t.b), to_double(t.c));
                if (c.distance_squared < bound || (!best.found && c.distance_squared <= bound)) {
                    bound = c.distance_squared;
                    best = {true, 0, t.index, c.point, c.weights};
                }
            }
        }
        do {
            if (depth == 0) {
                best.distance_m = best.found ? std::sqrt(bound) : 0;
                return best;
            }
            at = stack[--depth];
        } while (at.distance_squared > bound);
    }
}

RayHit TriangleBvh::raycast(Vec3d origin, Vec3d direction, double t_min, double t_max) const {
    RayHit best;
    if (nodes_.empty()) return best;
    constexpr double kMiss = std::numeric_limits<double>::infinity();
    const Vec3d inverse = {1 / direction.x, 1 / direction.y, 1 / direction.z};
    double bound = t_max;
    // Where the ray enters a box. Beside the slab of a zero component both ends are infinite with one sign;
    // on its face they are 0 * inf = NaN, which max and min drop in this order of arguments. The far end is
    // moved out by the rounding of the products (Ize, "Robust BVH ray traversal", 2013).
    const auto enter = [&](const Node& node) {
        double begin = t_min, end = bound;
        for (int i = 0; i < 3; ++i) {
            double t0 = (node.low[i] - origin[i]) * inverse[i], t1 = (node.high[i] - origin[i]) * inverse[i];
            if (inverse[i] < 0) std::swap(t0, t1);
            constexpr double kRounding = 1e-15;
            begin = std::max(begin, t0);
            end = std::min(end, t1 * (t1 > 0 ? 1 + kRounding : 1 - kRounding));
        }
        return begin <= end ? begin : kMiss;
    };
    // Along the largest component, where the shear is smallest.
    int z = 0;
    for (int i = 1; i < 3; ++i)
        if (std::fabs(direction[i]) > std::fabs(direction[z])) z = i;
    if (!(std::fabs(direction[z]) > 0)) return best;
    const int x = (z + 1) % 3, y = (z + 2) % 3;
    const double shear_x = direction[x] / direction[z], shear_y = direction[y] / direction[z];
    const auto shear = [&](Vec3d p) { return Sheared{p[x] - shear_x * p[z], p[y] - shear_y * p[z]}; };
    struct Entry {
        std::uint32_t node;
        double t;
    };
    Entry stack[kStackSize];
    int depth = 0;
    stack[depth++] = {0, enter(nodes_[0])};
    while (depth > 0) {
        const Entry at = stack[--depth];
        if (at.t == kMiss || at.t > bound) continue;
        const Node& node = nodes_[at.node];
        if (node.count == 0) {
            Entry near = {at.node + 1, enter(nodes_[at.node + 1])},
                  far = {node.first, enter(nodes_[node.first])};
            if (far.t < near.t) std::swap(near, far);
            if (far.t != kMiss) stack[depth++] = far;
            if (near.t != kMiss) stack[depth++] = near;
            continue;
        }
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
            const Triangle& triangle = triangles_[i];
            const Vec3d a = to_double(triangle.a) - origin, b = to_double(triangle.b) - origin,
                        c = to_double(triangle.c) - origin;
            const EdgeAreas areas(shear(a), shear(b), shear(c));
            if (!areas.inside()) continue;
            const Vec3d n = cross(b - a, c - a);
            const double facing = dot(direction, n), sum = areas.sum();
            if (facing == 0 || sum == 0) continue;
            const double t = dot(a, n) / facing;
            if (!(t >= t_min && t <= bound) || (best.found && t == bound && triangle.index > best.triangle))
                continue;
            bound = t;
            best = {true, t, triangle.index, {areas.a / sum, areas.b / sum, areas.c / sum}, facing > 0};
        }
    }
    return best;
}

Vec3d TriangleBvh::normal(std::uint32_t triangle) const {
    const Triangle& t = triangles_[place_of_[triangle]];
    const Vec3d a = to_double(t.a);
    return normalised(cross(to_double(t.b) - a, to_double(t.c) - a));
}

}  // namespace burin
