// SPDX-License-Identifier: MIT
// Objects as connected components: a small mesh by hand, and rendered desks with the faces labelled as a scan
// would have them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include "core/jobs.h"
#include "datasets/synthetic/truth_mesh.h"
#include "datasets/synthetic/truth_planes.h"
#include "emulated.h"
#include "planes/classify.h"
#include "planes/objects.h"
#include "scene_helpers.h"

namespace burin {
namespace {

struct Box {
    Vec3d low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
    double area = 0;
    void add(Vec3d p) {
        for (int a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], p[a]);
            high[a] = std::max(high[a], p[a]);
        }
    }
    double volume() const {
        double v = 1;
        for (int a = 0; a < 3; ++a) v *= std::max(0.0, high[a] - low[a]);
        return v;
    }
};

double box_iou(const Box& a, const ObjectBox& b) {
    Box both, other{to_double(b.low), to_double(b.high)};
    for (int i = 0; i < 3; ++i) {
        both.low[i] = std::max(a.low[i], other.low[i]);
        both.high[i] = std::min(a.high[i], other.high[i]);
    }
    return both.volume() / (a.volume() + other.volume() - both.volume());
}

// A mesh with its planes, ready for find_objects.
struct Scan {
    TriangleMesh mesh;
    std::vector<PlaneShape> shapes;
    std::vector<std::vector<Vec3f>> outlines;
    std::vector<PlaneExtent> extents;
    std::vector<std::uint8_t> plane_labels;

    void add_plane(Vec3d normal, double offset, double area, std::vector<Vec3f> outline) {
        outlines.push_back(std::move(outline));
        shapes.push_back({normal, offset, area, nullptr, static_cast<int>(outlines.back().size())});
    }
    void classify(Vec3d up) {
        for (std::size_t i = 0; i < shapes.size(); ++i) shapes[i].outline = outlines[i].data();
        extents.resize(shapes.size());
        plane_labels.resize(shapes.size());
        classify_planes(shapes.data(), static_cast<int>(shapes.size()), up, nullptr, extents.data(),
                        plane_labels.data());
    }
    // A face within 8 mm of a labelled plane and its outline's box, and 20 degrees of its normal, is that
    // plane's.
    void label_faces() {
        mesh.labels.assign(mesh.triangles.size(), kLabelNone);
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            Vec3d p[3], c;
            for (std::size_t k = 0; k < 3; ++k) p[k] = to_double(mesh.positions[mesh.triangles[t][k]]);
            c = (p[0] + p[1] + p[2]) * (1.0 / 3);
            const Vec3d n = normalised(cross(p[1] - p[0], p[2] - p[0]));
            for (std::size_t i = 0; i < shapes.size(); ++i) {
                bool on = plane_labels[i] != kLabelNone && dot(n, shapes[i].normal) > 0.94 &&
                          std::fabs(dot(shapes[i].normal, c) + shapes[i].offset) < 0.008;
                const PlaneExtent& e = extents[i];
                for (int a = 0; a < 3 && on; ++a) {
                    const double s = dot(a < 2 ? e.axis[a] : cross(e.axis[0], e.axis[1]), c);
                    on = s > e.low[a] - 0.01 && s < e.high[a] + 0.01;
                }
                if (on) mesh.labels[t] = plane_labels[i];
            }
        }
    }
    std::vector<ObjectBox> find(int capacity, int* needed, std::vector<std::uint32_t>* faces) const {
        const std::uint64_t v = mesh.positions.size(), t = mesh.triangles.size();
        std::vector<std::uint32_t> scratch(object_scratch_words(v, t), 7);
        std::vector<ObjectBox> out(static_cast<std::size_t>(capacity));
        faces->assign(t, 5);
        ObjectInput input{&mesh.positions[0].x,
                          v,
                          mesh.triangles[0].data(),
                          t,
                          mesh.labels.data(),
                          shapes.data(),
                          extents.data(),
                          plane_labels.data(),
                          static_cast<int>(shapes.size()),
                          {}};
        std::vector<std::uint8_t> kinds(200000), depths(200000);
        std::vector<std::uint32_t> parents(200000);
        input.footprint = {kinds.data(), depths.data(), parents.data(), kinds.size()};
        const int count =
            find_objects(input, {}, scratch.data(), out.data(), capacity, needed, faces->data());
        out.resize(static_cast<std::size_t>(count));
        return out;
    }
};

