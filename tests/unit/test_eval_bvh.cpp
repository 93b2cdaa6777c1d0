// SPDX-License-Identifier: MIT
// The search tree against looking at every triangle with formulas of the test's own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "eval/triangle_bvh.h"
#include "test_eval_meshes.h"

using namespace burin;
using namespace burin::testing_meshes;

namespace {

struct Wide {  // long double vector
    long double x, y, z;
};
Wide wide(Vec3d v) { return {v.x, v.y, v.z}; }
Wide operator-(Wide a, Wide b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Wide operator*(Wide a, long double s) { return {a.x * s, a.y * s, a.z * s}; }
long double dot(Wide a, Wide b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

long double segment_distance(Wide p, Wide a, Wide b) {
    const Wide ab = b - a, ap = p - a;
    const long double l = dot(ab, ab);
    const Wide d = ap - ab * (l > 0 ? std::clamp(dot(ap, ab) / l, 0.0L, 1.0L) : 0.0L);
    return std::sqrt(dot(d, d));
}

// By Gram-Schmidt in the triangle's plane instead of cross products.
long double triangle_distance(Wide p, Wide a, Wide b, Wide c) {
    long double best =
        std::min({segment_distance(p, a, b), segment_distance(p, b, c), segment_distance(p, c, a)});
    const Wide e1 = b - a;
    const long double l1 = dot(e1, e1);
    if (!(l1 > 0)) return best;
    const long double shear = dot(c - a, e1) / l1;
    const Wide e2 = c - a - e1 * shear;
    const long double l2 = dot(e2, e2);
    if (!(l2 > 1e-30L * l1)) return best;
    const Wide ap = p - a;
    const long double w = dot(ap, e2) / l2, v = dot(ap, e1) / l1 - w * shear;
    if (v < 0 || w < 0 || v + w > 1) return best;
    const Wide d = ap - e1 * (v + w * shear) - e2 * w;
    return std::min(best, std::sqrt(dot(d, d)));
}

Vec3d corner(const TriangleMesh& mesh, std::uint32_t triangle, std::size_t k) {
    return to_double(mesh.positions[mesh.triangles[triangle][k]]);
}

double brute_force_distance(const TriangleMesh& mesh, Vec3d p) {
    long double best = HUGE_VALL;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
        best = std::min(best, triangle_distance(wide(p), wide(corner(mesh, i, 0)), wide(corner(mesh, i, 1)),
                                                wide(corner(mesh, i, 2))));
    return static_cast<double>(best);
}

// Moeller & Trumbore 1997.
double brute_force_ray(const TriangleMesh& mesh, Vec3d origin, Vec3d direction) {
    double best = HUGE_VAL;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const Vec3d a = corner(mesh, i, 0), e1 = corner(mesh, i, 1) - a, e2 = corner(mesh, i, 2) - a;
        const Vec3d p = cross(direction, e2), s = origin - a, q = cross(s, e1);
        const double det = dot(e1, p);
        if (det == 0) continue;
        const double u = dot(s, p) / det, v = dot(direction, q) / det, t = dot(e2, q) / det;
        if (u >= 0 && v >= 0 && u + v <= 1 && t >= 0) best = std::min(best, t);
    }
    return best;
}

// Points, segments, needles, giants and copies among ordinary triangles.
TriangleMesh awkward_soup(unsigned seed, int count) {
    Random random(seed);
    TriangleMesh mesh = make_soup(random, count, 1, 0.1);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        Vec3f* p = &mesh.positions[3 * i];
        switch (i % 12) {
            case 0:
                p[1] = p[2] = p[0];
                break;
            case 1:
                p[2] = p[1];
                break;
            case 2:
                p[2] = p[0] + (p[1] - p[0]) * 0.5f;
                break;
            case 3:
                p[2] = p[0] + (p[1] - p[0]) * 0.7f + Vec3f{1e-5f, 0, 0};
                break;
            case 4:
                p[2] = p[0] + (p[2] - p[0]) * 20.0f;
                break;
            case 5:
                p[0] = p[-3];
                p[1] = p[-2];
                p[2] = p[-1];
                break;
            default:
                break;
        }
    }
    return mesh;
}

}  // namespace

