// SPDX-License-Identifier: MIT
// burin_scan and burin_up at the C boundary: what they refuse, and what they report.
#include "api_checks.h"
#include "track_helpers.h"

namespace burin {
namespace {

burin_frame frame_at(int i, bool colour = true) { return c_frame(room_sequence().frame(i, colour)); }

// A turning IMU, level: up is -y in the room's world.
std::vector<burin_imu_sample> samples(int i) {
    std::vector<burin_imu_sample> out;
    for (int k = -10; k <= 1; ++k)
        out.push_back({i * std::int64_t{33333333} + k * std::int64_t{3333333}, {0, 0, 0}, {0, -9.81, 0}});
    return out;
}

TEST(ApiScan, NeedsATracker) {
    burin_config config = test_config();
    ASSERT_EQ(config.tracker, BURIN_TRACKER_NONE);
    const ApiMap map(config);
    const burin_frame frame = frame_at(0);
    burin_scan_result result;
    std::memset(&result, 0x5a, sizeof result);
    const burin_scan_result untouched = result;
    EXPECT_EQ(burin_scan(map.map, &frame, &result), BURIN_STATE);
    expect_text(map.map, "config.tracker is none");
    EXPECT_EQ(std::memcmp(&result, &untouched, sizeof result), 0);
    EXPECT_EQ(map.stats().chunks_live, 0u);
    double up[3] = {7, 7, 7}, sigma = 7;
    EXPECT_EQ(burin_up(map.map, up, &sigma), BURIN_STATE);
    EXPECT_EQ(up[0], 7);
    EXPECT_EQ(sigma, 7);
}

TEST(ApiScan, RefusesWhatIsWrong) {
    const ApiMap map(scan_config());
    ASSERT_EQ(burin_scan(map.map, nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    expect_text(map.map, "frame is null");
    EXPECT_EQ(burin_scan(kNull, nullptr, nullptr), BURIN_STATE);
    EXPECT_EQ(burin_up(kNull, nullptr, nullptr), BURIN_STATE);
    EXPECT_EQ(burin_up(map.map, nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    expect_text(map.map, "up is null");
    double up[3];
    EXPECT_EQ(burin_up(map.map, up, nullptr), BURIN_STATE);
    expect_text(map.map, "gravity");

    const burin_frame good = frame_at(0);
    ASSERT_EQ(burin_scan(map.map, &good, nullptr), BURIN_OK);
    const std::uint64_t hash = map.hash();
    const std::vector<burin_imu_sample> imu = samples(1);
    const auto refused = [&](const char* part, auto&& change) {
        SCOPED_TRACE(part);
        burin_frame frame = frame_at(1);
        frame.imu = imu.data();
        frame.imu_count = static_cast<std::uint32_t>(imu.size());
        change(frame);
        burin_scan_result result;
        std::memset(&result, 0x5a, sizeof result);
        const burin_scan_result untouched = result;
        EXPECT_EQ(burin_scan(map.map, &frame, &result), BURIN_INVALID_ARGUMENT);
        expect_text(map.map, part);
        EXPECT_EQ(std::memcmp(&result, &untouched, sizeof result), 0);
        EXPECT_EQ(map.hash(), hash);
    };
    refused("imu_count is 65537", [](burin_frame& f) { f.imu_count = 65537; });
    refused("imu_count is 4294967295", [](burin_frame& f) { f.imu_count = 0xffffffffu; });
    refused("T_camera_imu", [](burin_frame& f) { f.T_camera_imu.tx = NAN; });
    refused("T_camera_imu", [](burin_frame& f) { f.T_camera_imu.qw = NAN; });
    refused("T_camera_imu", [](burin_frame& f) { f.T_camera_imu.qw = 0; });
    refused("T_world_camera", [](burin_frame& f) { f.T_world_camera.qz = INFINITY; });
    refused("depth is null", [](burin_frame& f) { f.depth = nullptr; });
    refused("reserved", [](burin_frame& f) { f.reserved[7] = 1; });
    refused("size", [](burin_frame& f) { f.struct_size = 0; });

    burin_config config = scan_config();
    std::uint64_t bytes;
    config.tracker = 3;
    EXPECT_EQ(burin_bytes(&config, &bytes), BURIN_INVALID_ARGUMENT);
    expect_text(kNull, "tracker is 3");
    config = scan_config();
    config.track_colour = 2;
    EXPECT_EQ(burin_bytes(&config, &bytes), BURIN_INVALID_ARGUMENT);
    expect_text(kNull, "track_colour");
    config = scan_config();
    config.track_gyro = 2;
    EXPECT_EQ(burin_bytes(&config, &bytes), BURIN_INVALID_ARGUMENT);
    expect_text(kNull, "track_gyro");
}

TEST(ApiScan, ReportsWhatItFound) {
    const ApiMap map(scan_config());
    burin_scan_result r;
    for (int i = 0; i < 8; ++i) {
        burin_frame frame = frame_at(i);
        ASSERT_EQ(burin_scan(map.map, &frame, &r), BURIN_OK);
        ASSERT_EQ(r.state, BURIN_TRACKING_OK) << i;
        EXPECT_EQ(r.relocalised, 0u);
        EXPECT_GT(r.fusion.chunks_fused, 300u);
        EXPECT_GT(r.fusion.valid_pixels, 15000u);
        EXPECT_EQ(r.fusion.flags, 0u);
        EXPECT_GT(r.track_ms, 0);
        const Se3& truth = room_sequence().pose(i);
        EXPECT_LT(norm(Vec3d{r.T_world_camera.tx, r.T_world_camera.ty, r.T_world_camera.tz} - truth.t),
                  0.005);
        if (i == 0) continue;
        EXPECT_GT(r.evaluations, 5u);
        EXPECT_EQ(r.free_directions, 0u);
        EXPECT_GT(r.weakest_m, 0);
        EXPECT_LT(r.weakest_m, 0.006f);
        EXPECT_GT(r.known_share, 0.8f);
        EXPECT_GT(r.close_share, 0.8f);
        EXPECT_LE(r.close_share, 1.0f);
        EXPECT_GT(r.keyframe_share, 0.5f);
    }
    EXPECT_EQ(map.stats().frames, 8u);

    const std::uint64_t hash = map.hash();
    const Image<float> nothing(160, 120);
    burin_frame blank = frame_at(8);
    blank.depth = nothing.view().data;
    ASSERT_EQ(burin_scan(map.map, &blank, &r), BURIN_OK) << "being lost is no error";
    EXPECT_EQ(r.state, BURIN_TRACKING_LOST);
    EXPECT_EQ(r.T_world_camera.tx, 0);
    EXPECT_EQ(r.T_world_camera.qw, 1);
    EXPECT_EQ(r.fusion.chunks_fused, 0u);
    EXPECT_EQ(r.fusion.chunks_new, 0u);
    EXPECT_EQ(map.hash(), hash);
    EXPECT_EQ(map.stats().frames, 8u);
    const burin_frame back = frame_at(9);
    ASSERT_EQ(burin_scan(map.map, &back, &r), BURIN_OK);
    EXPECT_EQ(r.state, BURIN_TRACKING_WEAK);
    EXPECT_EQ(r.relocalised, 1u);

    // After a reset the world begins anew, at the identity unless told otherwise.
    ASSERT_EQ(burin_reset(map.map), BURIN_OK);
    burin_frame first = frame_at(9, false);
    first.T_world_camera = burin_frame_default().T_world_camera;
    ASSERT_EQ(burin_scan(map.map, &first, &r), BURIN_OK);
    EXPECT_EQ(r.state, BURIN_TRACKING_OK);
    EXPECT_EQ(r.T_world_camera.tz, 0);
    EXPECT_EQ(r.keyframe_share, 0.0f);
}

TEST(ApiScan, LearnsWhereUpIs) {
    const ApiMap map(scan_config());
    double up[3], sigma = 0;
    for (int i = 0; i < 60; ++i) {
        burin_frame frame = frame_at(0);  // at rest, looking level but for a tilt
        frame.t_ns = i * std::int64_t{33333333};
        std::vector<burin_imu_sample> imu = samples(i);
        // At rest the IMU reads up in its own axes.
        const Vec3d at_rest = room_sequence().pose(0).R.transposed() * Vec3d{0, -9.81, 0};
        for (burin_imu_sample& s : imu)
            for (int k = 0; k < 3; ++k) s.accel_m_s2[k] = at_rest[k];
        imu[3].gyro_rad_s[1] = NAN;  // passed over
        frame.imu = imu.data();
        frame.imu_count = static_cast<std::uint32_t>(imu.size());
        burin_scan_result r;
        ASSERT_EQ(burin_scan(map.map, &frame, &r), BURIN_OK);
        ASSERT_EQ(r.state, BURIN_TRACKING_OK) << i;
        if (i == 10) {
            EXPECT_EQ(burin_up(map.map, up, &sigma), BURIN_STATE) << "a third of a second";
        }
    }
    ASSERT_EQ(burin_up(map.map, up, &sigma), BURIN_OK) << burin_last_error(map.map);
    EXPECT_NEAR(up[0], 0, 0.02);
    EXPECT_NEAR(up[1], -1, 0.001);
    EXPECT_NEAR(up[2], 0, 0.02);
    EXPECT_GT(sigma, 0);
    EXPECT_LT(sigma, 0.1);
    EXPECT_EQ(burin_up(map.map, up, nullptr), BURIN_OK);
    ASSERT_EQ(burin_reset(map.map), BURIN_OK);
    EXPECT_EQ(burin_up(map.map, up, &sigma), BURIN_STATE);
}

// burin_bytes is what create takes and what the map works in: not a byte behind it is touched.
TEST(ApiScan, BytesAreExact) {
    std::uint64_t none = 0;
    for (const std::uint32_t tracker : {BURIN_TRACKER_NONE, BURIN_TRACKER_SDF, BURIN_TRACKER_ICP})
        for (const std::uint32_t colour : {0u, 1u}) {
            burin_config config = scan_config();
            config.tracker = tracker;
            config.track_colour = colour;
            config.budget_bytes = 24u << 20;
            std::uint64_t bytes = 0;
            ASSERT_EQ(burin_bytes(&config, &bytes), BURIN_OK);
            EXPECT_LE(bytes, config.budget_bytes);
            EXPECT_GT(bytes + 6000, config.budget_bytes);
            constexpr std::size_t kGuard = 4096;
            const Memory memory = aligned_memory(bytes + kGuard);
            burin_map map;
            EXPECT_EQ(burin_create(&config, memory.get(), bytes - 1, &map), BURIN_INSUFFICIENT_MEMORY);
            ASSERT_EQ(burin_create(&config, memory.get(), bytes, &map), BURIN_OK);
            burin_statistics stats;
            ASSERT_EQ(burin_stats(map, &stats), BURIN_OK);
            EXPECT_EQ(stats.arena_bytes, bytes);
            if (tracker == BURIN_TRACKER_NONE) {
                none = stats.chunks_capacity;
            } else {
                EXPECT_LT(stats.chunks_capacity, none) << "the tracker is paid for";
                EXPECT_GT((stats.chunks_capacity + 1500u) * 1.0, none) << "some 3 MiB";
                for (int i = 0; i < 4; ++i) {
                    const burin_frame frame = frame_at(i);
                    ASSERT_EQ(burin_scan(map, &frame, nullptr), BURIN_OK);
                }
            }
            const auto* guard = static_cast<const unsigned char*>(memory.get()) + bytes;
            EXPECT_TRUE(std::all_of(guard, guard + kGuard, [](unsigned char b) { return b == 0xa5; }));
            burin_destroy(&map);
        }
}

// What a loop with meshes gives, frame for frame: every pose, every vertex, and the map.
struct Streamed {
    std::vector<burin_pose> poses;
    std::vector<float> positions;
    std::vector<std::uint32_t> triangles;
    std::uint64_t hash = 0;
    bool operator==(const Streamed& o) const {
        return poses.size() == o.poses.size() &&
               std::memcmp(poses.data(), o.poses.data(), poses.size() * sizeof(burin_pose)) == 0 &&
               positions == o.positions && triangles == o.triangles && hash == o.hash;
    }
};

Streamed streamed(std::uint32_t threads, bool is_beside) {
    constexpr int kFrames = 8;
    burin_config config = scan_config();
    config.threads = threads;
    const ApiMap map(config);
    Streamed out;
    std::vector<burin_frame> frames;
    for (int i = 0; i < kFrames; ++i) frames.push_back(frame_at(i));
    std::vector<burin_chunk_key> keys(100000);
    std::vector<burin_mesh_range> ranges(keys.size());
    std::vector<float> positions(3 << 20);
    std::vector<std::uint32_t> triangles(3 << 21);
    std::uint64_t count = 0;
    for (int i = 0; i < kFrames; ++i) {
        burin_mesh_buffers mesh = {1 << 20, 1 << 21, positions.data(), nullptr, nullptr, triangles.data(),
                                   0,       0};
        burin_beside beside = {};
        beside.struct_size = sizeof beside;
        // Every third time another frame comes than was told: its depth is prepared anew.
        if (i + 1 < kFrames) beside.next = &frames[static_cast<std::size_t>(i % 3 == 2 ? 0 : i + 1)];
        beside.keys = keys.data();
        beside.key_count = count;
        beside.mesh = &mesh;
        beside.ranges = ranges.data();
        burin_scan_result result;
        const burin_frame& frame = frames[static_cast<std::size_t>(i)];
        if (is_beside) {
            EXPECT_EQ(burin_scan_beside(map.map, &frame, &beside, &result), BURIN_OK)
                << burin_last_error(map.map);
        } else {
            EXPECT_EQ(burin_chunk_meshes(map.map, keys.data(), count, nullptr, &mesh, ranges.data(),
                                         &beside.meshed),
                      BURIN_OK);
            EXPECT_EQ(burin_scan(map.map, &frame, &result), BURIN_OK);
        }
        EXPECT_EQ(beside.meshed, count);
        EXPECT_TRUE(i == 0 || mesh.triangle_count > 0);
        out.poses.push_back(result.T_world_camera);
        out.positions.insert(out.positions.end(), positions.data(), positions.data() + 3 * mesh.vertex_count);
        out.triangles.insert(out.triangles.end(), triangles.data(),
                             triangles.data() + 3 * mesh.triangle_count);
        EXPECT_EQ(burin_dirty_chunks(map.map, keys.data(), keys.size(), &count), BURIN_OK);
    }
    out.hash = map.hash();
    return out;
}

TEST(ApiScan, BesideGivesTheSameBits) {
    const Streamed one = streamed(1, false);
    EXPECT_TRUE(streamed(2, false) == one);
    for (const std::uint32_t threads : {1u, 2u, 3u}) EXPECT_TRUE(streamed(threads, true) == one) << threads;
}

TEST(ApiScan, BesideRefusesWhatIsWrong) {
    const ApiMap map(scan_config());
    const burin_frame frame = frame_at(0);
    burin_frame bad = frame_at(1);
    bad.T_world_camera.qw = 7;
    burin_beside beside = {};
    EXPECT_EQ(burin_scan_beside(map.map, &frame, nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    expect_text(map.map, "beside is null");
    EXPECT_EQ(burin_scan_beside(map.map, &frame, &beside, nullptr), BURIN_INVALID_ARGUMENT);
    expect_text(map.map, "beside: size 0");
    beside.struct_size = sizeof beside;
    beside.next = &bad;
    EXPECT_EQ(burin_scan_beside(map.map, &frame, &beside, nullptr), BURIN_INVALID_ARGUMENT);
    beside.next = nullptr;
    beside.key_count = 1;
    EXPECT_EQ(burin_scan_beside(map.map, &frame, &beside, nullptr), BURIN_INVALID_ARGUMENT);
    expect_text(map.map, "mesh is null");
    EXPECT_EQ(map.stats().chunks_live, 0u);
    EXPECT_EQ(burin_scan_beside(kNull, &frame, &beside, nullptr), BURIN_STATE);
}

TEST(ApiScan, TheApplicationsThreadsGiveTheSameBits) {
    const ApiMap own(scan_config()), lent(scan_config());
    burin_hooks hooks = burin_hooks_default();
    hooks.pool_threads = 4;
    hooks.run = [](void*, std::uint32_t count, burin_job body, void* context) {
        for (std::uint32_t job = count; job-- > 0;) body(context, job);
        return 0;
    };
    ASSERT_EQ(burin_set_hooks(lent.map, &hooks), BURIN_OK);
    for (int i = 0; i < 5; ++i) {
        const burin_frame frame = frame_at(i);
        burin_scan_result a, b;
        ASSERT_EQ(burin_scan(own.map, &frame, &a), BURIN_OK);
        ASSERT_EQ(burin_scan(lent.map, &frame, &b), BURIN_OK);
        EXPECT_EQ(std::memcmp(&a.T_world_camera, &b.T_world_camera, sizeof a.T_world_camera), 0);
    }
    EXPECT_EQ(own.hash(), lent.hash());
}

}  // namespace
}  // namespace burin
