// SPDX-License-Identifier: MIT
// After burin_create the runtime allocates nothing: counted over a sequence with everything an application does
// per frame.
#include <gtest/gtest.h>

#include "api/allocation_counter.h"
#include "dataset_files.h"
#include "emulated.h"
#include "plane_scene.h"
#include "track_helpers.h"

namespace burin {
namespace {

#ifdef BURIN_COUNT_ALLOCATIONS

TEST(Memory, NothingIsAllocatedAfterCreate) {
    constexpr int kFrames = sized(200, 40);
    const Camera camera = test_camera();
    std::vector<Image<float>> depths;
    for (int i = 0; i < 10; ++i) depths.push_back(ball_and_wall().depth(camera, arc_pose(i, 10)));
    const Image<std::uint8_t> colour(160, 120, 3, 90);
    std::vector<float> positions(3 * 200000), normals(3 * 200000), depth(160 * 120), rays(3 * 160 * 120);
    std::vector<std::uint32_t> triangles(3 * 400000), scratch(2 * 200000);
    std::vector<std::uint8_t> colours(3 * 200000), rgb(3 * 160 * 120);
    std::vector<burin_chunk_key> keys(100000);

    struct Stored {
        std::vector<char> bytes = std::vector<char>(16u << 20);
        std::size_t at = 0;
    } stored;
    const burin_write write = [](void* user, const void* data, std::uint64_t bytes) {
        auto& s = *static_cast<Stored*>(user);
        std::memcpy(s.bytes.data() + s.at, data, bytes);
        s.at += bytes;
        return 0;
    };
    const burin_read read = [](void* user, void* data, std::uint64_t bytes) {
        auto& s = *static_cast<Stored*>(user);
        std::memcpy(data, s.bytes.data() + s.at, bytes);
        s.at += bytes;
        return 0;
    };
    const std::vector<std::uint8_t> confidence(160 * 120, 2);
    long logged = 0;

    for (const std::uint32_t threads : {1u, 3u}) {
        burin_config config = test_config();
        config.threads = threads;
        config.bilateral = config.edge_removal = config.angle_weight = 1;
        config.budget_bytes = 8u << 20;
        const ApiMap map(config);
        burin_hooks hooks = burin_hooks_default();
        int told = 0;
        hooks.user = &told;
        hooks.progress = [](void* user, double) {
            ++*static_cast<int*>(user);
            return 0;
        };
        hooks.run = [](void*, std::uint32_t count, burin_job body, void* context) {
            for (std::uint32_t job = 0; job < count; ++job) body(context, job);
            return 0;
        };
        hooks.pool_threads = 4;
        burin_set_log([](void* user, burin_log_level, const char*) { ++*static_cast<long*>(user); }, &logged);
        allocations = 0;
        {
            void* volatile probe = std::malloc(8);  // the counter counts
            std::free(probe);
        }
        ASSERT_GT(allocations.load(), 0);
        allocations = 0;
        {
            void* volatile probe = ::operator new(8);
            ::operator delete(probe);
        }
        if (!under_valgrind()) {
            ASSERT_GT(allocations.load(), 0);
        }
        allocations = 0;
        long first_frame = 0, failed = 0;
        std::uint64_t meshed = 0, hash = 0;
        for (int i = 0; i < kFrames; ++i) {
            FrameView view = frame_of(depths[static_cast<std::size_t>(i % 10)], camera, arc_pose(i % 10, 10));
            view.colour = colour.view();
            view.colour_camera = camera;
            burin_frame frame = c_frame(view);
            frame.colour_format = i % 2 ? BURIN_PIXEL_RGB8 : BURIN_PIXEL_BGR8;
            frame.confidence = confidence.data();
            frame.confidence_stride_bytes = 160;
            frame.min_confidence = 1;
            burin_frame_result result;
            failed += burin_integrate(map.map, &frame, &result) != BURIN_OK;
            std::uint64_t count = 0;
            failed += burin_dirty_chunks(map.map, keys.data(), keys.size(), &count) != BURIN_OK;
            burin_mesh_buffers mesh{
                200000, 400000, positions.data(), normals.data(), colours.data(), triangles.data(), 0, 0};
            for (std::uint64_t k = 0; k < count; ++k)
                failed += burin_chunk_mesh(map.map, keys[k], nullptr, &mesh) != BURIN_OK;
            if (i % 10 == 0) {
                failed += burin_mesh(map.map, nullptr, &mesh) != BURIN_OK;
                meshed += mesh.triangle_count;
                failed += burin_mesh_remove_small(&mesh, 50, scratch.data()) != BURIN_OK;
                failed += burin_raycast(map.map, &frame.depth_camera, &frame.T_world_camera, depth.data(),
                                        rays.data(), rgb.data()) != BURIN_OK;
                burin_statistics stats;
                failed += burin_stats(map.map, &stats) != BURIN_OK;
                failed += burin_hash(map.map, &hash) != BURIN_OK;
                stored.at = 0;
                failed += burin_save_to(map.map, write, &stored) != BURIN_OK;
                stored.at = 0;
                failed += burin_load_from(map.map, read, &stored) != BURIN_OK;
                burin_file_info info;
                stored.at = 0;
                failed += burin_probe_from(read, &stored, &info) != BURIN_OK || info.hash != hash;
                failed += burin_set_hooks(map.map, i % 20 ? &hooks : nullptr) != BURIN_OK;
                const double point[3] = {0, 0, 2};
                float distance = 0;
                failed += burin_sample(map.map, point, 1, &distance, nullptr) != BURIN_OK;
            }
            burin_frame bad = frame;
            bad.T_world_camera.qw = NAN;
            failed += burin_integrate(map.map, &bad, nullptr) != BURIN_INVALID_ARGUMENT;
            if (i == 0) first_frame = allocations.load();
            if (i == kFrames / 2) failed += burin_reset(map.map) != BURIN_OK;
        }
        const long all = allocations.load();  // before gtest allocates
        EXPECT_EQ(all, 0) << threads << " threads, " << first_frame << " of them in the first frame";
        burin_set_log(nullptr, nullptr);
        EXPECT_EQ(failed, 0);
        EXPECT_GT(told, 5 * kFrames);
        EXPECT_EQ(logged, kFrames) << "bad frames";
        logged = 0;
        EXPECT_GT(meshed, kFrames / 10 * 1000u);
    }
}

// With a store in use all the while: the thread and its buffers are there since burin_create.
TEST(Memory, AStoreAllocatesNothingEither) {
    const TempFolder folder;
    const std::string path = folder.path("store");
    const Camera camera = test_camera();
    std::vector<Image<float>> depths;
    const auto pose = [](int i) {
        return look_from({0, 0, 0}, {std::sin(i * 0.3), 0.1 * std::cos(i), std::cos(i * 0.3)});
    };
    const AnalyticScene scene{{{{0, 0, -1}, -3}, {{0, 0, 1}, -3}, {{-1, 0, 0}, -3}, {{1, 0, 0}, -3}}, {}};
    for (int i = 0; i < 60; ++i) depths.push_back(scene.depth(camera, pose(i)));
    burin_config config = test_config();
    config.budget_bytes = 4u << 20;
    config.store_chunks = 10000;
    config.threads = 2;
    const ApiMap map(config);
    std::vector<float> positions(3 * 1944);
    std::vector<std::uint32_t> triangles(3 * 2560);
    std::vector<burin_chunk_key> keys(10000);
    long failed = 0;
    std::uint64_t hash = 0, count = 0;
    allocations = 0;
    failed += burin_store_open(map.map, path.c_str(), BURIN_STORE_NEW) != BURIN_OK;
    for (int i = 0; i < 60; ++i) {
        const burin_frame frame = c_frame(frame_of(depths[static_cast<std::size_t>(i)], camera, pose(i)));
        burin_frame_result result;
        failed += burin_integrate(map.map, &frame, &result) != BURIN_OK;
        failed += result.flags != 0;
        if (i % 20 == 19) {
            failed += burin_store_commit(map.map) != BURIN_OK;
            failed += burin_hash(map.map, &hash) != BURIN_OK;
            failed += burin_chunks(map.map, keys.data(), keys.size(), &count) != BURIN_OK;
            burin_mesh_buffers mesh{1944, 2560, positions.data(), nullptr, nullptr, triangles.data(), 0, 0};
            for (std::uint64_t k = 0; k < count; k += 50)
                failed += burin_chunk_mesh(map.map, keys[k], nullptr, &mesh) != BURIN_OK;
        }
    }
    const long all = allocations.load();
    EXPECT_EQ(all, 0);
    EXPECT_EQ(failed, 0);
    EXPECT_GT(map.stats().chunks_evicted, 100u);
    EXPECT_GT(map.stats().chunks_reloaded, 100u);
    EXPECT_EQ(map.stats().arena_bytes, map.bytes);
}

// Planes, with everything that is asked of them, every frame or now and then.
TEST(Memory, PlanesAllocateNothing) {
    const PlaneScene scene;
    std::vector<Image<float>> depths;
    for (int i = 0; i < 60; ++i) depths.push_back(scene.depth(test_camera(), walk_pose(i), i));
    std::vector<float> positions(3 * 200000), normals(3 * 200000);
    std::vector<std::uint32_t> triangles(3 * 400000), ids(400000);
    std::vector<std::uint8_t> labels(400000), filled(400000);
    std::vector<burin_chunk_key> keys(100000);
    std::vector<burin_plane> planes(512);
    std::vector<burin_plane_event> events(1024);
    std::vector<double> points(3 * 20000);
    std::vector<std::uint32_t> starts(1000);
    for (const std::uint32_t threads : {1u, 3u}) {
        burin_config config = plane_config();
        config.threads = threads;
        const ApiMap map(config);
        allocations = 0;
        long failed = 0;
        std::uint64_t count = 0, rings = 0, lost = 0, told = 0, outlined = 0, labelled = 0;
        for (int i = 0; i < 60; ++i) {
            const burin_frame frame =
                c_frame(frame_of(depths[static_cast<std::size_t>(i)], test_camera(), walk_pose(i)));
            failed += burin_integrate(map.map, &frame, nullptr) != BURIN_OK;
            burin_mesh_buffers mesh{
                200000, 400000, positions.data(), normals.data(), nullptr, triangles.data(), 0, 0};
            failed += burin_dirty_chunks(map.map, keys.data(), keys.size(), &count) != BURIN_OK;
            for (std::uint64_t k = 0; k < count; ++k)
                failed += burin_chunk_mesh(map.map, keys[k], nullptr, &mesh) != BURIN_OK;
            failed += burin_plane_events(map.map, events.data(), events.size(), &count, &lost) != BURIN_OK;
            if (i % 10 != 9) continue;
            const double up[3] = {0, 0, 1}, origin[3] = {0, 0.4, 1}, down[3] = {0, 0, -1};
            failed += burin_set_up(map.map, up) != BURIN_OK;
            failed += burin_refresh_planes(map.map) != BURIN_OK;
            failed += burin_planes(map.map, planes.data(), planes.size(), &count) != BURIN_OK;
            told = count;
            for (std::uint64_t p = 0; p < told; ++p)
                for (const std::uint32_t completed : {0u, 1u}) {
                    failed += burin_plane_outline(map.map, planes[p].id, completed, points.data(), 20000,
                                                  &count, starts.data(), 1000, &rings) != BURIN_OK;
                    outlined += rings;
                }
            failed += burin_mesh(map.map, nullptr, &mesh) != BURIN_OK;
            failed += burin_label_faces(map.map, &mesh, labels.data(), ids.data(), filled.data()) != BURIN_OK;
            for (std::uint64_t t = 0; t < mesh.triangle_count; ++t) labelled += ids[t] != 0;
            std::uint32_t id = 0;
            double distance = 0;
            failed += burin_plane_hit(map.map, origin, down, 4, &id, &distance) != BURIN_OK || id == 0;
            if (i == 29) failed += burin_reset(map.map) != BURIN_OK;
        }
        const long all = allocations.load();  // before gtest allocates
        EXPECT_EQ(all, 0) << threads << " threads";
        EXPECT_EQ(failed, 0);
        EXPECT_EQ(told, 3u);
        EXPECT_GE(outlined, 24u);
        EXPECT_GT(labelled, 10000u);
    }
}

// Tracking, with everything that may come: colour, an IMU, frames without depth, the camera found again, a
// map loaded.
TEST(Memory, AScanAllocatesNothing) {
    const RoomSequence& room = room_sequence();
    const Image<float> nothing(160, 120);
    const ImuSample imu[2] = {{0, {0.1, 0, 0}, {0, -9.81, 0}}, {1, {0.1, 0, 0}, {0, -9.81, 0}}};
    std::vector<char> stored(64u << 20);
    struct Stream {
        char* data;
        std::size_t at = 0;
    } stream{stored.data()};
    for (const std::uint32_t tracker : {BURIN_TRACKER_SDF, BURIN_TRACKER_ICP}) {
        burin_config config = scan_config();
        config.tracker = tracker;
        config.threads = 2;
        const ApiMap map(config);
        allocations = 0;
        long failed = 0;
        int states[3] = {}, found = 0;
        for (int i = 0; i < 60; ++i) {
            const int at = i % 30;
            burin_frame frame = c_frame(room.frame(at));
            frame.t_ns = i * std::int64_t{33333333};
            if (at >= 10 && at < 13) frame.depth = nothing.view().data;
            burin_imu_sample samples[2];
            std::memcpy(samples, imu, sizeof imu);
            samples[0].t_ns = frame.t_ns - 33333333;
            samples[1].t_ns = frame.t_ns;
            frame.imu = samples;
            frame.imu_count = 2;
            burin_scan_result result = {};
            failed += burin_scan(map.map, &frame, &result) != BURIN_OK;
            ++states[result.state];
            found += result.relocalised != 0;
            double up[3], sigma;
            burin_up(map.map, up, &sigma);
            if (i != 29) continue;
            stream.at = 0;
            failed += burin_save_to(
                          map.map,
                          [](void* user, const void* data, std::uint64_t bytes) {
                              auto& s = *static_cast<Stream*>(user);
                              std::memcpy(s.data + s.at, data, bytes);
                              s.at += bytes;
                              return 0;
                          },
                          &stream) != BURIN_OK;
            stream.at = 0;
            failed += burin_load_from(
                          map.map,
                          [](void* user, void* data, std::uint64_t bytes) {
                              auto& s = *static_cast<Stream*>(user);
                              std::memcpy(data, s.data + s.at, bytes);
                              s.at += bytes;
                              return 0;
                          },
                          &stream) != BURIN_OK;
        }
        const long all = allocations.load();  // before gtest allocates
        EXPECT_EQ(all, 0) << "tracker " << tracker;
        EXPECT_EQ(failed, 0);
        EXPECT_EQ(states[BURIN_TRACKING_LOST], 6);
        EXPECT_GT(states[BURIN_TRACKING_OK], 30);
        EXPECT_EQ(found, 3) << "twice after the blanks, once in the loaded map";
    }
}

#else
TEST(Memory, NothingIsAllocatedAfterCreate) { GTEST_SKIP() << "SKIPPED: this build has its own malloc"; }
#endif

}  // namespace
}  // namespace burin
