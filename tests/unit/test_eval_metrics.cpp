// SPDX-License-Identifier: MIT
// Distances between surfaces whose distance is known, and meshes with known defects.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "eval/mesh_metrics.h"
#include "eval/mesh_topology.h"
#include "test_eval_meshes.h"

using namespace burin;
using namespace burin::testing_meshes;

namespace {

MeshMetricsOptions options_with(std::vector<double> thresholds_m, int samples = 20'000) {
    MeshMetricsOptions options;
    options.samples = samples;
    options.thresholds_m = std::move(thresholds_m);
    return options;
}

void says(const Status& status, const char* part) {
    EXPECT_FALSE(status.ok());
    EXPECT_NE(std::strstr(status.text(), part), nullptr) << status.text() << " should say " << part;
}

TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
    const auto first = static_cast<std::uint32_t>(a.positions.size());
    a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
    for (const auto& t : b.triangles) a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    return a;
}

}  // namespace

TEST(MeshMetrics, ParallelSquaresAreAsFarApartAsTheyAre) {
    Jobs jobs(2);
    const TriangleMesh truth = make_rectangle(1, 1, 0, 7), estimate = make_rectangle(1, 1, 0.003, 10);
    const auto m = evaluate_mesh(estimate, truth, options_with({0.002, 0.0031}), jobs);
    ASSERT_TRUE(m.ok()) << m.status().text();
    for (const DistanceStats& d : {m->accuracy, m->completeness}) {
        EXPECT_EQ(d.count, 20'000);
        for (const double value : {d.mean_m, d.median_m, d.rms_m, d.p99_m, d.max_m})
            EXPECT_NEAR(value, 0.003, 1e-9);
    }
    ASSERT_EQ(m->scores.size(), 2u);
    EXPECT_EQ(m->scores[0].precision, 0);
    EXPECT_EQ(m->scores[0].f_score, 0);
    EXPECT_EQ(m->scores[1].precision, 1);
    EXPECT_EQ(m->scores[1].completeness_ratio, 1);
    EXPECT_EQ(m->scores[1].f_score, 1);
    EXPECT_NEAR(m->normal_consistency, 1, 1e-12);
    EXPECT_EQ(m->flipped_ratio, 0);
}

TEST(MeshMetrics, FlippedSurfacesAreSeen) {
    Jobs jobs(1);
    const TriangleMesh truth = make_rectangle(1, 1, 0, 3);
    TriangleMesh estimate = truth;
    flip(&estimate);
    const auto m = evaluate_mesh(estimate, truth, options_with({0.01}), jobs);
    ASSERT_TRUE(m.ok());
    EXPECT_EQ(m->flipped_ratio, 1);
    EXPECT_NEAR(m->normal_consistency, 1, 1e-12);
}

TEST(MeshMetrics, HalfASquareIsAccurateAndHalfComplete) {
    Jobs jobs(2);
    const TriangleMesh truth = make_rectangle(1, 1, 0, 8), half = make_rectangle(0.5, 1, 0, 8);
    const MeshMetricsOptions options = options_with({0.01}, 50'000);
    const auto m = evaluate_mesh(half, truth, options, jobs);
    ASSERT_TRUE(m.ok());
    EXPECT_NEAR(m->accuracy.max_m, 0, 1e-9);
    EXPECT_EQ(m->scores[0].precision, 1);
    EXPECT_NEAR(m->scores[0].completeness_ratio, 0.51, 0.002);  // and 1 cm beside it
    EXPECT_NEAR(m->scores[0].f_score, 2 * 0.51 / 1.51, 0.002);
    EXPECT_NEAR(m->completeness.mean_m, 0.5 * 0.25, 0.001);  // half at 0, half evenly from 0 to 0.5
    EXPECT_NEAR(m->completeness.rms_m, std::sqrt(0.5 * 0.25 / 3), 0.001);

    // Asked only about what was seen, it is complete.
    const auto seen = sample_surface(
        truth, 20'000, 3, [](Vec3d p, Vec3d) { return p.x <= 0.5; }, jobs);
    ASSERT_TRUE(seen.ok());
    EXPECT_NEAR(static_cast<double>(seen->points.size()), 10'000, 200);
    const auto surface = TriangleBvh::build(truth, jobs);
    MeshTruth limited;
    limited.surface = &*surface;
    limited.samples = &*seen;
    const auto n = evaluate_mesh(half, limited, options, jobs);
    ASSERT_TRUE(n.ok());
    EXPECT_EQ(n->scores[0].completeness_ratio, 1);
    EXPECT_EQ(n->completeness.count, static_cast<std::int64_t>(seen->points.size()));
}

TEST(MeshMetrics, OutliersCanBeLeftOutOfTheEstimate) {
    Jobs jobs(2);
    const TriangleMesh truth = make_rectangle(1, 1, 0, 4);
    const TriangleMesh estimate = joined(truth, make_rectangle(1, 1, 0.5, 4));
    MeshMetricsOptions options = options_with({0.1});
    auto m = evaluate_mesh(estimate, truth, options, jobs);
    ASSERT_TRUE(m.ok());
    EXPECT_NEAR(m->scores[0].precision, 0.5, 0.01);
    EXPECT_NEAR(m->accuracy.mean_m, 0.25, 0.005);
    options.keep_estimate = [](Vec3d p, Vec3d) { return p.z < 0.25; };
    m = evaluate_mesh(estimate, truth, options, jobs);
    ASSERT_TRUE(m.ok());
    EXPECT_EQ(m->scores[0].precision, 1);
    EXPECT_NEAR(static_cast<double>(m->accuracy.count), 10'000, 200);
}

TEST(MeshMetrics, SphereAgainstItsFormulaAndItsFinerMesh) {
    Jobs jobs(2);
    const double radius = 0.5;
    const Vec3d centre = {1, 2, 3};
    const TriangleMesh coarse = make_sphere(radius, 3, centre), fine = make_sphere(radius, 6, centre);
    // The mean of radius - |p| over the flat triangles, by the three-point rule (error of the fourth order).
    double area = 0, sum = 0, worst = 0;
    for (const auto& t : coarse.triangles) {
        const Vec3d p[3] = {to_double(coarse.positions[t[0]]) - centre,
                            to_double(coarse.positions[t[1]]) - centre,
                            to_double(coarse.positions[t[2]]) - centre};
        const double weight = norm(cross(p[1] - p[0], p[2] - p[0])) / 2;
        for (int k = 0; k < 3; ++k)
            sum +=
                weight / 3 *
                (radius - norm(p[k] * (2.0 / 3) + p[(k + 1) % 3] * (1.0 / 6) + p[(k + 2) % 3] * (1.0 / 6)));
        area += weight;
        worst = std::max(worst, radius - norm((p[0] + p[1] + p[2]) * (1.0 / 3)));
    }
    const double expected = sum / area;
    const MeshMetricsOptions options = options_with({0.001, worst * 1.01}, 50'000);

    const auto samples = sample_surface(fine, 50'000, 5, {}, jobs);
    ASSERT_TRUE(samples.ok());
    MeshTruth analytic;
    analytic.distance_m = [&](Vec3d p) { return norm(p - centre) - radius; };
    analytic.normal = [&](Vec3d p) { return normalised(p - centre); };
    analytic.samples = &*samples;
    const auto a = evaluate_mesh(coarse, analytic, options, jobs);
    ASSERT_TRUE(a.ok()) << a.status().text();
    const auto b = evaluate_mesh(coarse, fine, options, jobs);
    ASSERT_TRUE(b.ok());
    EXPECT_NEAR(a->accuracy.mean_m, expected, 0.01 * expected);
    EXPECT_NEAR(a->accuracy.max_m, worst, 0.02 * worst);
    EXPECT_NEAR(b->accuracy.mean_m, expected,
                0.05 * expected);  // the finer mesh has 1/64 of the error itself
    EXPECT_NEAR(b->completeness.mean_m, expected, 0.05 * expected);
    for (const auto& m : {*a, *b}) {
        EXPECT_EQ(m.scores[1].f_score, 1);
        EXPECT_GT(m.normal_consistency, 0.997);
        EXPECT_LT(m.normal_consistency, 0.9999);
        EXPECT_EQ(m.flipped_ratio, 0);
    }
    // Without a normal function only the way back has normals.
    analytic.normal = {};
    const auto c = evaluate_mesh(coarse, analytic, options, jobs);
    ASSERT_TRUE(c.ok());
    EXPECT_EQ(c->flipped_ratio, -1);
    EXPECT_GT(c->normal_consistency, 0.99);
}

TEST(MeshMetrics, TheSameBitsForAnyNumberOfThreads) {
    Jobs one(1), four(4);
    const TriangleMesh estimate = make_sphere(1, 4), truth = make_sphere(1.01, 5, {0.01, 0, 0});
    const auto a = evaluate_mesh(estimate, truth, options_with({0.01}), one);
    const auto b = evaluate_mesh(estimate, truth, options_with({0.01}), four);
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(std::memcmp(&a->accuracy, &b->accuracy, sizeof a->accuracy), 0);
    EXPECT_EQ(std::memcmp(&a->completeness, &b->completeness, sizeof a->completeness), 0);
    EXPECT_EQ(a->normal_consistency, b->normal_consistency);
    EXPECT_EQ(a->scores[0].f_score, b->scores[0].f_score);
}

TEST(SampleSurface, IsEvenByAreaAndSkipsDegenerateTriangles) {
    Jobs jobs(2);
    // 9 m2 and 1 m2, with points and lines between that must get nothing.
    TriangleMesh mesh = joined(make_rectangle(3, 3, 0, 5), make_rectangle(1, 1, 1, 3));
    mesh.triangles.insert(mesh.triangles.begin(), {{0, 0, 0}, {0, 1, 2}});
    mesh.triangles.push_back({4, 4, 5});
    const auto samples = sample_surface(mesh, 100'000, 11, {}, jobs);
    ASSERT_TRUE(samples.ok());
    double low = 0, quadrant = 0;
    Vec3d mean;
    for (std::size_t i = 0; i < samples->points.size(); ++i) {
        const Vec3d p = samples->points[i];
        ASSERT_NEAR(samples->normals[i].z, 1, 1e-12);
        if (p.z > 0.5) continue;
        ++low;
        quadrant += p.x < 1.5 && p.y < 1.5;
        mean = mean + p;
    }
    EXPECT_NEAR(low / 100'000, 0.9, 0.001);
    EXPECT_NEAR(quadrant / low, 0.25, 0.005);
    EXPECT_NEAR(mean.x / low, 1.5, 0.01);
    EXPECT_NEAR(mean.y / low, 1.5, 0.01);
}

TEST(MeshMetrics, BadInputIsNamed) {
    Jobs jobs(1);
    const TriangleMesh good = make_sphere(1, 1);
    says(evaluate_mesh({}, good, {}, jobs).status(), "no triangles");
    says(evaluate_mesh(good, TriangleMesh{}, {}, jobs).status(), "no triangles");
    says(evaluate_mesh(good, good, options_with({0}), jobs).status(), "threshold is 0 m");
    says(evaluate_mesh(good, good, options_with({0.1}, 0), jobs).status(), "0 samples requested");
    says(evaluate_mesh(good, MeshTruth{}, {}, jobs).status(), "no true surface");
    TriangleMesh flat = good;
    for (Vec3f& p : flat.positions) p = {1, 2, 3};
    says(evaluate_mesh(flat, good, {}, jobs).status(), "area of 0 m2");
    MeshTruth truth;
    truth.distance_m = [](Vec3d) { return 0.0; };
    says(evaluate_mesh(good, truth, {}, jobs).status(), "no samples on the true surface");
    SurfaceSamples samples;
    samples.points = {{0, 0, 1}};
    truth.samples = &samples;
    EXPECT_TRUE(evaluate_mesh(good, truth, {}, jobs).ok());
    truth.distance_m = [](Vec3d) { return std::nan(""); };
    says(evaluate_mesh(good, truth, {}, jobs).status(), "is not finite");
    samples.points = {{0, 0, HUGE_VAL}};
    says(evaluate_mesh(good, truth, {}, jobs).status(), "true sample 0 is not finite");
    samples.points = {{0, 0, 1}};
    truth.distance_m = [](Vec3d) { return 0.0; };
    MeshMetricsOptions none = options_with({0.1});
    none.keep_estimate = [](Vec3d, Vec3d) { return false; };
    says(evaluate_mesh(good, truth, none, jobs).status(), "none of 20000 samples");
}

TEST(MeshTopology, AClosedSphereIsClean) {
    const auto t = check_topology(make_sphere(2, 4));
    ASSERT_TRUE(t.ok());
    EXPECT_EQ(t->triangles, 2048);
    EXPECT_EQ(t->vertices, 1026);
    EXPECT_EQ(t->edges, 3072);
    EXPECT_EQ(t->vertices - t->edges + t->triangles, 2);  // Euler
    EXPECT_TRUE(t->closed());
    EXPECT_TRUE(t->clean());
    EXPECT_EQ(t->components, 1);
    EXPECT_EQ(t->largest_component, 2048);
    EXPECT_NEAR(t->area_m2, 4 * 3.14159265 * 4, 0.25);
}

TEST(MeshTopology, EveryDefectIsCounted) {
    const TriangleMesh sphere = make_sphere(1, 1);  // 18 vertices, 32 triangles
    const auto check = [](const TriangleMesh& mesh) {
        const auto t = check_topology(mesh);
        EXPECT_TRUE(t.ok()) << t.status().text();
        return *t;
    };
    TriangleMesh mesh = sphere;
    mesh.normals.clear();
    mesh.triangles.pop_back();
    EXPECT_EQ(check(mesh).boundary_edges, 3);
    EXPECT_FALSE(check(mesh).closed());
    EXPECT_TRUE(check(mesh).clean());

    mesh = sphere;
    mesh.normals.clear();
    std::swap(mesh.triangles[7][0], mesh.triangles[7][1]);
    EXPECT_EQ(check(mesh).inconsistent_edges, 3);
    EXPECT_EQ(check(mesh).boundary_edges, 0);

    mesh = sphere;
    mesh.normals.clear();
    mesh.positions.push_back(mesh.positions[4]);  // a seam: one triangle uses the copy
    for (std::uint32_t& v : mesh.triangles[2]) v = v == 4 ? 18 : v;
    mesh.positions.push_back(mesh.positions[5]);  // a copy nobody uses
    mesh.positions.push_back({9, 9, 9});
    const bool used = std::count(mesh.triangles[2].begin(), mesh.triangles[2].end(), 18u) == 1;
    MeshTopology t = check(mesh);
    EXPECT_EQ(t.duplicate_vertices, 2);
    EXPECT_EQ(t.unreferenced_vertices, used ? 2 : 3);

    mesh = sphere;
    mesh.normals.clear();
    const auto first = mesh.triangles[0];
    mesh.triangles.push_back({first[0], first[1], 17});  // a fin on an edge
    t = check(mesh);
    EXPECT_EQ(t.non_manifold_edges, 1);

    mesh = sphere;
    mesh.normals.clear();
    mesh.positions.push_back({0, 0, 0});
    mesh.positions.push_back({0, 0, 5});
    mesh.positions.push_back({0, 0, 7});
    mesh.triangles.push_back({18, 19, 20});                    // on one line
    mesh.triangles.push_back({first[0], first[1], first[1]});  // a corner twice
    t = check(mesh);
    EXPECT_EQ(t.degenerate_triangles, 2);
    EXPECT_EQ(t.non_manifold_edges, 0);
    EXPECT_EQ(t.components, 2);

    mesh = joined(make_sphere(1, 1), make_sphere(1, 2, {5, 0, 0}));
    mesh.normals.clear();
    t = check(mesh);
    EXPECT_EQ(t.components, 2);
    EXPECT_EQ(t.largest_component, 128);
    EXPECT_TRUE(t.closed());

    t = check({});
    EXPECT_EQ(t.triangles, 0);
    EXPECT_FALSE(t.closed());
    EXPECT_TRUE(t.clean());
    mesh.triangles[3][0] = 4'000'000;
    EXPECT_FALSE(check_topology(mesh).ok());
}
