// SPDX-License-Identifier: MIT
// ICP against the raycast map and against the frame before: how far off it may start, and what it makes of
// nothing.
#include "track/icp_tracker.h"

#include <gtest/gtest.h>

#include "track_helpers.h"

namespace burin {
namespace {

constexpr float kReach_m = 4;

// A room without noise, seen by a VGA camera.
const Camera kCamera = test_camera(640, 480);

struct Tracked : TrackRig {
    explicit Tracked(int threads = 1) : TrackRig(depth_options(), threads) {
        lay_out(kCamera, 10, [&](Arena& arena) { icp.place(arena, kCamera.width, kCamera.height); });
    }
    static DepthOptions depth_options() {
        DepthOptions o;
        o.edge_removal = true;
        return o;
    }
    void see(const Image<float>& image) {
        build_points(image, kCamera);
        icp.look_at(points, jobs);
    }
    void look_from(const Volume& volume, const Se3& T, int finest = 0) {
        icp.look_from(volume, points.level(0).camera, T, kReach_m, jobs, finest);
    }

    IcpTracker icp;
};

// The room as a map of 10 mm voxels.
const Volume& map() {
    static TestSession session = [] {
        burin_config config = test_config(0.01f);
        config.max_width = 640;
        config.max_height = 480;
        config.budget_bytes = 256u << 20;
        config.edge_removal = 1;
        return TestSession(config);
    }();
    static const Volume& volume = fused_room(session, kCamera);
    return volume;
}

TEST(IcpTracker, ComesBackToTheMapFrom20mmAnd2Degrees) {
    Tracked t(2);
    const Se3 truth = room_view(3);
    t.see(tracking_room().depth(kCamera, truth));
    double worst_m = 0, worst_rad = 0;
    for (int i = 0; i < kDirections; ++i) {
        const Se3 start = moved(truth, direction(i, 0.02, 2 * kDegree));
        t.look_from(map(), start);
        const PoseFit fit = descend(t.icp, start, {}, {});
        worst_m = std::max(worst_m, away_m(fit.T_world_camera, truth));
        worst_rad = std::max(worst_rad, away_rad(fit.T_world_camera, truth));
        EXPECT_GT(fit.measured.system.inliers, 0.8 * fit.measured.considered);
    }
    // Measured 0.05 mm and 0.002 degrees.
    EXPECT_LT(worst_m, 2e-4);
    EXPECT_LT(worst_rad, 0.01 * kDegree);
}

// Without a map, and further off, as a jerk between two frames is: 60 mm and 4 degrees.
TEST(IcpTracker, FrameToFrameComesBackFromFar) {
    Tracked t(2);
    const Se3 before = room_view(3);
    t.see(tracking_room().depth(kCamera, before));
    t.icp.look_at_frame(t.points, before, t.jobs);
    double worst_m = 0, worst_rad = 0;
    for (int i = 0; i < kDirections; ++i) {
        const Se3 truth = moved(before, direction(i, 0.06, 4 * kDegree));
        t.see(tracking_room().depth(kCamera, truth));
        const PoseFit fit = descend(t.icp, before, {}, {});
        worst_m = std::max(worst_m, away_m(fit.T_world_camera, truth));
        worst_rad = std::max(worst_rad, away_rad(fit.T_world_camera, truth));
    }
    // Measured 0.1 mm and 0.003 degrees; of starts 100 mm and 6.7 degrees off all come back too, of 150 mm
    // and 10 degrees 13 of 14, of 200 mm and 13 degrees 6.
    EXPECT_LT(worst_m, 5e-4);
    EXPECT_LT(worst_rad, 0.02 * kDegree);
}

// A candidate of relocalisation: few rays, the coarsest level alone.
TEST(IcpTracker, TheCoarsestLevelAloneComesNear) {
    Tracked t(2);
    const Se3 truth = room_view(3);
    t.see(tracking_room().depth(kCamera, truth));
    DescentOptions coarse;
    coarse.finest = 2;
    for (int i = 0; i < kDirections; ++i) {
        const Se3 start = moved(truth, direction(i, 0.06, 4 * kDegree));
        t.look_from(map(), start, 2);
        const PoseFit fit = descend(t.icp, start, {}, coarse);
        EXPECT_LT(away_m(fit.T_world_camera, truth), 0.005) << i;  // measured 2.7 mm
    }
}

TEST(IcpTracker, FinerPointsMayBeHeldAgainstACoarserCast) {
    Tracked t(2);
    const Se3 truth = room_view(3);
    t.see(tracking_room().depth(kCamera, truth));
    t.look_from(map(), truth, 1);
    for (int level = 0; level < TrackPoints::kLevels; ++level) {
        const Measured m = t.icp.measure(truth, level);
        EXPECT_GT(m.system.points, 0.8 * m.considered) << level;
    }
    EXPECT_EQ(t.icp.reference().grid(0).width, 80);
    EXPECT_EQ(t.icp.reference().grid(2).width, 40);
}

void expect_nothing(Tracked& t) {
    for (int level = 0; level < TrackPoints::kLevels; ++level) {
        const Measured m = t.icp.measure(room_view(3), level);
        EXPECT_EQ(m.system.points, 0) << level;
        EXPECT_EQ(m.system.cost, 0);
        EXPECT_EQ(m.median, 0);
    }
    const PoseFit fit = descend(t.icp, room_view(3), {}, {});
    EXPECT_EQ(away_m(fit.T_world_camera, room_view(3)), 0) << "nothing to go by is no reason to move";
    EXPECT_FALSE(fit.converged);
    EXPECT_DOUBLE_EQ(cost_at(t.icp.measure(room_view(3), 0)), kMissCost);
}

TEST(IcpTracker, NothingComesOfNothing) {
    Tracked t(2);
    {
        SCOPED_TRACE("an empty map");
        const TestVolume empty({100, false, 0.01f, 0.04f});
        t.see(tracking_room().depth(kCamera, room_view(3)));
        EXPECT_GT(t.points.level(0).count, 10000);
        t.look_from(empty.volume, room_view(3));
        EXPECT_EQ(t.icp.reference().cells(0), 0);
        expect_nothing(t);
    }
    {
        SCOPED_TRACE("no depth before");
        Tracked blind;
        blind.see(Image<float>(640, 480));
        t.icp.look_at_frame(blind.points, room_view(3), t.jobs);
        expect_nothing(t);
    }
    {
        SCOPED_TRACE("no depth now");
        t.look_from(map(), room_view(3));
        EXPECT_GT(t.icp.reference().cells(0), 10000);
        t.see(Image<float>(640, 480));
        expect_nothing(t);
    }
    {
        // Readings here and there, no two beside each other: points, but no normal anywhere.
        SCOPED_TRACE("no normals");
        Image<float> speckled = tracking_room().depth(kCamera, room_view(3));
        for (int y = 0; y < 480; ++y)
            for (int x = 0; x < 640; ++x)
                if ((x / 4 + y / 4) % 2) speckled.view().at(x, y) = 0;
        Tracked other;
        other.see(speckled);
        EXPECT_GT(other.points.level(0).count, 5000);
        t.see(tracking_room().depth(kCamera, room_view(3)));
        t.icp.look_at_frame(other.points, room_view(3), t.jobs);
        EXPECT_EQ(t.icp.reference().cells(0), 0);
        EXPECT_EQ(t.icp.measure(room_view(3), 0).system.points, 0);
    }
    {
        SCOPED_TRACE("a pose that is none");
        t.see(tracking_room().depth(kCamera, room_view(3)));
        t.look_from(map(), room_view(3));
        Se3 broken = room_view(3);
        broken.t.x = static_cast<double>(NAN);
        EXPECT_EQ(t.icp.measure(broken, 0).system.points, 0);
        Se3 far = room_view(3);
        far.t.z = 1e30;
        EXPECT_EQ(t.icp.measure(far, 0).system.points, 0);
    }
}

TEST(IcpTracker, TheSameBytesForAnyNumberOfThreads) {
    const Se3 start = moved(room_view(3), direction(7, 0.02, 2 * kDegree));
    PoseFit fits[2];
    Measured measured[2];
    for (int i = 0; i < 2; ++i) {
        Tracked t(i == 0 ? 1 : 3);
        t.see(tracking_room().depth(kCamera, room_view(3)));
        t.look_from(map(), start);
        measured[i] = t.icp.measure(start, 0);
        fits[i] = descend(t.icp, start, {}, {});
        t.icp.look_at_frame(t.points, room_view(3), t.jobs);
        const PoseFit to_frame = descend(t.icp, start, {}, {});
        fits[i].measured.system += to_frame.measured.system;
    }
    EXPECT_EQ(std::memcmp(&measured[0].system, &measured[1].system, sizeof measured[0].system), 0);
    EXPECT_EQ(measured[0].median, measured[1].median);
    EXPECT_EQ(std::memcmp(&fits[0].measured.system, &fits[1].measured.system, sizeof fits[0].measured.system),
              0);
    EXPECT_EQ(std::memcmp(&fits[0].T_world_camera, &fits[1].T_world_camera, sizeof(Se3)), 0);
}

}  // namespace
}  // namespace burin
