// SPDX-License-Identifier: MIT
// What planes did to meshes, on a floor of 1 m x 1 m with a box on it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "eval/plane_surface.h"
#include "test_eval_meshes.h"

using namespace burin;
using namespace burin::testing_meshes;

namespace {

double box_distance(Vec3d p, Vec3d low, Vec3d high) {
    Vec3d out;
    double inside = -1e9;
    for (int k = 0; k < 3; ++k) {
        const double d = std::max(low[k] - p[k], p[k] - high[k]);
        out[k] = std::max(d, 0.0);
        inside = std::max(inside, d);
    }
    return inside > 0 ? norm(out) : inside;
}

// The floor z <= 0, of which 1 m x 1 m is the plane, and a box of 0.2 m x 0.2 m x 0.3 m on it.
const Vec3d kLow = {0.2, 0.2, 0}, kHigh = {0.4, 0.4, 0.3};
double distance(Vec3d p) { return std::min(p.z, box_distance(p, kLow, kHigh)); }

PlaneTruth floor_and_box() {
    PlaneTruth truth;
    LabelledPlane floor;
    floor.label = 2;
    floor.normal = {0, 0, 1};
    floor.rings = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
    floor.area_m2 = floor.seen_area_m2 = 0.96;
    LabelledPlane lid = floor;
    lid.id = 1;
    lid.label = 4;
    lid.offset = -0.3;
    lid.rings = {{{0.2, 0.2, 0.3}, {0.4, 0.2, 0.3}, {0.4, 0.4, 0.3}, {0.2, 0.4, 0.3}}};
    lid.area_m2 = lid.seen_area_m2 = 0.04;
    truth.planes = {floor, lid};
    truth.distance_m = distance;
    truth.surface_distance_m = distance;
    truth.label = [](Vec3d p) -> std::uint8_t { return box_distance(p, kLow, kHigh) < p.z ? 4 : 2; };
    return truth;
}

// Cells of n x n on [x0, x1] x [y0, y1] at height z.
TriangleMesh patch(double x0, double y0, double x1, double y1, double z, int n, int filled = 0) {
    TriangleMesh mesh = make_rectangle(x1 - x0, y1 - y0, z, n);
    for (Vec3f& p : mesh.positions) {
        p.x += static_cast<float>(x0);
        p.y += static_cast<float>(y0);
    }
    mesh.filled.assign(mesh.triangles.size(), static_cast<std::uint8_t>(filled));
    return mesh;
}

TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
    const auto first = static_cast<std::uint32_t>(a.positions.size());
    a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
    a.labels.insert(a.labels.end(), b.labels.begin(), b.labels.end());
    a.filled.insert(a.filled.end(), b.filled.begin(), b.filled.end());
    for (const auto& t : b.triangles) a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    return a;
}

double area_of(const TrueExtent& e, const std::vector<std::uint8_t>& cells) {
    return static_cast<double>(std::count(cells.begin(), cells.end(), 1)) * e.cells.cell_area_m2();
}

class PlaneMeshes : public ::testing::Test {
  protected:
    Jobs jobs{2};
    PlaneTruth truth = floor_and_box();
    TrueExtents extents{truth, {}, jobs};
    PlaneSurfaceOptions options;
};

}  // namespace

TEST_F(PlaneMeshes, TheFloorIsOpenBesideTheBoxAndFlatAwayFromIt) {
    ASSERT_EQ(extents.size(), 2u);
    EXPECT_NEAR(area_of(extents[0], extents[0].open), 0.96, 1e-9);
    EXPECT_EQ(area_of(extents[1], extents[1].open), 0);  // too small to count
    for (std::size_t c = 0; c < extents[0].cells.size(); ++c) {
        const Vec3d p = extents[0].cells.centre(c);
        const double rim = std::min({p.x, p.y, 1 - p.x, 1 - p.y}), box = box_distance(p, kLow, kHigh);
        if (extents[0].flat[c]) {
            EXPECT_GT(std::min(rim, box), 0.015) << p.x << " " << p.y;
        }
        // The margin of 15 mm and what cells of 10 mm cost.
        if (std::min(rim, box) > 0.015 + 0.02) {
            EXPECT_TRUE(extents[0].flat[c]) << p.x << " " << p.y;
        }
    }
}