TEST(TriangleBvh, ClosestPointIsThatOfBruteForce) {
    Jobs jobs(2);
    for (const int count : {1, 3, 5, 40, 700}) {
        const TriangleMesh mesh = awkward_soup(static_cast<unsigned>(count), count);
        const auto bvh = TriangleBvh::build(mesh, jobs);
        ASSERT_TRUE(bvh.ok()) << bvh.status().text();
        Random random(7);
        for (int i = 0; i < 400; ++i) {
            Vec3d p = random.point(i % 2 ? 1 : 5);
            if (i % 5 == 0)
                p = corner(mesh, static_cast<std::uint32_t>(random.below(count)), 1);  // on the mesh
            const ClosestPoint closest = bvh->closest(p);
            const double expected = brute_force_distance(mesh, p);
            ASSERT_TRUE(closest.found);
            ASSERT_NEAR(closest.distance_m, expected, 1e-9 + 1e-9 * expected) << i;
            // The triangle, the point and the weights belong together.
            ASSERT_NEAR(norm(closest.point - p), closest.distance_m, 1e-9);
            const Barycentric w = closest.weights;
            ASSERT_NEAR(w.a + w.b + w.c, 1, 1e-9);
            ASSERT_GE(std::min({w.a, w.b, w.c}), -1e-9);
            const Vec3d q = corner(mesh, closest.triangle, 0) * w.a +
                            corner(mesh, closest.triangle, 1) * w.b + corner(mesh, closest.triangle, 2) * w.c;
            ASSERT_LT(norm(q - closest.point), 1e-6);
            // A bound below finds nothing, one above the same.
            if (expected == 0) continue;
            ASSERT_FALSE(bvh->closest(p, 0.999 * closest.distance_m).found);
            ASSERT_EQ(bvh->closest(p, 1.001 * closest.distance_m).triangle, closest.triangle);
        }
    }
}

TEST(TriangleBvh, RaysHitWhatBruteForceHits) {
    Jobs jobs(2);
    const TriangleMesh mesh = awkward_soup(77, 600);
    const auto bvh = TriangleBvh::build(mesh, jobs);
    ASSERT_TRUE(bvh.ok());
    Random random(8);
    int hits = 0, misses = 0;
    for (int i = 0; i < 4000; ++i) {
        const Vec3d origin = random.point(1.5);
        Vec3d direction = random.direction() * random.between(0.1, 10);
        if (i % 4 == 0) direction[random.below(3)] = 0;
        if (i % 16 == 0) direction[random.below(3)] = -0.0;
        if (dot(direction, direction) == 0) continue;
        const RayHit hit = bvh->raycast(origin, direction);
        const double expected = brute_force_ray(mesh, origin, direction);
        ASSERT_EQ(hit.found, expected < HUGE_VAL) << i;
        ++(hit.found ? hits : misses);
        if (!hit.found) continue;
        ASSERT_NEAR(hit.t, expected, 1e-7 * (1 + expected));
        const Vec3d p = origin + direction * hit.t;
        const Vec3d q = corner(mesh, hit.triangle, 0) * hit.weights.a +
                        corner(mesh, hit.triangle, 1) * hit.weights.b +
                        corner(mesh, hit.triangle, 2) * hit.weights.c;
        ASSERT_LT(norm(p - q), 1e-5);
        ASSERT_EQ(hit.back_face, dot(direction, bvh->normal(hit.triangle)) > 0);
        ASSERT_FALSE(bvh->raycast(origin, direction, 0, 0.999 * hit.t).found);
        const RayHit behind = bvh->raycast(origin, direction, 1.001 * hit.t);
        ASSERT_TRUE(!behind.found || behind.t >= 1.001 * hit.t);
    }
    EXPECT_GT(hits, 500);
    EXPECT_GT(misses, 500);
}