// Components of what truly is no structure: things that touch are one. Smaller than min_area are left out,
// and so is what lies within 5 mm of the desk: a sheet of paper is desk to a scan, and would join what lies
// on it.
std::vector<Box> true_objects(const TriangleMesh& mesh, double min_area) {
    std::vector<std::uint32_t> parent(mesh.positions.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    const auto object = [&](std::size_t t) {
        float top = 0;
        for (const std::uint32_t v : mesh.triangles[t]) top = std::max(top, mesh.positions[v].z);
        return mesh.labels[t] == kLabelNone && top > 0.745f;
    };
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t k = 1; k < 3 && object(t); ++k)
            parent[root(mesh.triangles[t][0])] = root(mesh.triangles[t][k]);
    std::map<std::uint32_t, Box> boxes;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!object(t)) continue;
        Box& box = boxes[root(mesh.triangles[t][0])];
        Vec3d p[3];
        for (std::size_t k = 0; k < 3; ++k) box.add(p[k] = to_double(mesh.positions[mesh.triangles[t][k]]));
        box.area += 0.5 * norm(cross(p[1] - p[0], p[2] - p[0]));
    }
    std::vector<Box> out;
    for (const auto& [v, box] : boxes)
        if (box.area >= min_area && box.high.z > 0.755) out.push_back(box);
    return out;
}

Scan desk_scan(std::uint64_t seed, double noise_m, std::vector<Box>* truth) {
    Scan scan;
    auto scene = make_scene("desk", seed);
    EXPECT_TRUE(scene.ok());
    Jobs jobs(1);
    auto mesh = truth_mesh(**scene, 0.005, jobs);
    EXPECT_TRUE(mesh.ok());
    scan.mesh = std::move(*mesh);
    *truth = true_objects(scan.mesh, 0.003);
    Rng rng(seed);
    for (Vec3f& p : scan.mesh.positions)
        p = p + to_float(noise_m * Vec3d{rng.normal(), rng.normal(), rng.normal()});
    for (const TruthPlane& plane : PlaneSurvey(**scene).planes()) {
        if (plane.area_m2 < 0.25) continue;
        std::vector<Vec3f> outline;
        for (const Vec3d& p : plane.polygon) outline.push_back(to_float(p));
        scan.add_plane(plane.normal, plane.offset, plane.area_m2, std::move(outline));
    }
    scan.classify({0, 0, 1});
    scan.label_faces();
    return scan;
}

