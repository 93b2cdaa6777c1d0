// SPDX-License-Identifier: MIT
// Wrong calls on a map: each has its own status and one line of text, and none changes the map.
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <limits>
#include <thread>

#include "api_checks.h"
#include "emulated.h"
#include "scene_helpers.h"

namespace burin {
namespace {

class OneMap : public testing::Test {
  protected:
    OneMap()
        : map_(test_config()),
          depth_(ball_and_wall().depth(camera_, arc_pose(0, 3))),
          colour_(160, 120, 3, 90) {
        good_ = c_frame(frame_of(depth_, camera_, arc_pose(0, 3)));
        good_.colour = colour_.pixels.data();
        good_.colour_stride_bytes = 480;
        good_.colour_camera = c_camera(camera_);
        EXPECT_EQ(burin_integrate(map_.map, &good_, nullptr), BURIN_OK) << burin_last_error(map_.map);
        hash_ = map_.hash();
        frames_ = map_.stats().frames;
    }
    ~OneMap() override {
        EXPECT_EQ(map_.hash(), hash_) << "a call that failed changed the map";
        EXPECT_EQ(map_.stats().frames, frames_);
    }

    const Camera camera_ = test_camera();
    const ApiMap map_;
    Image<float> depth_;
    Image<std::uint8_t> colour_;
    burin_frame good_;
    std::uint64_t hash_ = 0, frames_ = 0;
};

TEST_F(OneMap, BadFrames) {
    const double nan = std::nan(""), inf = INFINITY;
    struct BadFrame {
        const char* part;  // of the text
        std::function<void(burin_frame&)> spoil;
    };
    const BadFrame cases[] = {
        {"size", [](burin_frame& f) { f.struct_size = 0; }},
        {"size", [](burin_frame& f) { f.struct_size += 8; }},
        {"depth is null", [](burin_frame& f) { f.depth = nullptr; }},
        {"depth_type", [](burin_frame& f) { f.depth_type = 2; }},
        {"depth_unit_m", [](burin_frame& f) { f.depth_unit_m = 0; }},
        {"depth_unit_m", [](burin_frame& f) { f.depth_unit_m = -0.001; }},
        {"depth_unit_m", [=](burin_frame& f) { f.depth_unit_m = nan; }},
        {"depth_stride_bytes", [](burin_frame& f) { f.depth_stride_bytes = 160 * 4 - 4; }},
        {"depth_stride_bytes", [](burin_frame& f) { f.depth_stride_bytes = 160 * 4 + 2; }},
        {"depth_stride_bytes", [](burin_frame& f) { f.depth_stride_bytes = 0; }},
        {"depth_stride_bytes", [](burin_frame& f) { f.depth_stride_bytes = ~std::uint64_t{0} - 639; }},
        {"aligned", [](burin_frame& f) { f.depth = static_cast<const char*>(f.depth) + 1; }},
        {"depth camera", [](burin_frame& f) { f.depth_camera.width = 0; }},
        {"depth camera", [](burin_frame& f) { f.depth_camera.height = 0xffffffffu; }},
        {"at most 160x120",
         [](burin_frame& f) {
             f.depth_camera.width = 161;
             f.depth_stride_bytes = 161 * 4;
         }},
        {"depth camera", [=](burin_frame& f) { f.depth_camera.fx = nan; }},
        {"depth camera", [](burin_frame& f) { f.depth_camera.fx = -100; }},
        {"depth camera", [](burin_frame& f) { f.depth_camera.fy = 1e9; }},
        {"depth camera", [](burin_frame& f) { f.depth_camera.cx = 1e6; }},
        {"depth camera", [=](burin_frame& f) { f.depth_camera.cy = inf; }},
        {"depth camera", [=](burin_frame& f) { f.depth_camera.k3 = nan; }},
        {"depth camera", [](burin_frame& f) { f.depth_camera.p1 = 1e5; }},
        {"T_world_camera", [=](burin_frame& f) { f.T_world_camera.tx = nan; }},
        {"T_world_camera", [=](burin_frame& f) { f.T_world_camera.tz = inf; }},
        {"T_world_camera", [](burin_frame& f) { f.T_world_camera.ty = 1e7; }},
        {"T_world_camera",
         [](burin_frame& f) {
             f.T_world_camera.qw = 0, f.T_world_camera.qx = 0, f.T_world_camera.qy = 0,
             f.T_world_camera.qz = 0;
         }},
        {"T_world_camera",
         [](burin_frame& f) {
             f.T_world_camera.qw *= 2;
             f.T_world_camera.qx = 1;
         }},
        {"T_world_camera", [=](burin_frame& f) { f.T_world_camera.qz = nan; }},
        {"colour_stride_bytes", [](burin_frame& f) { f.colour_stride_bytes = 479; }},
        {"colour_stride_bytes",
         [](burin_frame& f) { f.colour_stride_bytes = 1u << 31; }},  // 32-bit offsets in kernels
        {"colour_format", [](burin_frame& f) { f.colour_format = 8; }},
        {"colour_stride_bytes", [](burin_frame& f) { f.colour_format = BURIN_PIXEL_RGBA8; }},
        {"chroma is null", [](burin_frame& f) { f.colour_format = BURIN_PIXEL_NV12; }},
        {"chroma_stride_bytes",
         [](burin_frame& f) {
             f.colour_format = BURIN_PIXEL_NV21, f.chroma = f.colour;
             f.chroma_stride_bytes = 159;
         }},
        {"confidence_stride_bytes",
         [](burin_frame& f) {
             f.confidence = f.colour;
             f.confidence_stride_bytes = 159;
         }},
        {"min_confidence",
         [](burin_frame& f) {
             f.confidence = f.colour;
             f.confidence_stride_bytes = 160, f.min_confidence = 256;
         }},
        {"reserved", [](burin_frame& f) { f.reserved[7] = 1; }},
        {"colour camera", [](burin_frame& f) { f.colour_camera.width = 0; }},
        {"colour camera", [](burin_frame& f) { f.colour_camera.fx = 0; }},
        {"T_colour_depth", [=](burin_frame& f) { f.T_colour_depth.tx = nan; }},
        {"T_colour_depth", [](burin_frame& f) { f.T_colour_depth.qw = 3; }},
    };
    for (const BadFrame& bad : cases) {
        burin_frame frame = good_;
        bad.spoil(frame);
        burin_frame_result result{};
        result.chunks_new = 123;
        EXPECT_EQ(burin_integrate(map_.map, &frame, &result), BURIN_INVALID_ARGUMENT) << bad.part;
        expect_text(map_.map, bad.part);
        EXPECT_EQ(result.chunks_new, 123u);
    }
    EXPECT_EQ(burin_integrate(map_.map, nullptr, nullptr), BURIN_INVALID_ARGUMENT);
}

TEST_F(OneMap, AbsurdButAllowedCamerasEnd) {
    // The widest and the longest lenses that pass the check, principal points outside: slow is no crash, but
    // must end.
    burin_config config = test_config();
    const ApiMap other(config);
    for (const double f : {0.051, 99.0})
        for (const double c : {-0.99, 0.5, 1.99}) {
            if (kEmulated && c > 0) continue;  // half a minute each
            burin_frame frame = good_;
            frame.depth_camera.fx = f * 160, frame.depth_camera.fy = f * 120;
            frame.depth_camera.cx = c * 160, frame.depth_camera.cy = c * 120;
            EXPECT_EQ(burin_integrate(other.map, &frame, nullptr), BURIN_OK) << burin_last_error(other.map);
        }
    burin_frame frame = good_;
    frame.depth_camera.k1 = 300, frame.depth_camera.k2 = -600;
    EXPECT_EQ(burin_integrate(other.map, &frame, nullptr), BURIN_OK);
    frame = good_;
    frame.T_colour_depth.tx = 1e300;
    EXPECT_EQ(burin_integrate(other.map, &frame, nullptr), BURIN_OK) << "colour that falls nowhere";
}

TEST_F(OneMap, NullArguments) {
    const burin_map m = map_.map;
    std::uint64_t n = 0;
    const burin_camera camera = c_camera(camera_);
    const burin_pose pose = c_pose({});
    float distance = 0;
    EXPECT_EQ(burin_stats(m, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_hash(m, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_mesh_size(m, nullptr, nullptr, &n), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_mesh_size(m, nullptr, &n, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_mesh(m, nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_dirty_chunks(m, nullptr, 4, &n), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_dirty_chunks(m, nullptr, 0, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_changed_chunks(m, nullptr, nullptr, 4, &n), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_changed_chunks(m, nullptr, nullptr, 0, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_chunk_mesh(m, {0, 0, 0}, nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_raycast(m, nullptr, &pose, nullptr, nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_raycast(m, &camera, nullptr, nullptr, nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_sample(m, nullptr, 1, &distance, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_sample(m, &pose.tx, 1, nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_sample(m, nullptr, 0, nullptr, nullptr), BURIN_OK);
    EXPECT_EQ(burin_save(m, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_load(m, nullptr), BURIN_INVALID_ARGUMENT);
    burin_file_info info;
    EXPECT_EQ(burin_file_probe(nullptr, &info), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_file_probe("x", nullptr), BURIN_INVALID_ARGUMENT);
    burin_mesh_buffers mesh{};
    mesh.vertex_count = 3, mesh.triangle_count = 1;
    std::uint32_t scratch[6];
    EXPECT_EQ(burin_mesh_remove_small(nullptr, 1, scratch), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_mesh_remove_small(&mesh, 1, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_mesh_remove_small(&mesh, 1, scratch), BURIN_INVALID_ARGUMENT) << "triangles are null";
    std::uint32_t triangle[3] = {0, 1, 3};
    mesh.triangles = triangle;
    EXPECT_EQ(burin_mesh_remove_small(&mesh, 1, scratch), BURIN_INVALID_ARGUMENT)
        << "an index that is no vertex";
}

TEST_F(OneMap, MeshOptionsAndBuffers) {
    std::uint64_t vertices = 0, triangles = 0;
    for (const auto& spoil : {+[](burin_mesh_options& o) { o.struct_size = 4; },
                              +[](burin_mesh_options& o) { o.min_weight = NAN; },
                              +[](burin_mesh_options& o) { o.min_weight = -1; },
                              +[](burin_mesh_options& o) { o.max_jump_voxels = 1; },
                              +[](burin_mesh_options& o) { o.max_jump_voxels = NAN; }}) {
        burin_mesh_options options = burin_mesh_options_default();
        spoil(options);
        EXPECT_EQ(burin_mesh_size(map_.map, &options, &vertices, &triangles), BURIN_INVALID_ARGUMENT);
        expect_text(map_.map, "mesh options");
    }
    ASSERT_EQ(burin_mesh_size(map_.map, nullptr, &vertices, &triangles), BURIN_OK);
    std::vector<float> positions(3 * vertices);
    std::vector<std::uint32_t> corners(3 * triangles);
    for (const int few : {0, 1, 2}) {
        burin_mesh_buffers mesh{vertices - (few == 0),
                                triangles - (few == 1),
                                positions.data(),
                                nullptr,
                                nullptr,
                                corners.data(),
                                0,
                                0};
        std::fill(corners.begin(), corners.end(), 77u);
        EXPECT_EQ(burin_mesh(map_.map, nullptr, &mesh), few == 2 ? BURIN_OK : BURIN_INSUFFICIENT_MEMORY);
        EXPECT_EQ(mesh.vertex_count, vertices);
        EXPECT_EQ(mesh.triangle_count, triangles);
        EXPECT_EQ(corners[0] == 77u && corners[1] == 77u, few != 2) << "written to although too small";
    }
    burin_mesh_buffers none{};
    EXPECT_EQ(burin_mesh(map_.map, nullptr, &none), BURIN_INSUFFICIENT_MEMORY);
    EXPECT_EQ(none.vertex_count, vertices);
    none.vertex_capacity = 1;
    EXPECT_EQ(burin_mesh(map_.map, nullptr, &none), BURIN_INVALID_ARGUMENT) << "a capacity without a buffer";

    burin_mesh_buffers small{1943, 2560, positions.data(), nullptr, nullptr, corners.data(), 0, 0};
    EXPECT_EQ(burin_chunk_mesh(map_.map, {0, 0, 0}, nullptr, &small), BURIN_INSUFFICIENT_MEMORY);
    EXPECT_EQ(small.vertex_count, 1944u);
    EXPECT_EQ(small.triangle_count, 2560u);
    EXPECT_EQ(burin_chunk_mesh(map_.map, {1 << 20, 0, 0}, nullptr, &small), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_chunk_mesh(map_.map, {0, std::numeric_limits<std::int32_t>::min(), 0}, nullptr, &small),
              BURIN_INVALID_ARGUMENT);
}

TEST_F(OneMap, ChangeOptions) {
    std::uint64_t n = 0;
    const auto outcome = [&](auto&& edit) {
        burin_change_options options = burin_change_options_default();
        edit(options);
        return burin_changed_chunks(map_.map, &options, nullptr, 0, &n);
    };
    const auto fits = [](burin_status status) {
        return status == BURIN_OK || status == BURIN_INSUFFICIENT_MEMORY;
    };
    EXPECT_TRUE(fits(outcome([](burin_change_options&) {})));
    EXPECT_TRUE(fits(outcome([](burin_change_options& o) { o.threshold_voxels = 1e30f; })));
    EXPECT_TRUE(fits(outcome([](burin_change_options& o) { o.interval = 65535; })));
    EXPECT_EQ(outcome([](burin_change_options& o) { o.struct_size = 0; }), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(outcome([](burin_change_options& o) { o.threshold_voxels = -0.1f; }), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(outcome([](burin_change_options& o) { o.threshold_voxels = std::nanf(""); }),
              BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(outcome([](burin_change_options& o) { o.interval = 0; }), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(outcome([](burin_change_options& o) { o.interval = 65536; }), BURIN_INVALID_ARGUMENT);
}

TEST_F(OneMap, Raycasts) {
    burin_camera camera = c_camera(camera_);
    burin_pose pose = c_pose({});
    std::vector<float> depth(160 * 120, 7.0f);
    camera.k1 = 0.1;
    EXPECT_EQ(burin_raycast(map_.map, &camera, &pose, depth.data(), nullptr, nullptr), BURIN_UNSUPPORTED);
    camera.k1 = 0;
    camera.width = 0;
    EXPECT_EQ(burin_raycast(map_.map, &camera, &pose, depth.data(), nullptr, nullptr),
              BURIN_INVALID_ARGUMENT);
    camera = c_camera(camera_);
    for (double* value : {&pose.tx, &pose.ty, &pose.tz, &pose.qx, &pose.qw}) {
        const double kept = *value;
        *value = std::nan("");
        EXPECT_EQ(burin_raycast(map_.map, &camera, &pose, depth.data(), nullptr, nullptr),
                  BURIN_INVALID_ARGUMENT);
        *value = kept;
    }
    for (const float d : depth) ASSERT_EQ(d, 7.0f);
}

TEST_F(OneMap, NullMap) {
    std::uint64_t n = 0;
    burin_statistics stats;
    burin_mesh_buffers mesh{};
    for (const burin_map m : {kNull, burin_map{65, 1}, burin_map{1, 0xffffffffu}, burin_map{0xffffffffu, 0},
                              burin_map{map_.map.index, map_.map.generation + 2}}) {
        EXPECT_EQ(burin_hash(m, &n), BURIN_STATE);
        EXPECT_EQ(burin_stats(m, &stats), BURIN_STATE);
        EXPECT_EQ(burin_integrate(m, &good_, nullptr), BURIN_STATE);
        EXPECT_EQ(burin_reset(m), BURIN_STATE);
        EXPECT_EQ(burin_mesh(m, nullptr, &mesh), BURIN_STATE);
        EXPECT_EQ(burin_save(m, "x"), BURIN_STATE);
        expect_text(kNull, "map");
    }
    burin_map null = kNull;
    EXPECT_EQ(burin_destroy(&null), BURIN_OK);
    EXPECT_EQ(burin_destroy(nullptr), BURIN_OK);
}

TEST_F(OneMap, ASecondThreadIsTurnedAway) {
    // One thread casts rays without pause; whatever another asks meanwhile either waits its turn or is
    // refused, and nothing else.
    std::atomic<bool> stop{false};
    std::atomic<int> done{0};
    std::thread busy([&] {
        std::vector<float> depth(160 * 120);
        const burin_camera camera = c_camera(camera_);
        const burin_pose pose = c_pose(arc_pose(0, 3));
        while (!stop)
            done += burin_raycast(map_.map, &camera, &pose, depth.data(), nullptr, nullptr) == BURIN_OK;
    });
    int refused = 0;
    for (int i = 0; i < 200000 && (refused < 20 || done < 20); ++i) {
        std::uint64_t hash = 0;
        const burin_status status = burin_hash(map_.map, &hash);
        ASSERT_TRUE(status == BURIN_OK || status == BURIN_STATE) << status;
        if (status == BURIN_OK) {
            ASSERT_EQ(hash, hash_);
        } else {
            ++refused;
            expect_text(kNull, "another thread");
        }
        std::this_thread::yield();
    }
    stop = true;
    busy.join();
    EXPECT_GT(refused, 0);
    EXPECT_GT(done.load(), 0);
}

}  // namespace
}  // namespace burin
