// SPDX-License-Identifier: MIT
// Tracking on brightness: what grey is made of, where points find it, and that it holds what depth leaves
// free, under another exposure too.
#include "track/photometric.h"

#include "track/joint.h"
#include "track/sdf_tracker.h"
#include "track/verdict.h"
#include "track_helpers.h"

namespace burin {
namespace {

struct Tracked : TrackRig {
    explicit Tracked(int threads = 1) : TrackRig(noiseless_depth(), threads) {
        lay_out(test_camera(), 5, [&](Arena& arena) {
            sdf.place(arena);
            grey.place(arena);
            brightness.place(arena);
            photometric.place(arena);
        });
    }
    void see(const FrameView& frame) {
        points.build(depth.prepare(frame), jobs);
        ASSERT_TRUE(grey.build(frame, jobs));
        brightness.build(points, grey, frame, jobs);
        photometric.look_at(points, brightness, jobs);
    }

    SdfTracker sdf;
    GreyImage grey;
    PointBrightness brightness;
    Photometric photometric;
};

FrameView colour_frame(const Image<std::uint8_t>& image, PixelFormat format, const Camera& camera) {
    FrameView f;
    f.colour = image.view();
    f.colour_format = format;
    f.colour_camera = camera;
    return f;
}

double luma(const std::uint8_t* rgb) { return 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2]; }

TEST(GreyImage, EveryFormatHasTheLumaOfTheSameImageInRgb) {
    // Odd sizes too, and those whose blocks are more than a pixel.
    for (const auto& [width, height] : {std::pair{64, 48}, {161, 121}, {401, 299}}) {
        SCOPED_TRACE(width);
        const Camera camera = test_camera(width, height);
        Image<std::uint8_t> rgb(width, height, 3), bgr(width, height, 3), rgba(width, height, 4, 99),
            bgra(width, height, 4, 99), y8(width, height), yuyv(2 * ((width + 1) / 2), height, 2, 128);
        Rng rng(9);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                for (int c = 0; c < 3; ++c) {
                    const auto value = static_cast<std::uint8_t>(rng.next());
                    rgb.view().at(x, y, c) = rgba.view().at(x, y, c) = value;
                    bgr.view().at(x, y, 2 - c) = bgra.view().at(x, y, 2 - c) = value;
                }
                const double level = luma(&rgb.view().at(x, y));
                y8.view().at(x, y) = static_cast<std::uint8_t>(std::lround(level));
                yuyv.view().at(x, y) = static_cast<std::uint8_t>(std::lround(16 + 219 * level / 255));
            }
        Tracked wanted(3), got;
        const FrameView frame = colour_frame(rgb, PixelFormat::rgb8, camera);
        ASSERT_TRUE(wanted.grey.build(frame, wanted.jobs));
        const int side = TrackPoints::block_side(width, height);
        double sum = 0;  // the mean of a block, against the luma's definition
        for (int v = 0; v < side; ++v)
            for (int u = 0; u < side; ++u) sum += luma(&rgb.view().at(3 * side + u, 5 * side + v));
        EXPECT_NEAR(wanted.grey.at(3 * side + (side - 1) / 2.0, 5 * side + (side - 1) / 2.0),
                    sum / (side * side), 0.5);
        const struct {
            const Image<std::uint8_t>& image;
            PixelFormat format;
            float within;
        } cases[] = {{bgr, PixelFormat::bgr8, 0},   {rgba, PixelFormat::rgba8, 0},
                     {bgra, PixelFormat::bgra8, 0}, {y8, PixelFormat::grey8, 1},
                     {y8, PixelFormat::nv12, 1},    {y8, PixelFormat::nv21, 1},
                     {yuyv, PixelFormat::yuyv, 1}};
        for (const auto& c : cases) {
            ASSERT_TRUE(got.grey.build(colour_frame(c.image, c.format, camera), got.jobs));
            double worst = 0;
            int inside = 0;
            for (double v = -1; v < height; v += 0.75)
                for (double u = -1; u < width; u += 0.75) {
                    const float a = wanted.grey.at(u, v), b = got.grey.at(u, v);
                    ASSERT_EQ(a < 0, b < 0);
                    inside += a >= 0;
                    worst = std::max(worst, static_cast<double>(std::fabs(a - b)));
                }
            EXPECT_LE(worst, static_cast<double>(c.within)) << static_cast<int>(c.format);
            EXPECT_GT(inside, width * height);
        }
    }
}