TEST(PlaneObjects, OfRenderedDesks) {
    int all = 0, found = 0, extra = 0;
    for (std::uint64_t seed = 1; seed <= sized<std::uint64_t>(3, 1); ++seed) {
        std::vector<Box> truth;
        const Scan scan = desk_scan(seed, 0.0005, &truth);
        int needed = 0;
        std::vector<std::uint32_t> faces;
        const auto objects = scan.find(200, &needed, &faces);
        EXPECT_EQ(needed, static_cast<int>(objects.size()));
        std::vector<bool> used(objects.size());
        for (const Box& box : truth) {
            ++all;
            bool matched = false;
            for (std::size_t i = 0; i < objects.size(); ++i)
                if (box_iou(box, objects[i]) >= 0.5) matched = used[i] = true;
            found += matched;
        }
        extra += static_cast<int>(std::count(used.begin(), used.end(), false));

        // What is said of the faces is what is said of the objects.
        std::vector<ObjectBox> counted(objects.size());
        for (std::size_t t = 0; t < faces.size(); ++t) {
            if (faces[t] == kNoObject) continue;
            ASSERT_LT(faces[t], objects.size());
            EXPECT_EQ(scan.mesh.labels[t], kLabelNone);
            ++counted[faces[t]].faces;
            for (const std::uint32_t v : scan.mesh.triangles[t])
                for (int a = 0; a < 3; ++a) {
                    EXPECT_GE(scan.mesh.positions[v][a], objects[faces[t]].low[a]);
                    EXPECT_LE(scan.mesh.positions[v][a], objects[faces[t]].high[a]);
                }
        }
        for (std::size_t i = 0; i < objects.size(); ++i) {
            EXPECT_EQ(counted[i].faces, objects[i].faces);
            if (i > 0) {
                EXPECT_LE(objects[i].area_m2, objects[i - 1].area_m2);
            }
        }
    }
    std::printf("objects: %d of %d found, %d that are none\n", found, all, extra);
    EXPECT_GE(found, 0.95 * all);
    EXPECT_LE(extra, 0.1 * all);
}

// Discs seen from above, in cells of 5 mm: how many parts, and whether every disc has its own.
struct Disc {
    double u, v, radius;
    bool stands;
};
int parts_of(const std::vector<Disc>& discs, bool* own) {
    PlaneExtent support;
    support.facing = Facing::up;
    support.axis[0] = {1, 0, 0};
    support.axis[1] = {0, 1, 0};
    std::vector<std::uint8_t> kinds(20000), depths(20000);
    std::vector<std::uint32_t> parents(20000);
    Footprint footprint;
    const double low[2] = {-0.2, -0.2}, high[2] = {0.4, 0.2};
    EXPECT_TRUE(footprint.begin({kinds.data(), depths.data(), parents.data(), kinds.size()}, support, low,
                                high, 0.005));
    for (const Disc& d : discs)
        for (double v = -0.2; v < 0.2; v += 0.0025)
            for (double u = -0.2; u < 0.4; u += 0.0025) {
                const double r = std::hypot(u - d.u, v - d.v);
                // Its side comes down to the table.
                if (r < d.radius) footprint.mark({u, v, 0.1}, d.stands && r > d.radius - 0.005);
            }
    const int parts = footprint.split();
    *own = true;
    for (std::size_t i = 0; i < discs.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            if (footprint.part_at({discs[i].u, discs[i].v, 0}) ==
                footprint.part_at({discs[j].u, discs[j].v, 0}))
                *own = false;
    return parts;
}

TEST(PlaneObjects, ThingsThatNearlyTouchAreCutAtTheirNeck) {
    bool own = false;
    EXPECT_EQ(parts_of({{0, 0, 0.08, true}}, &own), 1);
    EXPECT_EQ(parts_of({{0, 0, 0.08, true}, {0.134, 0.02, 0.06, true}}, &own), 2);
    EXPECT_TRUE(own);
    EXPECT_EQ(parts_of({{0, 0, 0.08, true}, {0.06, 0, 0.06, true}}, &own), 1) << "too deep in one another";
    EXPECT_EQ(parts_of({{0, 0, 0.08, true}, {0.13, 0.02, 0.06, false}}, &own), 1) << "a lamp's head";
    EXPECT_EQ(parts_of({{0, 0, 0.08, true}, {0.085, 0, 0.01, true}}, &own), 1) << "narrower than noise";
    EXPECT_EQ(parts_of({{0, 0, 0.08, true}, {0.134, 0.02, 0.06, true}, {0.25, -0.03, 0.07, true}}, &own), 3);
    EXPECT_TRUE(own);
}

// A table of 1 x 0.6 m as a height field of 1 cm with two boxes 4 cm apart, whose foot is rounded over 1 cm,
// and a strip of unlabelled faces between them.
Scan two_boxes() {
    Scan scan;
    const int nx = 101, ny = 61;
    const auto height = [](int i, int j) {
        const bool box = j >= 20 && j < 40 && ((i >= 20 && i < 40) || (i >= 44 && i < 70));
        return box ? 0.12 : 0.0;
    };
    for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i) {
            const double strip = j == 30 && i >= 40 && i < 44 ? 0.004 : 0;  // noise that joins them
            scan.mesh.positions.push_back(to_float(Vec3d{0.01 * i, 0.01 * j, height(i, j) + strip}));
        }
    for (int j = 0; j + 1 < ny; ++j)
        for (int i = 0; i + 1 < nx; ++i) {
            const auto v = static_cast<std::uint32_t>(j * nx + i), w = v + static_cast<std::uint32_t>(nx);
            scan.mesh.triangles.push_back({v, v + 1, w + 1});
            scan.mesh.triangles.push_back({v, w + 1, w});
        }
    scan.add_plane({0, 0, 1}, 0, 0.5, {{0, 0, 0}, {1, 0, 0}, {1, 0.6f, 0}, {0, 0.6f, 0}});
    scan.classify({0, 0, 1});
    scan.plane_labels[0] = kLabelTable;
    scan.label_faces();
    for (std::size_t t = 0; t < scan.mesh.triangles.size(); ++t)
        for (const std::uint32_t v : scan.mesh.triangles[t])
            if (const auto& p = scan.mesh.positions[v]; p.z > 0.003f && p.z < 0.01f)
                scan.mesh.labels[t] = kLabelNone;
    return scan;
}