TEST(TriangleBvh, NoRaySlipsThroughAClosedSurface) {
    Jobs jobs(1);
    const TriangleMesh mesh = make_sphere(1, 4);
    const auto bvh = TriangleBvh::build(mesh, jobs);
    ASSERT_TRUE(bvh.ok());
    Random random(4);
    for (int round = 0; round < 3; ++round) {
        const Vec3d origin = random.point(0.5);
        // Exactly through every vertex and every middle of an edge, as near as doubles go.
        for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec3d a = corner(mesh, i, k), b = corner(mesh, i, (k + 1) % 3);
                const RayHit vertex = bvh->raycast(origin, a - origin);
                ASSERT_TRUE(vertex.found && vertex.back_face);
                ASSERT_NEAR(vertex.t, 1, 1e-6);
                ASSERT_TRUE(bvh->raycast(origin, a * 0.3 + b * 0.7 - origin).found);
            }
    }
}

TEST(TriangleBvh, SameTreeForAnyNumberOfThreads) {
    // 131,072 triangles: several subtrees are built in parallel.
    const TriangleMesh mesh = make_sphere(2, 7);
    Jobs one(1), four(4);
    const auto a = TriangleBvh::build(mesh, one), b = TriangleBvh::build(mesh, four);
    ASSERT_TRUE(a.ok() && b.ok());
    Random random(2);
    for (int i = 0; i < 5000; ++i) {
        const Vec3d p = random.point(3);
        const ClosestPoint x = a->closest(p), y = b->closest(p);
        ASSERT_EQ(x.triangle, y.triangle);
        ASSERT_EQ(x.distance_m, y.distance_m);
        ASSERT_NEAR(x.distance_m, std::fabs(norm(p) - 2), 2e-4);  // the sagitta of 1.4 degree chords
    }
}

TEST(TriangleBvh, ManyTrianglesInOnePlaceDoNotDegenerate) {
    // Equal centres cannot be told apart by any plane; the depth must stay logarithmic.
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1e-30f, 0, 0}, {3e38f, 0, 0}, {-3e38f, 1, 0}};
    for (int i = 0; i < 50'000; ++i) mesh.triangles.push_back({0, 1, 2});
    for (int i = 0; i < 50; ++i) mesh.triangles.push_back({0, 0, 3});
    mesh.triangles.push_back({0, 4, 5});
    Jobs jobs(2);
    const auto bvh = TriangleBvh::build(mesh, jobs);
    ASSERT_TRUE(bvh.ok());
    EXPECT_NEAR(bvh->closest({0.25, 0.25, 2}).distance_m, 2, 1e-12);
    EXPECT_NEAR(bvh->raycast({0.25, 0.25, 2}, {0, 0, -1}).t, 2, 1e-12);
    // Geometric spacing: SAH would peel off one triangle a level.
    TriangleMesh peel;
    for (int i = 0; i < 3000; ++i) {
        const float x = std::ldexp(1.0f, i % 240 - 120);
        peel.positions.insert(peel.positions.end(), {{x, 0, 0}, {x, x, 0}, {x, 0, x}});
        const auto v = static_cast<std::uint32_t>(3 * i);
        peel.triangles.push_back({v, v + 1, v + 2});
    }
    const auto deep = TriangleBvh::build(peel, jobs);
    ASSERT_TRUE(deep.ok());
    for (int e = -60; e < 60; ++e) {
        const double x = std::ldexp(1.0, e);
        EXPECT_LE(deep->closest({x, 0, 0}).distance_m, 1e-9 * x);
    }
}

TEST(TriangleBvh, BadMeshesAreErrors) {
    Jobs jobs(1);
    const auto says = [&](const TriangleMesh& mesh, const char* part) {
        const auto bvh = TriangleBvh::build(mesh, jobs);
        ASSERT_FALSE(bvh.ok());
        EXPECT_NE(std::strstr(bvh.status().text(), part), nullptr) << bvh.status().text();
    };
    says({}, "no triangles");
    TriangleMesh mesh = make_sphere(1, 0);
    mesh.triangles[2][1] = 6;
    says(mesh, "triangle 2 uses vertex 6, expected below 6");
    mesh = make_sphere(1, 0);
    mesh.positions[4].x = NAN;
    says(mesh, "vertex 4");
    const TriangleBvh empty;
    EXPECT_FALSE(empty.closest({0, 0, 0}).found);
    EXPECT_FALSE(empty.raycast({0, 0, 0}, {0, 0, 1}).found);
}