TEST_F(PlaneMeshes, FlatVerticesAreMeasuredAgainstTheirPlane) {
    TriangleMesh mesh = patch(0.5, 0.5, 0.9, 0.9, 0, 80);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) mesh.positions[i].z = i % 2 ? 0.001f : -0.001f;
    // 2 mm over the lid, which is too small to count; filled surface 3 mm off; and 50 mm over the floor.
    mesh = joined(mesh, patch(0.25, 0.25, 0.35, 0.35, 0.302, 10));
    mesh = joined(mesh, patch(0.5, 0.1, 0.9, 0.4, 0.003, 10, 1));
    const FlatnessFigures f = measure_flatness(mesh, truth, extents, options, jobs);
    EXPECT_EQ(f.plane_vertices, 81 * 81);
    EXPECT_EQ(f.vertices[0], 81 * 81);
    EXPECT_NEAR(f.plane_rms_m, 0.001, 1e-8);
    EXPECT_NEAR(f.rms_m[0], 0.001, 1e-8);
    EXPECT_EQ(f.vertices[1], 0);
    EXPECT_EQ(f.other_vertices, 11 * 11);
    EXPECT_NEAR(f.other_mean_m, 0.002, 1e-7);
    mesh = joined(patch(0.5, 0.5, 0.9, 0.9, 0.05, 10), patch(0.25, 0.25, 0.35, 0.35, 0.302, 10));
    const FlatnessFigures far = measure_flatness(mesh, truth, extents, options, jobs);
    EXPECT_EQ(far.plane_vertices, 0);
    EXPECT_NEAR(far.other_mean_m, 0.5 * (0.05 + 0.002), 1e-7);
    TrueExtentOptions small;
    small.min_area_m2 = 0.01;
    const TrueExtents both(truth, small, jobs);
    EXPECT_NEAR(area_of(both[1], both[1].open), 0.04, 1e-9);
    EXPECT_EQ(measure_flatness(mesh, truth, both, options, jobs).vertices[1], 11 * 11);
}

TEST_F(PlaneMeshes, MissingAreaIsWhatWasNotSeenAndClosedWhatLiesWithin5mm) {
    // Seen but for x > 0.7 and a window [0.5, 0.6] x [0.4, 0.8] in it.
    TriangleMesh seen = joined(patch(0, 0, 1, 0.2, 0, 200), patch(0, 0.2, 0.2, 1, 0, 160));
    seen = joined(seen, patch(0.4, 0.2, 0.5, 1, 0, 160));
    seen = joined(seen, patch(0.2, 0.4, 0.4, 1, 0, 120));
    seen = joined(joined(seen, patch(0.5, 0.2, 0.6, 0.4, 0, 40)), patch(0.5, 0.8, 0.6, 1, 0, 40));
    seen = joined(seen, patch(0.6, 0.2, 0.7, 1, 0, 160));
    // Surface reaches 7.5 mm over its rim: one cell (centre at 5 mm), so the strip is 0.29 x 0.79 m and the
    // window 0.08 x 0.38 m.
    const double strip = 0.29 * 0.79, window = 0.08 * 0.38;
    CompletionFigures c = measure_completion(seen, seen, truth, extents, options, jobs);
    EXPECT_NEAR(c.open_m2, 0.96, 1e-9);
    EXPECT_NEAR(c.missing_m2, strip + window, 1e-9);
    EXPECT_EQ(c.closed_m2, 0);
    EXPECT_EQ(c.filled_m2, 0);
    // The hull of what is there: all but the triangle beyond the line from (1, 0.2) to (0.7, 1).
    EXPECT_NEAR(c.holes_m2, window + strip / 2, 0.01);

    // The window closed 4 mm off, half of the strip 6 mm off: that one is false. Some floor under the box is
    // hidden, and a face within the room is false too.
    TriangleMesh done = joined(seen, patch(0.5, 0.4, 0.6, 0.8, 0.004, 20, 1));
    done = joined(done, patch(0.7, 0.2, 0.85, 1, 0.006, 20, 1));
    done = joined(done, patch(0.25, 0.25, 0.35, 0.35, 0, 1, 1));
    done = joined(done, patch(0.5, 0.5, 0.6, 0.6, 0.5, 1, 1));
    c = measure_completion(seen, done, truth, extents, options, jobs);
    EXPECT_NEAR(c.closed_m2, window, 1e-9);
    EXPECT_NEAR(c.closed_holes_m2, window, 1e-9);
    EXPECT_NEAR(c.filled_m2, 0.04 + 0.12 + 0.01 + 0.01, 1e-6);
    EXPECT_NEAR(c.false_m2, 0.12 + 0.01, 1e-6);
    EXPECT_NEAR(c.hidden_m2, 0.01, 1e-6);
    ASSERT_EQ(c.planes.size(), 2u);
    EXPECT_EQ(c.planes[0].missing_m2, c.missing_m2);
    EXPECT_EQ(c.planes[1].open_m2, 0);  // the lid does not count
    // Without the mesh of what was seen, the faces that are not filled stand for it.
    const CompletionFigures same = measure_completion(done, done, truth, extents, options, jobs);
    EXPECT_EQ(same.missing_m2, c.missing_m2);
    EXPECT_EQ(same.closed_m2, c.closed_m2);
}