TEST(GreyImage, BesideTheImageThereIsNone) {
    Tracked t;
    EXPECT_FALSE(t.grey.build({}, t.jobs));
    const Image<std::uint8_t> image(64, 48, 3, 100);
    ASSERT_TRUE(t.grey.build(colour_frame(image, PixelFormat::rgb8, test_camera(64, 48)), t.jobs));
    EXPECT_NEAR(t.grey.at(0, 0), 100, 1e-3);
    EXPECT_NEAR(t.grey.at(63, 47), 100, 1e-3);
    for (const auto& [u, v] : {std::pair{-0.01, 5.0},
                               {5.0, -0.01},
                               {63.01, 5.0},
                               {5.0, 47.01},
                               {1e30, 5.0},
                               {static_cast<double>(NAN), 5.0},
                               {5.0, static_cast<double>(NAN)}})
        EXPECT_LT(t.grey.at(u, v), 0) << u << ' ' << v;
    for (const auto& [width, height] : {std::pair{1, 48}, {64, 1}}) {
        const Image<std::uint8_t> thin(width, height, 3, 100);
        ASSERT_TRUE(t.grey.build(colour_frame(thin, PixelFormat::rgb8, test_camera(width, height)), t.jobs));
        EXPECT_LT(t.grey.at(0, 0), 0) << "nothing to interpolate";
    }
}

// A wall with waves of brightness, 1.5 m away, and nothing else.
AnalyticScene wall() { return {{{{0, 0, -1}, -1.5}}, {}}; }

TEST(PointBrightness, ComesFromWhereTheColourCameraSeesThePoint) {
    const Camera depth_camera = test_camera();
    Camera lens = {200, 150, 190, 192, 97.5, 77.1};
    const Se3 to_the_side = {rotation_from_vector({0.01, 0.05, -0.02}), {-0.04, 0.01, 0.005}};
    Camera bent = lens;
    bent.k1 = -0.2;
    bent.k2 = 0.05;
    bent.p1 = 0.002;
    bent.p2 = -0.003;
    const Se3 T = look_from({0.1, -0.1, 0}, {0.2, 0.1, 1.5});
    const Image<float> depth = wall().depth(depth_camera, T);
    const struct {
        Camera camera;
        Se3 T_colour_depth;
    } cases[] = {{depth_camera, {}}, {lens, to_the_side}, {bent, to_the_side}, {bent, {}}};
    for (const auto& c : cases) {
        SCOPED_TRACE(c.camera.k1);
        const Image<std::uint8_t> image = paint(wall(), c.camera, T * c.T_colour_depth.inverse());
        FrameView frame = frame_of(depth, depth_camera, T);
        frame.colour = image.view();
        frame.colour_camera = c.camera;
        frame.T_colour_depth = c.T_colour_depth;
        const bool same = c.camera.width == depth_camera.width;
        Tracked t(2);
        t.see(frame);
        for (int i = 0; i < TrackPoints::kLevels; ++i) {
            const TrackLevel& level = t.points.level(i);
            int seen = 0;
            double worst = 0;
            for (int k = 0; k < level.width * level.height; ++k) {
                const float got = t.brightness.grid(i)[k];
                if (got < 0) continue;
                ++seen;
                ASSERT_NE(level.grid_z[k], 0);
                const Vec3d p = T * to_double(Vec3f{level.grid_x[k], level.grid_y[k], level.grid_z[k]});
                const double wanted = 255 * texture_at(p) * (0.299 * 1.1 + 0.587 + 0.114 * 0.9);
                worst = std::max(worst, std::fabs(wanted - static_cast<double>(got)));
            }
            EXPECT_GT(seen, (same ? 1 : 0.65) * level.count - 1) << i;
            EXPECT_LT(worst, i == 2 ? 5.0 : 2.5) << i;  // of waves, means of 4 x 4 pixels
        }
    }
}

TEST(PointBrightness, WhatTheColourCameraDoesNotSeeHasNone) {
    const Image<float> depth = wall().depth(test_camera(), {});
    const Image<std::uint8_t> image(160, 120, 3, 100);
    FrameView frame = frame_of(depth, test_camera(), {});
    frame.colour = image.view();
    frame.colour_camera = test_camera();
    frame.T_colour_depth.t = {0, 0, -3};  // behind it
    Tracked t;
    t.see(frame);
    for (int k = 0; k < 160 * 120; ++k) ASSERT_LT(t.brightness.grid(0)[k], 0);
    const Measured nothing =
        (t.photometric.set_keyframe(t.points, t.brightness, {}), t.photometric.measure({}, 0));
    EXPECT_EQ(nothing.bright, 0);
    EXPECT_EQ(nothing.considered, 0);
    EXPECT_EQ(nothing.system.points, 0);
}

