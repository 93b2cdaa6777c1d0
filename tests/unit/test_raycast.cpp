// SPDX-License-Identifier: MIT
// Reading the field: trilinear samples, gradients, and ray casting, against analytic surfaces.
#include <gtest/gtest.h>

#include <chrono>

#include "map/raycast.h"
#include "map/sample.h"
#include "scene_helpers.h"

namespace burin {
namespace {

constexpr double kVoxel = 0.01;
constexpr VolumeShape kShape{800, true, 0.01f, 0.04f};
const Vec3d kCentre{0.013, -0.021, 0.034};
constexpr double kRadius = 0.2;

double sphere(Vec3d p) { return norm(p - kCentre) - kRadius; }

struct Rays {
    explicit Rays(const Volume& volume, const Camera& camera, const Se3& T, float reach_m = 4,
                  int threads = 2)
        : width(camera.width),
          depth(static_cast<std::size_t>(camera.width * camera.height)),
          normals(3 * depth.size()),
          rgb(3 * depth.size()) {
        Jobs jobs(threads);
        raycast(volume, camera, T, reach_m, {depth.data(), normals.data(), rgb.data()}, jobs);
    }
    std::size_t at(int x, int y) const { return static_cast<std::size_t>(y * width + x); }
    Vec3d normal(std::size_t i) const {
        return to_double({normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]});
    }

    int width;
    std::vector<float> depth, normals;
    std::vector<std::uint8_t> rgb;
};

TEST(Sample, TrilinearWithinTheBandAndUnknownOutside) {
    TestVolume t(kShape);
    t.fill({-4, -4, -4}, {3, 3, 3}, sphere);
    Sampler sampler(t.volume);
    Rng rng(60);
    for (int i = 0; i < 20000; ++i) {
        const Vec3d p = kCentre + normalised(Vec3d{rng.normal(), rng.normal(), rng.normal()}) *
                                      (kRadius + rng.uniform(-0.02, 0.02));
        float d = 0;
        Vec3f g;
        ASSERT_TRUE(sampler.distance_and_gradient(p, &d, &g));
        // Interpolating over a cell errs by h^2 / 8 times the curvatures: 0.01^2 / 8 * 2 / 0.18 = 0.14 mm.
        ASSERT_NEAR(static_cast<double>(d), sphere(p), 0.02 * kVoxel);
        ASSERT_GT(dot(to_double(normalised(g)), normalised(p - kCentre)), std::cos(3 * M_PI / 180));
        ASSERT_NEAR(norm(g), 1, 0.03f);
        float again = 0;
        ASSERT_TRUE(sampler.distance(p, &again));
        ASSERT_EQ(again, d);
    }
    float d = 0;
    bool in_chunk = true;
    EXPECT_FALSE(sampler.distance({5, 5, 5}, &d));
    EXPECT_FALSE(sampler.nearest({5, 5, 5}, &d, &in_chunk));
    EXPECT_FALSE(in_chunk);
    EXPECT_FALSE(sampler.distance({0.3199, 0, 0}, &d))
        << "half a voxel inside the border its neighbour is missing";
    for (const double far : {1e5, 1e9, 1e300, static_cast<double>(INFINITY), static_cast<double>(NAN)})
        for (int axis = 0; axis < 3; ++axis)
            for (const double sign : {-1.0, 1.0}) {
                Vec3d p{0, 0, 0};
                p[axis] = sign * far;
                EXPECT_FALSE(sampler.distance(p, &d)) << far;
                EXPECT_FALSE(sampler.nearest(p, &d, &in_chunk));
            }
    // One unseen voxel makes the eight cells around it unknown.
    const std::uint32_t slot = t.volume.find(pack_key({0, 0, 0}));
    t.volume.geometry(slot).weight[0] = 0;
    EXPECT_FALSE(sampler.distance({0.0051, 0.0051, 0.0051}, &d));
    EXPECT_FALSE(sampler.distance({-0.0049, -0.0049, -0.0049}, &d));
    EXPECT_TRUE(sampler.distance({0.0151, 0.0051, 0.0051}, &d));
}

TEST(Raycast, ASphereFromAllSides) {
    TestVolume t(kShape);
    t.fill({-4, -4, -4}, {3, 3, 3}, sphere);
    for (std::uint32_t slot = 0; slot < t.volume.live(); ++slot)
        for (int i = 0; i < kChunkVoxels; ++i) {
            const std::uint8_t colour[4] = {
                10, static_cast<std::uint8_t>(unpack_key(t.volume.key(slot)).x < 0 ? 50 : 200), 30, 1};
            std::memcpy(t.volume.colour(slot).rgbn[i], colour, 4);
        }
    const Camera camera = test_camera();
    Rng rng(61);
    for (int view = 0; view < 12; ++view) {
        const Vec3d eye =
            kCentre + normalised(Vec3d{rng.normal(), rng.normal(), rng.normal()}) * rng.uniform(0.5, 1.5);
        const Se3 T = look_from(eye, kCentre, {0.1, 0.9, 0.3});
        const Rays rays(t.volume, camera, T);
        int hits = 0;
        double worst_offset = 0;
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x) {
                const Vec3d ray = T.R * unproject(camera, {static_cast<double>(x), static_cast<double>(y)});
                const Vec3d closest = T.t + ray * (dot(kCentre - T.t, ray) / dot(ray, ray));
                const double beside = norm(closest - kCentre);  // of the ray from the centre
                const std::size_t i = rays.at(x, y);
                if (beside > kRadius + 0.3 * kVoxel) {
                    ASSERT_EQ(rays.depth[i], 0) << "a ray that misses by " << beside - kRadius;
                    ASSERT_EQ(norm(rays.normal(i)), 0);
                    ASSERT_EQ(rays.rgb[3 * i], 0);
                    continue;
                }
                if (beside > 0.98 * kRadius) continue;  // grazing: a hit is luck
                const double truth = AnalyticScene{{}, {{kCentre, kRadius}}}.trace(T.t, ray);
                ASSERT_GT(rays.depth[i], 0) << "a hole at " << x << ' ' << y;
                ++hits;
                worst_offset = std::max(worst_offset, std::fabs(static_cast<double>(rays.depth[i]) - truth));
                const Vec3d p = T.t + ray * static_cast<double>(rays.depth[i]);
                ASSERT_GT(dot(rays.normal(i), normalised(p - kCentre)), std::cos(3 * M_PI / 180));
                if (std::fabs(p.x) > 0.02) {
                    ASSERT_EQ(rays.rgb[3 * i + 1], p.x < 0 ? 50 : 200);
                }
            }
        EXPECT_GT(hits, 500);
        EXPECT_LT(worst_offset, 0.2 * kVoxel);
    }
}

