// SPDX-License-Identifier: MIT
// burin_mesh_objects: a ball above what is the floor when up is so; a list that is too short; misuse.
#include <gtest/gtest.h>

#include <vector>

#include "api_checks.h"
#include "scene_helpers.h"

namespace burin {
namespace {

struct Scan {
    explicit Scan(const burin_config& config) : map(config) {
        const Camera camera = test_camera();
        for (int i = 0; i < 12; ++i) {
            const Se3 T = arc_pose(i, 12);
            const Image<float> depth = scene.depth(camera, T);
            const burin_frame frame = c_frame(frame_of(depth, camera, T));
            EXPECT_EQ(burin_integrate(map.map, &frame, nullptr), BURIN_OK) << burin_last_error(map.map);
        }
        const double up[3] = {0, 0, -1};  // the wall at z = 2 is the floor, and the cameras are above it
        EXPECT_EQ(burin_set_up(map.map, up), BURIN_OK);
        EXPECT_EQ(burin_refresh_planes(map.map), BURIN_OK);
        EXPECT_EQ(burin_mesh_size(map.map, nullptr, &mesh.vertex_capacity, &mesh.triangle_capacity),
                  BURIN_OK);
        positions.resize(3 * mesh.vertex_capacity);
        triangles.resize(3 * mesh.triangle_capacity);
        mesh.positions = positions.data();
        mesh.triangles = triangles.data();
        EXPECT_EQ(burin_mesh(map.map, nullptr, &mesh), BURIN_OK);
        labels.resize(mesh.triangle_count);
        EXPECT_EQ(burin_label_faces(map.map, &mesh, labels.data(), nullptr, nullptr), BURIN_OK);
        scratch.resize(2 * mesh.vertex_count + mesh.triangle_count);
    }
    burin_status find(std::vector<burin_object>* out, std::uint64_t* count,
                      std::uint32_t* face_objects = nullptr) {
        return burin_mesh_objects(map.map, &mesh, labels.data(), scratch.data(), out->data(), out->size(),
                                  count, face_objects);
    }
    static AnalyticScene two_balls() {
        AnalyticScene s = ball_and_wall();
        s.balls = {{{-0.35, 0, 1.5}, 0.2}, {{0.35, 0.1, 1.6}, 0.15}};
        return s;
    }

    const AnalyticScene scene = two_balls();
    ApiMap map;
    burin_mesh_buffers mesh = {};
    std::vector<float> positions;
    std::vector<std::uint32_t> triangles, scratch;
    std::vector<std::uint8_t> labels;
};

burin_config planes_config() {
    burin_config c = test_config(0.01f);
    c.budget_bytes = 64u << 20;
    c.truncation_voxels = 6;
    c.planes = 1;
    return c;
}

TEST(ApiObjects, TwoBallsAboveTheFloor) {
    Scan scan(planes_config());
    std::vector<burin_object> objects(16);
    std::vector<std::uint32_t> of(scan.mesh.triangle_count);
    std::uint64_t count = 0;
    ASSERT_EQ(scan.find(&objects, &count, of.data()), BURIN_OK) << burin_last_error(scan.map.map);
    ASSERT_EQ(count, 2u);
    EXPECT_GT(objects[0].area_m2, objects[1].area_m2);
    constexpr double kVoxel = 0.01;
    for (int i = 0; i < 2; ++i) {
        const AnalyticScene::Ball& ball = scan.scene.balls[static_cast<std::size_t>(i)];
        const burin_object& o = objects[i];
        // From the cameras' side the top was seen whole; below, nothing.
        EXPECT_NEAR(o.min[2], ball.centre.z - ball.radius, kVoxel);
        EXPECT_LT(o.max[2], ball.centre.z + ball.radius);
        for (int r = 0; r < 2; ++r) {
            EXPECT_NEAR(o.min[r], ball.centre[r] - ball.radius, 2 * kVoxel) << i << " " << r;
            EXPECT_NEAR(o.max[r], ball.centre[r] + ball.radius, 2 * kVoxel) << i << " " << r;
        }
        EXPECT_EQ(o.label, static_cast<std::uint32_t>(BURIN_LABEL_NONE));
        std::uint64_t faces = 0;
        for (std::size_t t = 0; t < of.size(); ++t) {
            if (of[t] != static_cast<std::uint32_t>(i)) continue;
            ++faces;
            for (int k = 0; k < 3; ++k) {
                const float* p = &scan.positions[3 * std::size_t{scan.triangles[3 * t + std::size_t(k)]}];
                EXPECT_LT(std::fabs(norm(Vec3d{p[0], p[1], p[2]} - ball.centre) - ball.radius), 5 * kVoxel);
            }
        }
        EXPECT_EQ(faces, o.faces);
    }
}

TEST(ApiObjects, ShortListTellsWhatSuffices) {
    Scan scan(planes_config());
    std::uint64_t count = 0;
    std::vector<burin_object> objects;
    for (int tries = 0; scan.find(&objects, &count) == BURIN_INSUFFICIENT_MEMORY; ++tries) {
        ASSERT_LT(tries, 3);
        ASSERT_GT(count, objects.size());
        objects.resize(count);
    }
    EXPECT_EQ(count, 2u);
}

TEST(ApiObjects, Misuse) {
    Scan scan(planes_config());
    std::vector<burin_object> objects(4);
    std::uint64_t count = 0;
    const auto find = [&](const burin_mesh_buffers* mesh, const std::uint8_t* labels, std::uint32_t* scratch,
                          burin_object* out, std::uint64_t* n) {
        return burin_mesh_objects(scan.map.map, mesh, labels, scratch, out, 4, n, nullptr);
    };
    std::uint8_t* labels = scan.labels.data();
    std::uint32_t* scratch = scan.scratch.data();
    EXPECT_EQ(find(nullptr, labels, scratch, objects.data(), &count), BURIN_INVALID_ARGUMENT);
    expect_text(scan.map.map, "mesh");
    EXPECT_EQ(find(&scan.mesh, nullptr, scratch, objects.data(), &count), BURIN_INVALID_ARGUMENT);
    expect_text(scan.map.map, "face_labels");
    EXPECT_EQ(find(&scan.mesh, labels, nullptr, objects.data(), &count), BURIN_INVALID_ARGUMENT);
    expect_text(scan.map.map, "scratch");
    EXPECT_EQ(find(&scan.mesh, labels, scratch, nullptr, &count), BURIN_INVALID_ARGUMENT);
    expect_text(scan.map.map, "objects");
    EXPECT_EQ(find(&scan.mesh, labels, scratch, objects.data(), nullptr), BURIN_INVALID_ARGUMENT);
    expect_text(scan.map.map, "count");
    scan.triangles[4] = static_cast<std::uint32_t>(scan.mesh.vertex_count);
    EXPECT_EQ(find(&scan.mesh, labels, scratch, objects.data(), &count), BURIN_INVALID_ARGUMENT);
    expect_text(scan.map.map, "index");

    burin_config without = planes_config();
    without.planes = 0;
    const ApiMap map(without);
    EXPECT_EQ(burin_mesh_objects(map.map, &scan.mesh, labels, scratch, objects.data(), 4, &count, nullptr),
              BURIN_STATE);
    expect_text(map.map, "config.planes");
}

}  // namespace
}  // namespace burin