// 3 mm along the wall and 0.3 degrees about its normal.
TEST(Photometric, HoldsWhatABareWallLeavesFree) {
    burin_config config = scan_config();
    config.bilateral = 0;
    TestSession session(config);
    const Camera camera = test_camera();
    const Se3 before = look_from({0, 0, 0}, {0.1, 0.05, 1.5});
    for (int i = 0; i < 3; ++i) session.integrate(frame_of(wall().depth(camera, before), camera, before));
    // Along and about the wall, in the camera's axes.
    const Vec3d along = before.R.transposed() * Vec3d{0.003 * 0.8, -0.003 * 0.6, 0},
                about = before.R.transposed() * Vec3d{0, 0, 0.3 * kDegree};
    const Se3 truth = moved(before, {{along.x, along.y, along.z}, {about.x, about.y, about.z}});
    const Image<float> depth_before = wall().depth(camera, before), depth = wall().depth(camera, truth);
    for (const auto& [gain, bias] : {std::pair{1.0, 0.0}, {0.8, 15.0}}) {
        SCOPED_TRACE(gain);
        const Image<std::uint8_t> colour_before = paint(wall(), camera, before),
                                  colour = paint(wall(), camera, truth, gain, bias);
        FrameView frame = frame_of(depth_before, camera, before);
        frame.colour = colour_before.view();
        frame.colour_camera = camera;
        Tracked t(2);
        t.see(frame);
        EXPECT_FALSE(t.photometric.has_keyframe());
        t.photometric.set_keyframe(t.points, t.brightness, before);
        ASSERT_TRUE(t.photometric.has_keyframe());
        frame.depth_f32 = depth.view();
        frame.colour = colour.view();
        t.see(frame);
        t.sdf.look_at(session.volume(), t.points, t.jobs);

        const PoseFit by_depth = descend(t.sdf, before, {}, {});
        EXPECT_GT(away_m(by_depth.T_world_camera, truth), 0.002) << "of 3 mm: nothing holds it";

        JointMeasurement joint;
        joint.look_at(t.sdf, t.photometric, 1);
        const PoseFit by_both = descend(joint, before, {}, {});
        const Verdict held = judge(by_both, t.points.mean_depth_m(), {}, 0);
        EXPECT_EQ(held.free_directions, 0);
        EXPECT_EQ(held.state, TrackingState::tracking);
        EXPECT_GT(held.keyframe_share, 0.9);
        EXPECT_LT(away_m(by_both.T_world_camera, truth), 1e-4);               // measured 0.005 mm
        EXPECT_LT(away_rad(by_both.T_world_camera, truth), 0.005 * kDegree);  // 0.0013
        EXPECT_NEAR(t.photometric.gain(), 1 / gain, 0.01);
        EXPECT_NEAR(t.photometric.bias(), -bias / gain, 1.5);

        const PoseFit alone = descend(t.photometric, before, {}, {});
        EXPECT_LT(away_m(alone.T_world_camera, truth), 2e-4);  // 0.027 mm
        EXPECT_LT(alone.cost, kMissCost / 2);
        t.photometric.clear();
        EXPECT_FALSE(t.photometric.has_keyframe());
    }
}

TEST(Photometric, TheSameBytesForAnyNumberOfThreads) {
    Measured measured[2];
    PoseFit fits[2];
    for (int i = 0; i < 2; ++i) {
        Tracked t(i == 0 ? 1 : 3);
        t.see(room_sequence().frame(3));
        t.photometric.set_keyframe(t.points, t.brightness, room_sequence().pose(3));
        t.see(room_sequence().frame(4));
        measured[i] = t.photometric.begin_level(room_sequence().pose(3), 0);
        fits[i] = descend(t.photometric, room_sequence().pose(3), {}, {});
    }
    EXPECT_EQ(std::memcmp(&measured[0], &measured[1], sizeof(Measured)), 0);
    EXPECT_TRUE(same_bits(fits[0].T_world_camera, fits[1].T_world_camera));
    EXPECT_GT(measured[0].seen, 0.8 * measured[0].bright);
}

}  // namespace
}  // namespace burin
