// SPDX-License-Identifier: MIT
// Planes behind the C API: what is told of a room, wrong calls, budgets, a store.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "api_checks.h"
#include "dataset_files.h"
#include "plane_scene.h"

namespace burin {
namespace {

void fuse(const ApiMap& map, const PlaneScene& scene, int first, int last) {
    for (int i = first; i < last; ++i) {
        const Image<float> depth = scene.depth(test_camera(), walk_pose(i), i);
        const burin_frame frame = c_frame(frame_of(depth, test_camera(), walk_pose(i)));
        ASSERT_EQ(burin_integrate(map.map, &frame, nullptr), BURIN_OK) << burin_last_error(map.map);
    }
}

std::vector<burin_plane> planes_of(const ApiMap& map) {
    std::uint64_t count = 0;
    burin_planes(map.map, nullptr, 0, &count);
    std::vector<burin_plane> planes(count);
    EXPECT_EQ(burin_planes(map.map, planes.data(), count, &count), BURIN_OK);
    EXPECT_EQ(count, planes.size());
    return planes;
}

struct Rings {
    std::vector<double> points;
    std::vector<std::uint32_t> starts;  // and the end
};
Rings outline_of(const ApiMap& map, std::uint32_t id, bool completed) {
    std::uint64_t count = 0, rings = 0;
    burin_plane_outline(map.map, id, completed, nullptr, 0, &count, nullptr, 0, &rings);
    Rings r{std::vector<double>(3 * count), std::vector<std::uint32_t>(rings)};
    EXPECT_EQ(burin_plane_outline(map.map, id, completed, r.points.data(), count, &count, r.starts.data(),
                                  rings, &rings),
              BURIN_OK);
    r.starts.push_back(static_cast<std::uint32_t>(count));
    return r;
}
// Holes count negative: they run the other way.
double area_of(const Rings& r, const double normal[3]) {
    Vec3d twice;
    const auto at = [&](std::size_t k) {
        return Vec3d{r.points[3 * k], r.points[3 * k + 1], r.points[3 * k + 2]};
    };
    for (std::size_t i = 0; i + 1 < r.starts.size(); ++i)
        for (std::size_t k = r.starts[i]; k < r.starts[i + 1]; ++k)
            twice = twice + cross(at(k), at(k + 1 < r.starts[i + 1] ? k + 1 : r.starts[i]));
    return 0.5 * dot(twice, Vec3d{normal[0], normal[1], normal[2]});
}

class ApiPlanes : public testing::Test {
  protected:
    ApiPlanes() : map_(plane_config()) {
        const double up[3] = {0, 0, 1};
        EXPECT_EQ(burin_set_up(map_.map, up), BURIN_OK);
        fuse(map_, scene_, 0, 80);
        EXPECT_EQ(burin_refresh_planes(map_.map), BURIN_OK);
        planes_ = planes_of(map_);
        EXPECT_EQ(planes_.size(), 3u);
    }
    const PlaneScene scene_{};
    const ApiMap map_;
    std::vector<burin_plane> planes_;
};

TEST_F(ApiPlanes, TellThemselves) {
    std::uint32_t last = 0;
    int floors = 0;
    for (const burin_plane& p : planes_) {
        EXPECT_GT(p.id, last) << "in order of id";
        last = p.id;
        EXPECT_NEAR(norm(Vec3d{p.normal[0], p.normal[1], p.normal[2]}), 1, 1e-12);
        EXPECT_GT(p.area_m2, 0.5);
        EXPECT_GT(p.support, 50u);
        EXPECT_GT(p.rms_m, 0);
        EXPECT_LT(p.rms_m, 0.002) << "noise of 1 mm";
        floors += p.label == BURIN_LABEL_FLOOR;
    }
    EXPECT_EQ(floors, 1);
    double up[3];
    ASSERT_EQ(burin_planes_up(map_.map, up), BURIN_OK);
    EXPECT_GT(up[2], 0.999);
}

// Symmetric, and along no direction negative; shifts along the normal and tilts within it are unsure, while
// the length of the normal is sure.
TEST_F(ApiPlanes, CovarianceIsOne) {
    Rng rng(7);
    for (const burin_plane& p : planes_) {
        double trace = 0;
        for (int r = 0; r < 4; ++r) {
            trace += p.covariance[5 * r];
            for (int c = 0; c < 4; ++c) EXPECT_EQ(p.covariance[4 * r + c], p.covariance[4 * c + r]);
        }
        ASSERT_GT(trace, 0);
        const auto along = [&](const double v[4]) {
            double sum = 0;
            for (int r = 0; r < 4; ++r)
                for (int c = 0; c < 4; ++c) sum += v[r] * p.covariance[4 * r + c] * v[c];
            return sum;
        };
        for (int i = 0; i < 100; ++i) {
            const double v[4] = {rng.normal(), rng.normal(), rng.normal(), rng.normal()};
            EXPECT_GE(along(v), -1e-12 * trace);
        }
        const double n[4] = {p.normal[0], p.normal[1], p.normal[2], 0}, d[4] = {0, 0, 0, 1};
        // The normal in use lags behind the fitted one by 1/25 voxel on the plane, 1e-3 rad.
        EXPECT_LT(along(n), 1e-5 * trace);
        EXPECT_GT(along(d), 0);
        EXPECT_LT(along(d), 0.002 * 0.002);
    }
}

TEST_F(ApiPlanes, OutlinesHoldTheArea) {
    for (const burin_plane& p : planes_) {
        const Rings seen = outline_of(map_, p.id, false), whole = outline_of(map_, p.id, true);
        ASSERT_GE(seen.starts.size(), 2u);
        EXPECT_NEAR(area_of(seen, p.normal), p.area_m2, 0.04 * p.area_m2) << p.id;
        EXPECT_GE(area_of(whole, p.normal), 0.98 * area_of(seen, p.normal)) << p.id;
        for (std::size_t k = 0; 3 * k < seen.points.size(); ++k) {
            double off = p.offset;
            for (std::size_t r = 0; r < 3; ++r) off += p.normal[r] * seen.points[3 * k + r];
            EXPECT_NEAR(off, 0, 1e-9) << "on the plane";
        }
    }
}

TEST_F(ApiPlanes, RaysHitWhereSomethingWasSeen) {
    struct {
        Vec3d origin, towards;
        double distance;  // 0: nothing
    } const cases[] = {
        {{0, 0.4, 1}, {0, 0.4, 0}, 1},        // down on the floor
        {{0, 0.4, -1}, {0, 0.4, 0}, 0},       // from below
        {{0, 0.4, 1}, {0, 0.4, 2}, 0},        // up into the sky
        {{0, 0.6, 0.3}, {-1, 0.6, 0.3}, 1},   // the wall x = -1
        {{0, 0.6, 0.3}, {0, 1.4, 0.3}, 0.8},  // the wall y = 1.4
        {{5, 5, 1}, {5, 5, 0}, 0},            // the floor's plane, where nobody looked
    };
    for (const auto& c : cases) {
        const Vec3d d = normalised(c.towards - c.origin);
        const double o[3] = {c.origin.x, c.origin.y, c.origin.z}, direction[3] = {d.x, d.y, d.z};
        std::uint32_t id = 77;
        double distance = -1;
        ASSERT_EQ(burin_plane_hit(map_.map, o, direction, 3, &id, &distance), BURIN_OK);
        EXPECT_EQ(id != 0, c.distance > 0) << c.origin.x << ' ' << c.origin.y << ' ' << c.origin.z;
        EXPECT_NEAR(distance, c.distance > 0 ? c.distance : 3, 0.002);
        if (c.distance == 0) continue;
        ASSERT_EQ(burin_plane_hit(map_.map, o, direction, c.distance - 0.01, &id, &distance), BURIN_OK);
        EXPECT_EQ(id, 0u) << "farther than max_m";
        EXPECT_EQ(distance, c.distance - 0.01);
    }
}

TEST_F(ApiPlanes, FacesBelongToThePlanesThatAreTold) {
    burin_mesh_buffers mesh{};
    ASSERT_EQ(burin_mesh_size(map_.map, nullptr, &mesh.vertex_count, &mesh.triangle_count), BURIN_OK);
    std::vector<float> positions(3 * mesh.vertex_count);
    std::vector<std::uint32_t> triangles(3 * mesh.triangle_count), ids(mesh.triangle_count);
    std::vector<std::uint8_t> labels(mesh.triangle_count), filled(mesh.triangle_count);
    mesh.vertex_capacity = mesh.vertex_count;
    mesh.triangle_capacity = mesh.triangle_count;
    mesh.positions = positions.data();
    mesh.triangles = triangles.data();
    ASSERT_EQ(burin_mesh(map_.map, nullptr, &mesh), BURIN_OK);
    ASSERT_EQ(burin_label_faces(map_.map, &mesh, labels.data(), ids.data(), filled.data()), BURIN_OK);
    std::size_t on_planes = 0;
    for (std::size_t t = 0; t < ids.size(); ++t) {
        if (ids[t] == 0) {
            EXPECT_EQ(labels[t], 0);
            continue;
        }
        ++on_planes;
        const auto p = std::find_if(planes_.begin(), planes_.end(),
                                    [&](const burin_plane& plane) { return plane.id == ids[t]; });
        ASSERT_TRUE(p != planes_.end()) << ids[t];
        ASSERT_EQ(labels[t], p->label);
    }
    EXPECT_GT(on_planes, ids.size() * 8 / 10);
    EXPECT_EQ(burin_label_faces(map_.map, &mesh, nullptr, nullptr, nullptr), BURIN_OK) << "each may be null";

    // Positions are the caller's: whatever they are, nothing is read outside.
    for (const float bad : {std::nanf(""), INFINITY, 1e30f, -3e9f}) {
        std::fill(positions.begin(), positions.end(), bad);
        ASSERT_EQ(burin_label_faces(map_.map, &mesh, labels.data(), ids.data(), filled.data()), BURIN_OK);
        EXPECT_EQ(ids[0], 0u);
        EXPECT_EQ(labels[0], 0);
    }
    triangles[4] = static_cast<std::uint32_t>(mesh.vertex_count);
    EXPECT_EQ(burin_label_faces(map_.map, &mesh, labels.data(), nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    expect_text(map_.map, "index");
    mesh.positions = nullptr;
    EXPECT_EQ(burin_label_faces(map_.map, &mesh, labels.data(), nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    expect_text(map_.map, "mesh->positions");
    mesh.triangle_count = 0;
    EXPECT_EQ(burin_label_faces(map_.map, &mesh, labels.data(), nullptr, nullptr), BURIN_OK);
    EXPECT_EQ(burin_label_faces(map_.map, nullptr, labels.data(), nullptr, nullptr), BURIN_INVALID_ARGUMENT);
}

TEST_F(ApiPlanes, WrongCalls) {
    const burin_map map = map_.map;
    std::uint64_t count = 0, rings = 0;
    burin_plane room[3];
    EXPECT_EQ(burin_planes(map, room, 2, &count), BURIN_INSUFFICIENT_MEMORY);
    EXPECT_EQ(count, 3u);
    expect_text(map, "3 are needed");
    EXPECT_EQ(burin_planes(map, nullptr, 3, &count), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_planes(map, room, 3, nullptr), BURIN_INVALID_ARGUMENT);

    burin_plane_event event;
    EXPECT_EQ(burin_plane_events(map, &event, 1, nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_plane_events(map, nullptr, 1, &count, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_plane_events(map, nullptr, 0, &count, nullptr), BURIN_OK);
    EXPECT_EQ(count, 0u);
    std::uint64_t lost = 1;
    ASSERT_EQ(burin_plane_events(map, &event, 1, &count, &lost), BURIN_OK);
    EXPECT_EQ(count, 1u);
    EXPECT_EQ(event.change, static_cast<std::uint32_t>(BURIN_PLANE_ADDED));
    EXPECT_EQ(lost, 0u);

    double points[3];
    std::uint32_t starts[1];
    for (const std::uint32_t id : {0u, 12345u, ~0u}) {
        EXPECT_EQ(burin_plane_outline(map, id, 0, nullptr, 0, &count, nullptr, 0, &rings),
                  BURIN_INVALID_ARGUMENT);
        expect_text(map, std::to_string(id));
    }
    const std::uint32_t id = planes_[0].id;
    EXPECT_EQ(burin_plane_outline(map, id, 0, points, 1, &count, starts, 1, &rings),
              BURIN_INSUFFICIENT_MEMORY);
    EXPECT_GE(count, 4u);
    EXPECT_GE(rings, 1u);
    expect_text(map, std::to_string(count) + " and " + std::to_string(rings));
    EXPECT_EQ(burin_plane_outline(map, id, 0, nullptr, 1, &count, starts, 1, &rings), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_plane_outline(map, id, 0, points, 1, &count, nullptr, 1, &rings), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_plane_outline(map, id, 0, points, 1, nullptr, starts, 1, &rings), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_plane_outline(map, id, 0, points, 1, &count, starts, 1, nullptr), BURIN_INVALID_ARGUMENT);

    const double o[3] = {0, 0, 1}, down[3] = {0, 0, -1}, twice[3] = {0, 0, -2}, nothing[3] = {0, 0, 0},
                 bad[3] = {0, std::nan(""), 0}, far[3] = {0, 0, INFINITY};
    std::uint32_t hit;
    double distance;
    EXPECT_EQ(burin_plane_hit(map, nullptr, down, 1, &hit, &distance), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_plane_hit(map, o, nullptr, 1, &hit, &distance), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_plane_hit(map, o, down, 1, nullptr, &distance), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_plane_hit(map, o, down, 1, &hit, nullptr), BURIN_INVALID_ARGUMENT);
    for (const double* direction : {twice, nothing, bad, far}) {
        EXPECT_EQ(burin_plane_hit(map, o, direction, 1, &hit, &distance), BURIN_INVALID_ARGUMENT);
        expect_text(map, "unit");
        EXPECT_EQ(burin_set_up(map, direction), BURIN_INVALID_ARGUMENT);
        expect_text(map, "unit");
    }
    for (const double* origin : {bad, far})
        EXPECT_EQ(burin_plane_hit(map, origin, down, 1, &hit, &distance), BURIN_INVALID_ARGUMENT);
    for (const double max_m : {-1.0, std::nan("")})
        EXPECT_EQ(burin_plane_hit(map, o, down, max_m, &hit, &distance), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_plane_hit(map, o, down, INFINITY, &hit, &distance), BURIN_OK);
    EXPECT_EQ(burin_set_up(map, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_planes_up(map, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(planes_of(map_).size(), 3u);

    ASSERT_EQ(burin_reset(map), BURIN_OK);
    EXPECT_EQ(planes_of(map_).size(), 0u);
    ASSERT_EQ(burin_plane_events(map, &event, 1, &count, nullptr), BURIN_OK);
    EXPECT_EQ(count, 0u);
    EXPECT_EQ(burin_plane_outline(map, id, 0, nullptr, 0, &count, nullptr, 0, &rings),
              BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_refresh_planes(map), BURIN_OK) << "an empty map";
}

TEST(ApiPlanesOff, EveryCallSaysSo) {
    burin_config config = plane_config();
    config.planes = 2;
    std::uint64_t bytes = 0;
    EXPECT_EQ(burin_bytes(&config, &bytes), BURIN_INVALID_ARGUMENT);
    expect_text(kNull, "planes");
    config.planes = 0;
    const ApiMap map(config);
    std::uint64_t n = 0;
    std::uint32_t id = 0;
    double d[3] = {0, 0, 1};
    burin_mesh_buffers mesh{};
    const burin_status all[] = {burin_refresh_planes(map.map),
                                burin_planes(map.map, nullptr, 0, &n),
                                burin_plane_events(map.map, nullptr, 0, &n, nullptr),
                                burin_label_faces(map.map, &mesh, nullptr, nullptr, nullptr),
                                burin_plane_outline(map.map, 1, 0, nullptr, 0, &n, nullptr, 0, &n),
                                burin_plane_hit(map.map, d, d, 1, &id, d),
                                burin_set_up(map.map, d),
                                burin_planes_up(map.map, d)};
    for (const burin_status status : all) EXPECT_EQ(status, BURIN_STATE);
    expect_text(map.map, "config.planes");
    EXPECT_NE(burin_refresh_planes(kNull), BURIN_OK);
}

// Too little memory for the room: frames say what they dropped, and planes are of what there is.
TEST(ApiPlanesBudget, ATinyBudgetStillEnds) {
    burin_config config = plane_config();
    config.budget_bytes = 8u << 20;
    const ApiMap map(config);
    EXPECT_LE(map.bytes, config.budget_bytes);
    std::printf("%u chunks\n", static_cast<unsigned>(map.stats().chunks_capacity));
    const PlaneScene scene;
    fuse(map, scene, 0, 70);
    EXPECT_GT(map.stats().chunks_dropped, 0u);
    EXPECT_EQ(burin_refresh_planes(map.map), BURIN_OK);
    for (const burin_plane& p : planes_of(map)) {
        EXPECT_NEAR(norm(Vec3d{p.normal[0], p.normal[1], p.normal[2]}), 1, 1e-12);
        EXPECT_GT(outline_of(map, p.id, true).starts.size(), 1u);
    }
    std::uint64_t vertices = 0, triangles = 0;
    EXPECT_EQ(burin_mesh_size(map.map, nullptr, &vertices, &triangles), BURIN_OK);
    EXPECT_GT(triangles, 1000u);
}

// Chunks leave for the store and come back, which moves those that stay to other slots.
TEST(ApiPlanesStore, ChunksThatLeaveAndComeBack) {
    const TempFolder folder;
    burin_config config = plane_config();
    config.voxel_m = 0.005f;
    config.budget_bytes = 16u << 20;
    config.store_chunks = 20000;
    const ApiMap map(config);
    ASSERT_EQ(burin_store_open(map.map, folder.path("store").c_str(), BURIN_STORE_NEW), BURIN_OK)
        << burin_last_error(map.map);
    burin_config off = config;
    off.planes = 0;
    off.budget_bytes = 128u << 20;
    const ApiMap without(off);
    const PlaneScene scene;
    std::vector<burin_chunk_key> keys(20000);
    std::vector<float> positions(3 * 1944);
    std::vector<std::uint32_t> triangles(3 * 2560);
    for (int i = 0; i < 90; ++i) {
        const Se3 pose = look_from(
            {0.3, 0, 1}, {std::sin(0.07 * i) * 1.5 - 0.3, 1, 0.3 + 0.2 * std::cos(0.2 * i)}, {0, 0, 1});
        const Image<float> depth = scene.depth(test_camera(), pose, i);
        const burin_frame frame = c_frame(frame_of(depth, test_camera(), pose));
        ASSERT_EQ(burin_integrate(map.map, &frame, nullptr), BURIN_OK);
        ASSERT_EQ(burin_integrate(without.map, &frame, nullptr), BURIN_OK);
        if (i % 30 != 29) continue;
        ASSERT_EQ(burin_refresh_planes(map.map), BURIN_OK);
        std::uint64_t count = 0;
        ASSERT_EQ(burin_chunks(map.map, keys.data(), keys.size(), &count), BURIN_OK);
        for (std::uint64_t k = 0; k < count; k += 20) {
            burin_mesh_buffers mesh{1944, 2560, positions.data(), nullptr, nullptr, triangles.data(), 0, 0};
            ASSERT_EQ(burin_chunk_mesh(map.map, keys[k], nullptr, &mesh), BURIN_OK);
        }
        for (const burin_plane& p : planes_of(map)) outline_of(map, p.id, true);
    }
    EXPECT_GT(map.stats().chunks_evicted, 100u);
    EXPECT_GT(map.stats().chunks_reloaded, 100u);
    EXPECT_EQ(map.hash(), without.hash()) << "the map is as without planes and in one piece";
    for (const burin_plane& p : planes_of(map)) EXPECT_GT(p.support, 0u);
    // The layer has room for half as many chunks as fit the memory; those that left give way to new ones.
    EXPECT_GE(planes_of(map).size(), 1u);

    ASSERT_EQ(burin_reset(map.map), BURIN_OK);
    EXPECT_EQ(planes_of(map).size(), 0u);
}

// The map becomes another one: what was found in the former is not of it.
TEST(ApiPlanesStore, AResumedStoreBeginsWithoutPlanes) {
    const TempFolder folder;
    const std::string path = folder.path("store");
    burin_config config = plane_config();
    config.store_chunks = 20000;
    const PlaneScene scene;
    {
        const ApiMap map(config);
        ASSERT_EQ(burin_store_open(map.map, path.c_str(), BURIN_STORE_NEW), BURIN_OK);
        fuse(map, scene, 0, 3);
        ASSERT_EQ(burin_store_commit(map.map), BURIN_OK);
    }
    const ApiMap map(config);
    fuse(map, scene, 0, 70);
    ASSERT_EQ(burin_refresh_planes(map.map), BURIN_OK);
    EXPECT_EQ(planes_of(map).size(), 3u);
    ASSERT_EQ(burin_store_open(map.map, path.c_str(), BURIN_STORE_RESUME), BURIN_OK);
    EXPECT_EQ(planes_of(map).size(), 0u);
    fuse(map, scene, 3, 73);
    ASSERT_EQ(burin_refresh_planes(map.map), BURIN_OK);
    EXPECT_EQ(planes_of(map).size(), 3u);
}

}  // namespace
}  // namespace burin
