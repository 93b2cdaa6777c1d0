// SPDX-License-Identifier: MIT
// Tracking on the signed distance field: how far off it may start, that nothing depends on threads or on what
// is remembered of a point, and what it makes of nothing.
#include "track/sdf_tracker.h"

#include "track_helpers.h"

namespace burin {
namespace {

const Camera kCamera = test_camera();

struct Tracked : TrackRig {
    explicit Tracked(int threads = 1) : TrackRig(noiseless_depth(), threads) {
        lay_out(kCamera, 5, [&](Arena& arena) { sdf.place(arena); });
    }
    void see(const Volume& volume, const Image<float>& image) {
        build_points(image, kCamera);
        sdf.look_at(volume, points, jobs);
    }

    SdfTracker sdf;
};

// The room as a map of 10 mm voxels.
const Volume& map() {
    static TestSession session = [] {
        burin_config config = scan_config();
        config.bilateral = 0;
        return TestSession(config);
    }();
    static const Volume& volume = fused_room(session, kCamera);
    return volume;
}

TEST(SdfTracker, ComesBackFrom20mmAnd2Degrees) {
    Tracked t(2);
    const Se3 truth = room_view(3);
    t.see(map(), tracking_room().depth(kCamera, truth));
    EXPECT_GT(t.points.level(0).count, 15000);
    double worst_m = 0, worst_rad = 0;
    for (int i = 0; i < kDirections; ++i) {
        const PoseFit fit = descend(t.sdf, moved(truth, direction(i, 0.02, 2 * kDegree)), {}, {});
        worst_m = std::max(worst_m, away_m(fit.T_world_camera, truth));
        worst_rad = std::max(worst_rad, away_rad(fit.T_world_camera, truth));
        EXPECT_TRUE(fit.converged) << i;
        EXPECT_GT(fit.measured.close, 0.9 * fit.measured.known) << i;
    }
    // Measured 0.17 mm and 0.007 degrees.
    EXPECT_LT(worst_m, 5e-4);
    EXPECT_LT(worst_rad, 0.05 * kDegree);
}

TEST(SdfTracker, ThePriorHoldsWhereItIsSure) {
    Tracked t;
    const Se3 truth = room_view(3), start = moved(truth, direction(7, 0.02, 0));
    t.see(map(), tracking_room().depth(kCamera, truth));
    MotionPriorTerm prior;
    prior.T_world_camera = start;
    prior.sigma_m = prior.sigma_rad = 1e-7;
    EXPECT_LT(away_m(descend(t.sdf, start, prior, {}).T_world_camera, start), 1e-5);
    prior.sigma_m = prior.sigma_rad = 10;
    const PoseFit fit = descend(t.sdf, start, prior, {});
    EXPECT_LT(away_m(fit.T_world_camera, truth), 5e-4);
    EXPECT_LT(fit.cost, kMissCost);
}

TEST(SdfTracker, TheSameBytesForAnyNumberOfThreads) {
    const Se3 start = moved(room_view(3), direction(7, 0.02, 2 * kDegree));
    PoseFit fits[2];
    Measured measured[2];
    for (int i = 0; i < 2; ++i) {
        Tracked t(i == 0 ? 1 : 3);
        t.see(map(), tracking_room().depth(kCamera, room_view(3)));
        measured[i] = t.sdf.measure(start, 0);
        fits[i] = descend(t.sdf, start, {}, {});
    }
    EXPECT_EQ(std::memcmp(&measured[0], &measured[1], sizeof(Measured)), 0);
    EXPECT_EQ(std::memcmp(&fits[0].measured, &fits[1].measured, sizeof(Measured)), 0);
    EXPECT_TRUE(same_bits(fits[0].T_world_camera, fits[1].T_world_camera));
    EXPECT_GT(measured[0].system.points, 10000);
}

// A tracker that measured elsewhere before remembers the chunks of those places.
TEST(SdfTracker, WhatItMeasuredBeforeDoesNotMatter) {
    Tracked fresh, used;
    fresh.see(map(), tracking_room().depth(kCamera, room_view(3)));
    used.see(map(), tracking_room().depth(kCamera, room_view(3)));
    for (int i = 0; i < kDirections; ++i)
        for (int level = 0; level < TrackPoints::kLevels; ++level)
            used.sdf.measure(moved(room_view(3), direction(i, 0.3, 0.2)), level);
    for (int level = 0; level < TrackPoints::kLevels; ++level) {
        const Measured a = fresh.sdf.measure(room_view(3), level), b = used.sdf.measure(room_view(3), level);
        EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0) << level;
    }
}

void expect_nothing(Tracked& t, const Se3& T) {
    for (int level = 0; level < TrackPoints::kLevels; ++level) {
        const Measured m = t.sdf.measure(T, level);
        EXPECT_EQ(m.system.points, 0) << level;
        EXPECT_EQ(m.system.cost, 0);
        EXPECT_EQ(m.known, 0);
        EXPECT_EQ(m.close, 0);
        EXPECT_EQ(m.median, 0);
        EXPECT_DOUBLE_EQ(cost_at(m), kMissCost);
    }
    const PoseFit fit = descend(t.sdf, T, {}, {});
    EXPECT_TRUE(same_bits(fit.T_world_camera, T)) << "nothing to go by is no reason to move";
    EXPECT_FALSE(fit.converged);
}

TEST(SdfTracker, NothingComesOfNothing) {
    Tracked t(2);
    {
        SCOPED_TRACE("an empty map");
        const TestVolume empty({100, false, 0.01f, 0.08f});
        t.see(empty.volume, tracking_room().depth(kCamera, room_view(3)));
        expect_nothing(t, room_view(3));
    }
    {
        SCOPED_TRACE("no depth");
        t.see(map(), Image<float>(160, 120));
        EXPECT_EQ(t.points.level(0).count, 0);
        EXPECT_EQ(t.points.mean_depth_m(), 0);
        expect_nothing(t, room_view(3));
    }
    {
        SCOPED_TRACE("elsewhere");
        t.see(map(), tracking_room().depth(kCamera, room_view(3)));
        Se3 far = room_view(3);
        far.t.x = 30;
        expect_nothing(t, far);
        far.t.x = 1e30;
        expect_nothing(t, far);
    }
    {
        SCOPED_TRACE("a pose that is none");
        Se3 broken = room_view(3);
        broken.t.y = static_cast<double>(NAN);
        EXPECT_EQ(t.sdf.measure(broken, 0).system.points, 0);
        broken = room_view(3);
        broken.R(1, 2) = static_cast<double>(NAN);
        EXPECT_EQ(t.sdf.measure(broken, 0).system.points, 0);
    }
    // And it works as before after all that.
    const PoseFit fit = descend(t.sdf, moved(room_view(3), direction(1, 0.01, 0)), {}, {});
    EXPECT_LT(away_m(fit.T_world_camera, room_view(3)), 5e-4);
}

// What is remembered of a point gives the bits of asking anew, wherever it moved: within its chunk, across a
// border, to where nothing is, and back.
TEST(CellChunks, GiveTheBitsOfAskingAnew) {
    TestVolume v({400, false, 0.01f, 0.08f});
    v.fill({-2, -2, -2}, {1, 1, 1}, [](Vec3d p) { return norm(p - Vec3d{0.01, 0.02, -0.03}) - 0.08; });
    // A hole: cells at its borders have some of their corners there.
    v.volume.remove(v.volume.find(pack_key({0, 0, 0})));
    constexpr int kPoints = 300;
    Rng rng(8);
    std::vector<float> p[3];
    for (auto& axis : p)
        for (int i = 0; i < kPoints; ++i) axis.push_back(static_cast<float>(rng.uniform(-0.17, 0.17)));
    std::vector<CellChunks> chunks(kPoints);
    for (CellChunks& c : chunks) c.key = 0;
    BatchSampler with(v.volume), without(v.volume);
    std::vector<float> distance[2], gradient[2][3];
    int known = 0, unknown = 0;
    for (int turn = 0; turn < 60; ++turn) {
        Se3 T;
        if (turn % 2) T = moved({}, direction(turn % kDirections, 0.004 * turn, 0.02 * turn));
        if (turn % 7 == 3) T.t.x += 40;  // nothing there
        const LatticeFrame frame(v.volume, T);
        for (int k = 0; k < 2; ++k) {
            distance[k].assign(kPoints, -1);
            float* gradients[3];
            for (int axis = 0; axis < 3; ++axis) {
                gradient[k][axis].assign(kPoints, -1);
                gradients[axis] = gradient[k][axis].data();
            }
            (k ? with : without)
                .sample(frame, p[0].data(), p[1].data(), p[2].data(), kPoints, distance[k].data(), gradients,
                        k ? chunks.data() : nullptr);
        }
        ASSERT_EQ(std::memcmp(distance[0].data(), distance[1].data(), sizeof(float) * kPoints), 0) << turn;
        for (int axis = 0; axis < 3; ++axis)
            ASSERT_EQ(
                std::memcmp(gradient[0][axis].data(), gradient[1][axis].data(), sizeof(float) * kPoints), 0)
                << turn;
        for (const float d : distance[0]) ++(std::isnan(d) ? unknown : known);
    }
    EXPECT_GT(known, 5000);
    EXPECT_GT(unknown, 3000);
}

}  // namespace
}  // namespace burin