TEST(Raycast, APlaneAtEveryTilt) {
    for (const double degrees : {0.0, 30.0, 60.0, 80.0}) {
        const double a = degrees * M_PI / 180;
        const AnalyticScene plane{{{{std::sin(a), 0, -std::cos(a)}, 0}}, {}};
        TestVolume t({4000, false, 0.01f, 0.04f});
        t.fill({-7, -5, -7}, {6, 4, 6}, [&](Vec3d p) { return plane.distance(p); });
        const Camera camera = test_camera();
        const Se3 T = look_from({0, 0, -0.5}, {0, 0, 0});
        const Rays rays(t.volume, camera, T);
        int hits = 0;
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x) {
                const Vec3d ray = T.R * unproject(camera, {static_cast<double>(x), static_cast<double>(y)});
                const double truth = plane.trace(T.t, ray);
                const Vec3d p = T.t + ray * truth;
                if (truth == 0 || std::fabs(p.x) > 0.5 || std::fabs(p.y) > 0.35 || std::fabs(p.z) > 0.5)
                    continue;
                ASSERT_NEAR(static_cast<double>(rays.depth[rays.at(x, y)]), truth, 0.2 * kVoxel)
                    << degrees << " degrees, " << x << ' ' << y;
                ++hits;
            }
        EXPECT_GT(hits, 1000);
    }
}