TEST(PlaneObjects, AStripOfNoiseDoesNotJoin) {
    const Scan scan = two_boxes();
    int needed = 0;
    std::vector<std::uint32_t> faces;
    const auto objects = scan.find(10, &needed, &faces);
    ASSERT_EQ(objects.size(), 2u);
    EXPECT_NEAR(objects[0].low.x, 0.43, 1e-6);  // the flank is a cell wide
    EXPECT_NEAR(objects[0].high.x, 0.70, 1e-6);
    EXPECT_NEAR(objects[1].low.x, 0.19, 1e-6);
    EXPECT_NEAR(objects[1].high.x, 0.40, 1e-6);
    EXPECT_NEAR(objects[1].low.z, 0, 0.005);
    EXPECT_NEAR(objects[1].high.z, 0.12, 1e-6);

    // Too little room: the largest are kept, the number wanted is told, the other's faces have no object.
    const auto one = scan.find(1, &needed, &faces);
    EXPECT_EQ(needed, 2);
    ASSERT_EQ(one.size(), 1u);
    EXPECT_EQ(one[0].first_vertex, objects[0].first_vertex);
    for (const std::uint32_t f : faces) EXPECT_TRUE(f == 0 || f == kNoObject);
    EXPECT_EQ(scan.find(0, &needed, &faces).size(), 0u);
    EXPECT_EQ(needed, 2);
}

TEST(PlaneObjects, SeatsAreObjectsAndStructureIsNone) {
    Scan scan = two_boxes();
    int needed = 0;
    std::vector<std::uint32_t> faces;
    for (std::size_t t = 0; t < scan.mesh.triangles.size(); ++t)
        if (scan.mesh.positions[scan.mesh.triangles[t][0]].z > 0.1f) scan.mesh.labels[t] = kLabelSeat;
    auto objects = scan.find(10, &needed, &faces);
    ASSERT_EQ(objects.size(), 2u);
    EXPECT_GT(objects[0].seat_area_m2, 0.5 * 0.26 * 0.2);
    scan.mesh.labels.assign(scan.mesh.triangles.size(), kLabelWall);
    EXPECT_EQ(scan.find(10, &needed, &faces).size(), 0u);
    EXPECT_EQ(needed, 0);
}

}  // namespace
}  // namespace burin
