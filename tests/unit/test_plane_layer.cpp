// SPDX-License-Identifier: MIT
// Planes over the frames of a session: a floor, two walls and a low box, seen by a camera that walks by.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "core/hash.h"
#include "plane_scene.h"
#include "scene_helpers.h"
#include "simd/targets.h"

namespace burin {
namespace {

double degrees_between(Vec3d a, Vec3d b) { return std::atan2(norm(cross(a, b)), dot(a, b)) * 180 / M_PI; }

void fuse(TestSession& t, const PlaneScene& scene, int first, int last) {
    for (int i = first; i < last; ++i) {
        const Image<float> depth = scene.depth(test_camera(), walk_pose(i), i);
        ASSERT_EQ(t.integrate(frame_of(depth, test_camera(), walk_pose(i))).chunks.dropped, 0u);
    }
}

std::vector<const GlobalPlane*> told(TestSession& t) {
    std::vector<const GlobalPlane*> all;
    const PlaneLayer& layer = t.session.planes();
    for (std::uint32_t i = 0; i < layer.set().used(); ++i)
        if (layer.told(layer.set().at(i))) all.push_back(&layer.set().at(i));
    return all;
}

std::uint64_t planes_hash(TestSession& t) {
    std::uint64_t h = 0;
    for (const GlobalPlane* p : told(t)) {
        h = hash_bytes(&p->id, sizeof p->id, h);
        h = hash_bytes(&p->normal, sizeof p->normal, h);
        h = hash_bytes(&p->offset, sizeof p->offset, h);
        h = hash_bytes(&p->fit, sizeof p->fit, h);
        h = hash_bytes(&p->area_m2, sizeof p->area_m2, h);
        h = hash_bytes(&p->label, sizeof p->label, h);
    }
    return h;
}

std::uint64_t mesh_hash(TestSession& t) {
    const TriangleMesh m = t.mesh({});
    return hash_bytes(m.triangles.data(), m.triangles.size() * sizeof m.triangles[0],
                      hash_bytes(m.positions.data(), m.positions.size() * sizeof m.positions[0]));
}

// The plane of the scene that a found one is: the floor and the walls are in free space's direction.
const GlobalPlane* find(TestSession& t, Vec3d normal, double offset) {
    for (const GlobalPlane* p : told(t))
        if (dot(p->normal, normal) > 0.97 && std::fabs(p->offset - offset) < 0.05) return p;
    return nullptr;
}

TEST(PlaneLayer, FindsTheRoomOnTheFly) {
    TestSession t(plane_config());
    const PlaneScene scene;
    fuse(t, scene, 0, 150);  // two turns of every chunk
    // These cameras look down by 45 degrees in the mean, from which the way up cannot be guessed.
    t.session.planes().set_up({0, 0, 1});
    for (const bool refreshed : {false, true}) {
        if (refreshed) t.session.refresh_planes(t.jobs);
        for (const PlaneScene::Face& face : scene.faces) {
            const GlobalPlane* p = find(t, face.normal, face.offset);
            ASSERT_TRUE(p) << face.normal.x << ' ' << face.normal.y << ' ' << face.normal.z;
            EXPECT_LT(degrees_between(p->normal, face.normal), 0.5);
            // Where it was seen, not at the origin, which may be far from it.
            EXPECT_NEAR(dot(face.normal, p->fit.centroid) + face.offset, 0, 0.002);
            EXPECT_GT(p->area_m2, 0.5);
        }
        EXPECT_EQ(told(t).size(), 3u) << "the box is too small to be told";
    }
    EXPECT_EQ(find(t, {0, 0, 1}, 0)->label, kLabelFloor);
}

TEST(PlaneLayer, IdsLastAndEventsTellTheSame) {
    TestSession t(plane_config());
    const PlaneScene scene;
    std::map<std::uint32_t, bool> alive;  // by the events alone
    std::map<std::uint32_t, Vec3d> seen;
    std::uint32_t last_new = 0;
    for (int i = 0; i < 200; ++i) {
        fuse(t, scene, i, i + 1);
        if (i % 50 == 49) t.session.refresh_planes(t.jobs);
        PlaneEvent events[1024];
        std::uint64_t lost = 0;
        const std::uint32_t count = t.session.planes().set().take_events(events, 1024, &lost);
        ASSERT_EQ(lost, 0u);
        for (std::uint32_t e = 0; e < count; ++e) switch (events[e].what) {
                case PlaneChange::added:
                    EXPECT_GT(events[e].id, last_new) << "ids are never used again";
                    last_new = events[e].id;
                    alive[events[e].id] = true;
                    break;
                case PlaneChange::changed:
                    EXPECT_TRUE(alive[events[e].id]) << i;
                    break;
                case PlaneChange::merged:
                    EXPECT_TRUE(alive[events[e].id] && alive[events[e].into]) << i;
                    alive[events[e].id] = false;
                    break;
                case PlaneChange::removed:
                    EXPECT_TRUE(alive[events[e].id]) << i;
                    alive[events[e].id] = false;
                    break;
            }
        std::size_t living = 0;
        for (const auto& [id, is] : alive) living += is;
        std::size_t there = 0;
        const PlaneSet& set = t.session.planes().set();
        for (std::uint32_t k = 0; k < set.used(); ++k) {
            const GlobalPlane& p = set.at(k);
            if (p.id == 0) continue;
            ++there;
            EXPECT_TRUE(alive[p.id]) << "frame " << i << ": plane " << p.id << " was not told";
            // A plane keeps its id, and an id its plane.
            if (p.area_m2 < 0.1) continue;
            if (seen.count(p.id) > 0) {
                EXPECT_LT(degrees_between(seen[p.id], p.normal), 12) << p.id;
            }
            seen[p.id] = p.normal;
        }
        EXPECT_EQ(there, living) << i;
    }
    EXPECT_GE(last_new, 3u);
    EXPECT_EQ(told(t).size(), 3u);
}

TEST(PlaneLayer, TheMapIsTheSameWithAndWithout) {
    burin_config config = plane_config();
    TestSession with(config);
    config.planes = 0;
    TestSession without(config);
    const PlaneScene scene;
    fuse(with, scene, 0, 60);
    fuse(without, scene, 0, 60);
    const std::uint64_t hash = with.session.hash();
    EXPECT_EQ(hash, without.session.hash());
    with.session.refresh_planes(with.jobs);
    EXPECT_EQ(hash, with.session.hash()) << "planes only read the volume";
    EXPECT_NE(mesh_hash(with), mesh_hash(without)) << "the surface joins the planes";
    // And planes off means that nothing is there.
    without.session.refresh_planes(without.jobs);
    EXPECT_EQ(without.session.planes().set().used(), 0u);
    EXPECT_EQ(without.session.planes().overlay().count(), 0u);
}

TEST(PlaneLayer, RefreshTwiceIsRefreshOnce) {
    TestSession t(plane_config());
    fuse(t, PlaneScene{}, 0, 80);
    t.session.refresh_planes(t.jobs);
    const std::uint64_t planes = planes_hash(t), mesh = mesh_hash(t);
    t.session.refresh_planes(t.jobs);
    EXPECT_EQ(planes_hash(t), planes);
    EXPECT_EQ(mesh_hash(t), mesh);
}

TEST(PlaneLayer, ThreadsAndKernelsChangeNothing) {
    const PlaneScene scene;
    std::uint64_t planes[2] = {}, mesh[2] = {};
    for (const std::string& target : simd::target_names())
        for (const std::uint32_t threads : {1u, 2u}) {
            ASSERT_TRUE(simd::select_target(target));
            burin_config config = plane_config();
            config.threads = threads;
            TestSession t(config);
            fuse(t, scene, 0, 70);
            for (int refreshed = 0; refreshed < 2; ++refreshed) {
                if (refreshed) t.session.refresh_planes(t.jobs);
                const std::uint64_t p = planes_hash(t), m = mesh_hash(t);
                if (mesh[refreshed] == 0) planes[refreshed] = p, mesh[refreshed] = m;
                EXPECT_EQ(p, planes[refreshed]) << target << ", " << threads << " threads, " << refreshed;
                EXPECT_EQ(m, mesh[refreshed]) << target << ", " << threads << " threads, " << refreshed;
            }
            EXPECT_EQ(told(t).size(), 3u);
        }
    ASSERT_TRUE(simd::select_target(""));
    EXPECT_NE(planes[0], planes[1]);
}

TEST(PlaneLayer, ClearForgets) {
    TestSession t(plane_config());
    fuse(t, PlaneScene{}, 0, 70);
    t.session.refresh_planes(t.jobs);
    const std::uint64_t planes = planes_hash(t), mesh = mesh_hash(t);
    t.session.clear();
    EXPECT_EQ(told(t).size(), 0u);
    EXPECT_EQ(t.session.planes().overlay().count(), 0u);
    EXPECT_EQ(t.session.planes().set().events(), 0u);
    EXPECT_EQ(t.mesh({}).triangles.size(), 0u);
    fuse(t, PlaneScene{}, 0, 70);
    t.session.refresh_planes(t.jobs);
    EXPECT_EQ(planes_hash(t), planes) << "as if it were new";
    EXPECT_EQ(mesh_hash(t), mesh);
}

TEST(PlaneLayer, ABoxOf40MillimetresKeepsItsHeight) {
    TestSession t(plane_config());
    const PlaneScene scene;
    fuse(t, scene, 0, 100);
    t.session.refresh_planes(t.jobs);
    const TriangleMesh m = t.mesh({});
    int on_top = 0, beside = 0;
    double top = 0, floor = 0, worst_floor = 0;
    for (const Vec3f& v : m.positions) {
        const Vec3d p = to_double(v);
        const double margin = 0.04;  // the truncation: nearer to its rim, distances are those of its sides
        const bool in = p.x > scene.box_low.x + margin && p.x < scene.box_high.x - margin &&
                        p.y > scene.box_low.y + margin && p.y < scene.box_high.y - margin;
        const bool out = p.x < scene.box_low.x - 0.1 || p.x > scene.box_high.x + 0.1 ||
                         p.y < scene.box_low.y - 0.1 || p.y > scene.box_high.y + 0.1;
        if (in && p.z > -0.05) ++on_top, top += p.z;
        if (out && std::fabs(p.z) < 0.02 && p.x > -0.6 && p.x < 0.6 && p.y > 0.1 && p.y < 1.2) {
            ++beside, floor += p.z;
            worst_floor = std::max(worst_floor, std::fabs(p.z));
        }
    }
    ASSERT_GT(on_top, 200);
    ASSERT_GT(beside, 2000);
    EXPECT_NEAR(top / on_top - floor / beside, 0.04, 0.002);
    EXPECT_LT(worst_floor, 0.002) << "the floor lies in its plane";
}

// Square metres of the mesh within a part of the floor, and of it what is marked as completed.
std::pair<double, double> floor_area(TestSession& t, Vec3d low, Vec3d high) {
    const TriangleMesh m = t.mesh({});
    std::vector<std::uint8_t> filled(m.triangles.size());
    t.session.planes().label_faces(&m.positions[0].x, m.triangles[0].data(), m.triangles.size(), nullptr,
                                   nullptr, filled.data(), t.volume(), t.jobs);
    double all = 0, marked = 0;
    for (std::size_t i = 0; i < m.triangles.size(); ++i) {
        Vec3d corner[3];
        for (std::size_t k = 0; k < 3; ++k) corner[k] = to_double(m.positions[m.triangles[i][k]]);
        const Vec3d middle = (corner[0] + corner[1] + corner[2]) * (1.0 / 3);
        if (middle.x < low.x || middle.x > high.x || middle.y < low.y || middle.y > high.y ||
            std::fabs(middle.z) > 0.01)
            continue;
        const double area = 0.5 * norm(cross(corner[1] - corner[0], corner[2] - corner[0]));
        all += area;
        marked += filled[i] ? area : 0;
    }
    return {all, marked};
}

TEST(PlaneLayer, WhatNobodySawIsCompletedAndMarked) {
    PlaneScene scene;
    scene.blind = true;
    TestSession t(plane_config());
    fuse(t, scene, 0, 100);
    const auto before = floor_area(t, scene.hole_low, scene.hole_high);
    t.session.refresh_planes(t.jobs);
    const auto after = floor_area(t, scene.hole_low, scene.hole_high);
    const double whole = (scene.hole_high.x - scene.hole_low.x) * (scene.hole_high.y - scene.hole_low.y);
    EXPECT_LT(before.first, 0.15 * whole) << "a rim of half a pixel";
    EXPECT_NEAR(after.first, whole, 0.03 * whole);
    EXPECT_GT(after.second, 0.8 * whole);
    // Beside it, everything was seen.
    const auto beside = floor_area(t, {-0.2, 0.3, 0}, {0, 0.5, 0});
    EXPECT_NEAR(beside.first, 0.04, 0.002);
    EXPECT_EQ(beside.second, 0);
}

TEST(PlaneLayer, WhatWasSeenEmptyStaysEmpty) {
    PlaneScene scene;
    scene.pit = true;
    TestSession t(plane_config());
    fuse(t, scene, 0, 100);
    t.session.refresh_planes(t.jobs);
    const double margin = 0.03;  // voxels at the rim have distances of the floor's edge
    const auto area =
        floor_area(t, scene.hole_low + Vec3d{margin, margin, 0}, scene.hole_high - Vec3d{margin, margin, 0});
    EXPECT_EQ(area.first, 0);
    EXPECT_GT(floor_area(t, {-0.2, 0.3, 0}, {0, 0.5, 0}).first, 0.038);
}

// The middle of a wide opening is in no chunk: nothing near it was ever measured, only seen through.
TEST(PlaneLayer, AWideOpeningStaysOpen) {
    PlaneScene scene;
    scene.pit = true;
    scene.hole_low = {-0.7, 0.2, 0};
    scene.hole_high = {-0.1, 0.8, 0};
    TestSession t(plane_config());
    fuse(t, scene, 0, 100);
    t.session.refresh_planes(t.jobs);
    const double margin = 0.03;
    EXPECT_EQ(
        floor_area(t, scene.hole_low + Vec3d{margin, margin, 0}, scene.hole_high - Vec3d{margin, margin, 0})
            .first,
        0);
}

// Patches of a ball of 60 mm touch it each in another direction: no plane comes of them.
TEST(PlaneLayer, ABallIsNoPlane) {
    AnalyticScene ball{{}, {{{0, 0, 1}, 0.06}}};
    burin_config config = plane_config();
    config.voxel_m = 0.005f;
    TestSession t(config);
    for (int i = 0; i < 70; ++i) {
        const double a = 0.09 * i;
        const Se3 pose =
            look_from({0.5 * std::sin(a), 0.1 * std::sin(3 * a), 1 - 0.5 * std::cos(a)}, {0, 0, 1});
        const Image<float> depth = ball.depth(test_camera(), pose);
        t.integrate(frame_of(depth, test_camera(), pose));
    }
    t.session.refresh_planes(t.jobs);
    EXPECT_GT(t.mesh({}).triangles.size(), 1000u);
    EXPECT_EQ(told(t).size(), 0u);
}

}  // namespace
}  // namespace burin