TEST_F(PlaneMeshes, FilledSurfaceBesideTheOutlineInsideASolidIsFalse) {
    // 0.1 m below the floor, under it; and the floor's plane beyond its outline, where the ground has none.
    TriangleMesh mesh = joined(patch(0, 0, 1, 1, 0, 100), patch(0.5, 0.5, 0.6, 0.6, -0.1, 1, 1));
    truth.distance_m = truth.surface_distance_m = [](Vec3d p) {
        return std::min(distance(p), box_distance(p, {1, -1, -1}, {3, 3, 3}));
    };
    mesh = joined(mesh, patch(1.5, 0.5, 1.6, 0.6, 0, 1, 1));
    const CompletionFigures c = measure_completion(mesh, mesh, truth, extents, options, jobs);
    EXPECT_NEAR(c.filled_m2, 0.02, 1e-6);
    EXPECT_NEAR(c.false_m2, 0.02, 1e-6);
}

TEST_F(PlaneMeshes, LabelsAreCountedByArea) {
    TriangleMesh mesh = joined(patch(0.5, 0.5, 0.9, 0.9, 0.001, 40), patch(0.2, 0.2, 0.4, 0.4, 0.3, 20));
    mesh.labels.assign(mesh.triangles.size(), 2);              // all of it floor, 0.04 m2 of which is table
    for (std::size_t i = 0; i < 800; ++i) mesh.labels[i] = 0;  // a quarter of the floor unknown
    LabelFigures l = measure_labels(mesh, truth, extents, jobs);
    EXPECT_NEAR(LabelFigures::recall(l.surface_m2, 2), 0.75, 1e-6);
    EXPECT_NEAR(LabelFigures::precision(l.surface_m2, 2), 0.12 / 0.16, 1e-6);
    EXPECT_NEAR(LabelFigures::recall(l.surface_m2, 4), 0, 1e-6);
    EXPECT_EQ(LabelFigures::precision(l.surface_m2, 4), 1);  // nothing is called a table
    EXPECT_EQ(LabelFigures::recall(l.surface_m2, 1), 1);     // there is no wall
    // The lid is no plane that counts, so the floor's precision on planes is perfect.
    EXPECT_NEAR(l.plane_m2[2][2], 0.12, 1e-6);
    EXPECT_EQ(LabelFigures::precision(l.plane_m2, 2), 1);
    flip(&mesh);  // faces that look into the ground lie on no plane
    l = measure_labels(mesh, truth, extents, jobs);
    EXPECT_EQ(l.plane_m2[2][2], 0);
    // Filled faces are not asked.
    mesh.filled.assign(mesh.triangles.size(), 1);
    l = measure_labels(mesh, truth, extents, jobs);
    EXPECT_EQ(l.surface_m2[2][2], 0);
}