// A floor fused from grazing views alone: its projective distances are up to six times the true ones, so that
// steps as long as the distance may jump over the surface when it is looked at from above.
TEST(Raycast, NoHolesInWhatWasSeenAtAGrazingAngle) {
    const AnalyticScene floor{{{{0, -1, 0}, -0.5}}, {}};  // y = 0.5, y down
    const Camera camera = test_camera();
    burin_config config = test_config();
    config.budget_bytes = 64u << 20;
    TestSession session(config);
    for (int i = 0; i < 8; ++i) {
        const Se3 T = look_from({0, 0.2, -1 + 0.05 * i}, {0, 0.35, 0.4});
        session.integrate(frame_of(floor.depth(camera, T), camera, T));
    }
    const Se3 above = look_from({0, -0.4, 0.4}, {0, 0.5, 0.4}, {0, 0, 1});
    const Rays rays(session.volume(), camera, above);
    int hits = 0, holes = 0;
    double worst = 0;
    Sampler sampler(session.volume());
    for (int y = 20; y < 100; ++y)
        for (int x = 40; x < 120; ++x) {
            const Vec3d ray = above.R * unproject(camera, {static_cast<double>(x), static_cast<double>(y)});
            const Vec3d p = above.t + ray * floor.trace(above.t, ray);
            // Only where the field changes its sign between known voxels.
            float over = 0, under = 0;
            if (!sampler.distance(p - Vec3d{0, 0.01, 0}, &over) ||
                !sampler.distance(p + Vec3d{0, 0.01, 0}, &under) || over <= 0 || under >= 0)
                continue;
            const float got = rays.depth[rays.at(x, y)];
            holes += got == 0;
            hits += got != 0;
            if (got != 0)
                worst = std::max(worst, std::fabs(static_cast<double>(got) - floor.trace(above.t, ray)));
        }
    EXPECT_GT(hits, 1000);
    EXPECT_EQ(holes, 0) << "beside " << hits << " hits";
    EXPECT_LT(worst, 0.5 * 0.02);
}

TEST(Raycast, BehindAndBeyondThereIsNothing) {
    TestVolume t(kShape);
    t.fill({-4, -4, -4}, {3, 3, 3}, sphere);
    const Camera camera = test_camera(40, 30);
    for (const float d : Rays(t.volume, camera, look_from({0, 0, -1}, {0, 0, -2})).depth)
        ASSERT_EQ(d, 0) << "looking away";
    for (const float d : Rays(t.volume, camera, look_from({0, 0, -3}, kCentre), 2.0f).depth)
        ASSERT_EQ(d, 0) << "out of reach";
    // From inside the ball all surface is seen from behind.
    for (const float d : Rays(t.volume, camera, look_from(kCentre, {0, 0, 1})).depth)
        ASSERT_EQ(d, 0) << "from behind";
    TestVolume empty(kShape);
    for (const float d : Rays(empty.volume, camera, {}).depth) ASSERT_EQ(d, 0);
}

TEST(Raycast, DoesNotDependOnThreads) {
    TestVolume t(kShape);
    t.fill({-4, -4, -4}, {3, 3, 3}, sphere);
    const Se3 T = look_from({0.4, 0.3, -0.7}, kCentre);
    const Rays one(t.volume, test_camera(), T, 4, 1), five(t.volume, test_camera(), T, 4, 5);
    EXPECT_EQ(one.depth, five.depth);
    EXPECT_EQ(one.normals, five.normals);
    EXPECT_EQ(one.rgb, five.rgb);
}

TEST(Raycast, FromVeryFarAwayEndsSoon) {
    const ApiMap map(test_config());
    std::vector<float> depth(40 * 30);
    const burin_camera camera = c_camera(test_camera(40, 30));
    for (const double far : {1e6, 1e12, 1e300}) {
        const auto start = std::chrono::steady_clock::now();
        burin_pose pose = c_pose({});
        pose.tx = far;
        const burin_status status = burin_raycast(map.map, &camera, &pose, depth.data(), nullptr, nullptr);
        EXPECT_TRUE(status == BURIN_OK || status == BURIN_INVALID_ARGUMENT);
        EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2)) << far << " m";
    }
}

}  // namespace
}  // namespace burin
