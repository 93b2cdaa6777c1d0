// SPDX-License-Identifier: MIT
// A session that finds its own poses: how well, the same for any threads and kernels, and what it does when
// there is nothing to see.
#include "session/camera_tracking.h"

#include "dataset_files.h"
#include "depth/filters.h"
#include "simd/targets.h"
#include "track_helpers.h"

namespace burin {
namespace {

struct Scanned {
    std::vector<TrackingReport> reports;
    std::vector<std::uint64_t> hashes;  // of the map after each frame, where asked for

    const TrackingReport& operator[](int i) const { return reports[static_cast<std::size_t>(i)]; }
    int count(TrackingState state) const {
        int n = 0;
        for (const TrackingReport& r : reports) n += r.state == state;
        return n;
    }
};

// Frames first .. first + count - 1 of the room; blank: those without any depth.
Scanned scan(TestSession& s, int first, int count, int blank_from = 0, int blank_to = 0, bool hash = false) {
    Scanned out;
    const Image<float> nothing(160, 120);
    for (int i = first; i < first + count; ++i) {
        FrameView frame = room_sequence().frame(i);
        if (i >= blank_from && i < blank_to) frame.depth_f32 = nothing.view();
        const ScanReport r = s.session.scan(frame, s.jobs);
        if (r.tracking.state != TrackingState::tracking) {
            EXPECT_EQ(r.fusion.chunks.fused, 0u) << i;
        }
        out.reports.push_back(r.tracking);
        if (hash) out.hashes.push_back(s.session.hash());
    }
    return out;
}

double ate_m(const Scanned& scanned, int first = 0) {
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < scanned.reports.size(); ++i) {
        if (scanned.reports[i].state == TrackingState::lost) continue;
        const double e =
            away_m(scanned.reports[i].T_world_camera, room_sequence().pose(first + static_cast<int>(i)));
        sum += e * e;
        ++count;
    }
    return std::sqrt(sum / std::max(count, 1));
}

void expect_same(const Scanned& a, const Scanned& b) {
    ASSERT_EQ(a.reports.size(), b.reports.size());
    for (int i = 0; i < static_cast<int>(a.reports.size()); ++i) {
        ASSERT_EQ(a[i].state, b[i].state) << i;
        ASSERT_TRUE(same_bits(a[i].T_world_camera, b[i].T_world_camera))
            << i << ": " << away_m(a[i].T_world_camera, b[i].T_world_camera);
    }
}

TEST(CameraTracking, StaysOnAWayThroughTheRoom) {
    struct {
        std::uint32_t tracker, colour;
        int frames;
        double ate_m;
    } const cases[] = {{BURIN_TRACKER_SDF, 0, 60, 0.002},    // measured 1.14 mm
                       {BURIN_TRACKER_SDF, 1, 60, 0.001},    // 0.43
                       {BURIN_TRACKER_ICP, 0, 30, 0.0015},   // 60 frames: 0.67
                       {BURIN_TRACKER_ICP, 1, 30, 0.0006}};  // 60 frames: 0.22
    for (const auto& c : cases) {
        SCOPED_TRACE(std::to_string(c.tracker) + (c.colour ? " with colour" : ""));
        burin_config config = scan_config();
        config.tracker = c.tracker;
        config.track_colour = c.colour;
        TestSession s(config);
        const Scanned scanned = scan(s, 0, c.frames);
        EXPECT_EQ(scanned.count(TrackingState::tracking), c.frames);
        EXPECT_LT(ate_m(scanned), c.ate_m);
        EXPECT_EQ(s.session.frames(), static_cast<std::uint64_t>(c.frames));
        EXPECT_TRUE(same_bits(scanned[0].T_world_camera, room_sequence().pose(0)));
    }
}

TEST(CameraTracking, WithoutDepthItIsLostAndFusesNothing) {
    TestSession s(scan_config());
    const Scanned scanned = scan(s, 0, 60, 20, 30, true);
    for (int i = 20; i < 30; ++i) {
        EXPECT_EQ(scanned[i].state, TrackingState::lost) << i;
        EXPECT_EQ(scanned.hashes[static_cast<std::size_t>(i)], scanned.hashes[19]) << i;
    }
    int found = 0;
    for (int i = 30; i < 60; ++i) {
        found += scanned[i].relocalised;
        // At once, though the camera went on for a third of a metre; and three frames later it is sure.
        EXPECT_EQ(scanned[i].state, i < 33 ? TrackingState::weak : TrackingState::tracking) << i;
        EXPECT_LT(away_m(scanned[i].T_world_camera, room_sequence().pose(i)), 0.003) << i;  // measured 0.8 mm
    }
    EXPECT_EQ(found, 1);
    EXPECT_TRUE(scanned[30].relocalised);
}

TEST(CameraTracking, TheSameBitsForAnyNumberOfThreads) {
    for (const std::uint32_t tracker : {BURIN_TRACKER_SDF, BURIN_TRACKER_ICP}) {
        burin_config config = scan_config();
        config.tracker = tracker;
        TestSession one(config);
        config.threads = 2;
        TestSession two(config);
        const int frames = tracker == BURIN_TRACKER_SDF ? 36 : 16;  // ICP's casts take longer
        const Scanned a = scan(one, 0, frames, 6, 10), b = scan(two, 0, frames, 6, 10);
        EXPECT_EQ(a.count(TrackingState::lost), 4);
        expect_same(a, b);
        EXPECT_EQ(one.session.hash(), two.session.hash());
    }
}

TEST(CameraTracking, TheSameBitsFromTheScalarKernels) {
    TestSession best(scan_config()), scalar(scan_config());
    const Scanned a = scan(best, 0, 12, 4, 6);
    ASSERT_TRUE(simd::select_target("scalar"));
    const Scanned b = scan(scalar, 0, 12, 4, 6);
    simd::select_target("");
    expect_same(a, b);
    EXPECT_EQ(best.session.hash(), scalar.session.hash());
}

TEST(CameraTracking, AClearedSessionIsANewOne) {
    TestSession s(scan_config());
    const Scanned first = scan(s, 0, 25);
    const std::uint64_t hash = s.session.hash();
    s.session.clear();
    const Scanned second = scan(s, 0, 25);
    expect_same(first, second);
    EXPECT_EQ(s.session.hash(), hash);
}

TEST(CameraTracking, NothingToSeeAtTheStartDoesNoHarm) {
    TestSession plain(scan_config()), late(scan_config());
    const Image<float> blank(160, 120), nan(160, 120, 1, static_cast<float>(NAN));
    for (const Image<float>* image : {&blank, &nan, &blank}) {
        FrameView frame = room_sequence().frame(0);
        frame.depth_f32 = image->view();
        frame.t_ns = -1000;
        const ScanReport r = late.session.scan(frame, late.jobs);
        EXPECT_EQ(r.tracking.state, TrackingState::lost);
        EXPECT_EQ(late.volume().live(), 0u);
    }
    expect_same(scan(plain, 0, 10), scan(late, 0, 10));
    EXPECT_EQ(plain.session.hash(), late.session.hash());
}

TEST(CameraTracking, WithoutTheGyroscopeSamplesChangeNothing) {
    burin_config config = scan_config();
    config.track_gyro = 0;
    TestSession without(config), with(config);
    const Scanned a = scan(without, 0, 10);
    Scanned b;
    for (int i = 0; i < 10; ++i) {
        FrameView frame = room_sequence().frame(i);
        std::vector<ImuSample> imu;
        for (int k = -10; k <= 1; ++k)
            imu.push_back({frame.t_ns + k * std::int64_t{3333333}, {1, -2, 0.5}, {0, -9.81, 0}});
        frame.imu = imu.data();
        frame.imu_count = static_cast<int>(imu.size());
        b.reports.push_back(with.session.scan(frame, with.jobs).tracking);
    }
    expect_same(a, b);
}

// Sideways it cannot know, and must not fuse what it guesses.
TEST(CameraTracking, ABareWallIsNoHold) {
    const AnalyticScene wall{{{{0, 0, -1}, -1.5}}, {}};
    const Camera camera = test_camera();
    const Image<std::uint8_t> grey(160, 120, 3, 120);
    Rng rng(11);
    const auto walk = [&](std::uint32_t tracker, double noise, double tilt, bool colour) {
        burin_config config = scan_config();
        config.tracker = tracker;
        TestSession s(config);
        for (int i = 0; i < 5; ++i) {
            const Se3 T = look_from({0.01 * i, 0, 0}, {0.01 * i + tilt, 0.05, 1.5});
            Image<float> depth = wall.depth(camera, T);
            for (float& z : depth.pixels) z += static_cast<float>(noise * rng.normal()) * axial_noise_m(z);
            FrameView frame = frame_of(depth, camera, T);
            frame.t_ns = i * std::int64_t{33333333};
            if (colour) {
                frame.colour = grey.view();
                frame.colour_camera = camera;
            }
            const TrackingReport r = s.session.scan(frame, s.jobs).tracking;
            EXPECT_EQ(r.state, i == 0 ? TrackingState::tracking : TrackingState::weak)
                << i << ": " << 1e3 * away_m(r.T_world_camera, T) << " mm off, weakest "
                << 1e3 * r.verdict.weakest_m;
        }
        EXPECT_EQ(s.session.frames(), 1u);
    };
    for (const std::uint32_t tracker : {BURIN_TRACKER_SDF, BURIN_TRACKER_ICP})
        for (const double noise : {0.0, 0.5})  // of a pixel, in standard deviations of a reading
            for (const double tilt : {0.05, 0.8})
                for (const bool colour : {false, true}) {
                    SCOPED_TRACE(testing::Message() << "tracker " << tracker << ", noise " << noise
                                                    << ", tilt " << tilt << ", colour " << colour);
                    walk(tracker, noise, tilt, colour);
                }
}

// The file of a scan holds its keyframes: the camera is found in it from any frame, and the first frames
// after that are not fused yet.
TEST(CameraTracking, IsFoundInASavedMap) {
    const TempFolder folder;
    const std::string path = folder.path("map.burin");
    std::uint64_t hash = 0;
    {
        const ApiMap map(scan_config());
        for (int i = 0; i < 60; ++i) {
            const burin_frame frame = c_frame(room_sequence().frame(i));
            ASSERT_EQ(burin_scan(map.map, &frame, nullptr), BURIN_OK);
        }
        ASSERT_EQ(burin_save(map.map, path.c_str()), BURIN_OK);
        hash = map.hash();
    }
    for (const int start : {13, 37, 52}) {
        SCOPED_TRACE(start);
        const ApiMap map(scan_config());
        ASSERT_EQ(burin_load(map.map, path.c_str()), BURIN_OK) << burin_last_error(map.map);
        EXPECT_EQ(map.hash(), hash);
        for (int i = start; i < start + 6; ++i) {
            burin_scan_result r;
            const burin_frame frame = c_frame(room_sequence().frame(i));
            ASSERT_EQ(burin_scan(map.map, &frame, &r), BURIN_OK);
            EXPECT_EQ(r.state, i < start + 3 ? BURIN_TRACKING_WEAK : BURIN_TRACKING_OK) << i;
            EXPECT_EQ(r.relocalised, i == start) << i;
            const burin_pose& p = r.T_world_camera;
            EXPECT_LT(norm(Vec3d{p.tx, p.ty, p.tz} - room_sequence().pose(i).t), 0.005) << i;
            if (i < start + 3) {
                EXPECT_EQ(map.hash(), hash);
            }
        }
        EXPECT_NE(map.hash(), hash);
    }
    burin_config config = scan_config();
    config.tracker = BURIN_TRACKER_NONE;
    const ApiMap without(config);
    ASSERT_EQ(burin_load(without.map, path.c_str()), BURIN_OK) << burin_last_error(without.map);
    EXPECT_EQ(without.hash(), hash);
    // Saved again without keyframes, the camera has only the hint of the first frame's pose.
    ASSERT_EQ(burin_save(without.map, path.c_str()), BURIN_OK);
    const ApiMap map(scan_config());
    ASSERT_EQ(burin_load(map.map, path.c_str()), BURIN_OK);
    for (const bool near : {false, true}) {
        ASSERT_EQ(burin_load(map.map, path.c_str()), BURIN_OK);
        FrameView view = room_sequence().frame(37);  // 3 m off
        if (near) view.T_world_camera = moved(room_sequence().pose(37), direction(7, 0.05, 3 * kDegree));
        const burin_frame frame = c_frame(view);
        burin_scan_result r;
        ASSERT_EQ(burin_scan(map.map, &frame, &r), BURIN_OK);
        EXPECT_EQ(r.state, near ? BURIN_TRACKING_WEAK : BURIN_TRACKING_LOST);
    }
}

}  // namespace
}  // namespace burin
