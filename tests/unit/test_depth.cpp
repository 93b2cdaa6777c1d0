// SPDX-License-Identifier: MIT
// The depth stage: units, range, invalid readings, rectification, and the ranges over tiles.
#include <gtest/gtest.h>

#include <limits>

#include "map/depth_ranges.h"
#include "scene_helpers.h"

namespace burin {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

DepthOptions small_options() {
    DepthOptions o;
    o.max_width = 160;
    o.max_height = 120;
    return o;
}

TEST(Depth, SixteenBitKeepsTheSensorsUnit) {
    Image<std::uint16_t> raw(6, 1);
    raw.pixels = {0, 65535, 999, 1001, 20000, 20001};  // at 1/5000 m: range 0.2 .. 4 m
    TestDepth depth(small_options());
    const DepthImage& image = depth.prepare(frame_of(raw, 1.0 / 5000, test_camera(6, 1), {}));
    EXPECT_FLOAT_EQ(image.unit_m, 1.0f / 5000);
    const std::uint16_t expected[6] = {0, 0, 0, 1001, 20000, 0};
    for (int x = 0; x < 6; ++x)
        EXPECT_EQ(image.at(x, 0), expected[x]) << raw.pixels[static_cast<std::size_t>(x)];
    EXPECT_EQ(image.valid, 2u);
    EXPECT_FLOAT_EQ(image.nearest_m, 0.2002f);
    EXPECT_FLOAT_EQ(image.farthest_m, 4.0f);
}

TEST(Depth, TheLargestSixteenBitValueIsNoDepth) {
    Image<std::uint16_t> raw(3, 1);
    raw.pixels = {65533, 65534, 65535};  // 3.3 m at this unit, within the range
    TestDepth depth(small_options());
    const DepthImage& image = depth.prepare(frame_of(raw, 5e-5, test_camera(3, 1), {}));
    EXPECT_EQ(image.at(1, 0), 65534);
    EXPECT_EQ(image.at(2, 0), 0);
}

TEST(Depth, FloatsLoseLessThanAnEighthOfAMillimetre) {
    Image<float> raw(9, 1);
    raw.pixels = {0, -1, NAN, kInf, -kInf, 0.1999f, 0.2f, 4.0f, 4.0001f};
    TestDepth depth(small_options());
    const DepthImage& image = depth.prepare(frame_of(raw, test_camera(9, 1), {}));
    for (int x = 0; x < 9; ++x)
        EXPECT_EQ(image.at(x, 0) != 0, x == 6 || x == 7) << raw.pixels[static_cast<std::size_t>(x)];
    EXPECT_EQ(image.valid, 2u);

    Image<float> ramp(160, 120);
    for (std::size_t i = 0; i < ramp.pixels.size(); ++i)
        ramp.pixels[i] = 0.2f + 3.8f * static_cast<float>(i) / 19199.0f;
    depth.prepare(frame_of(ramp, test_camera(), {}));
    double worst = 0;
    for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 160; ++x)
            worst =
                std::max(worst, std::fabs(depth.metres(x, y) - static_cast<double>(ramp.view().at(x, y))));
    EXPECT_LT(worst, 4.0 / 65534 * 0.51);  // half a step of max_depth / 65534
    EXPECT_GT(worst, 0);
}

TEST(Depth, FloatUnitsAreHonoured) {
    Image<float> raw(2, 1);
    raw.pixels = {1500, 150};  // millimetres
    FrameView frame = frame_of(raw, test_camera(2, 1), {});
    frame.depth_unit_m = 0.001;
    TestDepth depth(small_options());
    depth.prepare(frame);
    EXPECT_NEAR(depth.metres(0, 0), 1.5, 1e-4);
    EXPECT_EQ(depth.stage.image.at(1, 0), 0);
}

TEST(Depth, StrideIsNotWidthAndTheBorderIsEmpty) {
    // The last frame was larger and full: nothing of it may be left around or in the smaller one.
    TestDepth depth(small_options());
    const Image<std::uint16_t> full(160, 120, 1, 1234);
    depth.prepare(frame_of(full, 0.001, test_camera(), {}));
    Image<std::uint16_t> wide(50, 31, 1, 3333);
    for (int y = 0; y < 31; ++y)
        for (int x = 0; x < 37; ++x) wide.view().at(x, y) = static_cast<std::uint16_t>(1000 + 37 * y + x);
    FrameView frame = frame_of(wide, 0.001, test_camera(37, 31), {});
    frame.depth_u16.width = 37;
    const DepthImage& image = depth.prepare(frame);
    ASSERT_EQ(image.width, 37);
    for (int y = 0; y < 31; ++y)
        for (int x = 0; x < 37; ++x) ASSERT_EQ(image.at(x, y), 1000 + 37 * y + x);
    for (int x = -1; x <= 37; ++x) {
        EXPECT_EQ(image.at(x, -1), 0);
        EXPECT_EQ(image.at(x, 31), 0);
    }
    for (int y = -1; y <= 31; ++y) {
        EXPECT_EQ(image.at(-1, y), 0);
        EXPECT_EQ(image.at(37, y), 0);
    }
}

TEST(Depth, RectifiesADistortedCamera) {
    // A tilted plane through the lens of TUM's freiburg1 depth camera: after rectification every pixel must
    // lie on the plane along the pinhole's ray.
    Camera camera = test_camera();
    camera.k1 = 0.2624, camera.k2 = -0.9531, camera.p1 = -0.0054, camera.p2 = 0.0026, camera.k3 = 1.1633;
    const AnalyticScene plane{{{normalised(Vec3d{0.3, -0.2, -1}), -1.5}}, {}};
    TestDepth depth(small_options());
    const DepthImage& image = depth.prepare(frame_of(plane.depth(camera, {}), camera, {}));
    EXPECT_FALSE(image.camera.distorted());
    const Camera pinhole = test_camera();
    int compared = 0;
    double worst = 0, worst_unrectified = 0;
    for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 160; ++x) {
            if (image.at(x, y) == 0) continue;
            const Pixel p{static_cast<double>(x), static_cast<double>(y)};
            const double truth = plane.trace({}, unproject(pinhole, p));
            worst = std::max(worst, std::fabs(depth.metres(x, y) - truth));
            worst_unrectified =
                std::max(worst_unrectified, std::fabs(plane.trace({}, unproject(camera, p)) - truth));
            ++compared;
        }
    // The nearest reading is up to 0.71 pixel away; the plane changes by 1.5 m * 0.36 / 131 = 4.5 mm a pixel.
    EXPECT_LT(worst, 0.0045);
    EXPECT_GT(worst_unrectified, 0.01) << "this lens does not need rectification, the test is idle";
    EXPECT_GT(compared, 160 * 120 * 85 / 100);
}

DepthRange brute_force(const DepthImage& image, int x0, int y0, int x1, int y1) {
    DepthRange range{0, 0};
    for (int y = std::max(y0, 0); y <= std::min(y1, image.height - 1); ++y)
        for (int x = std::max(x0, 0); x <= std::min(x1, image.width - 1); ++x) {
            const std::uint16_t d = image.at(x, y);
            if (d == 0) continue;
            range.least = range.largest == 0 ? d : std::min(range.least, d);
            range.largest = std::max(range.largest, d);
        }
    return range;
}

TEST(Depth, RangesNeverMissADepth) {
    Rng rng(11);
    Arena measure;
    DepthRanges().place(measure, 160, 120);
    const Memory memory = aligned_memory(measure.used());
    Arena arena(memory.get(), measure.used());
    DepthRanges ranges;
    ranges.place(arena, 160, 120);
    TestDepth depth(small_options());
    int exact = 0, all = 0;
    for (int round = 0; round < 40; ++round) {
        const int width = 1 + rng.below(160), height = 1 + rng.below(120), density = 1 + rng.below(100);
        Image<std::uint16_t> raw(width, height);
        for (std::uint16_t& d : raw.pixels)
            if (rng.below(100) < density) d = static_cast<std::uint16_t>(200 + rng.below(3800));
        const DepthImage& image = depth.prepare(frame_of(raw, 0.001, test_camera(width, height), {}));
        ranges.build(depth.stage.tiles);
        for (int box = 0; box < 200; ++box) {
            const int x0 = rng.below(width + 40) - 20, y0 = rng.below(height + 40) - 20;
            const int x1 = x0 + rng.below(box % 2 ? 12 : width), y1 = y0 + rng.below(box % 2 ? 12 : height);
            const DepthRange got = ranges.over(x0, y0, x1, y1), truth = brute_force(image, x0, y0, x1, y1);
            if (truth.largest == 0) continue;
            ASSERT_GT(got.largest, 0);
            ASSERT_LE(got.least, truth.least) << x0 << ' ' << y0 << ' ' << x1 << ' ' << y1;
            ASSERT_GE(got.largest, truth.largest) << x0 << ' ' << y0 << ' ' << x1 << ' ' << y1;
            exact += got.least == truth.least && got.largest == truth.largest;
            ++all;
        }
        const DepthRange whole = ranges.all(), truth = brute_force(image, 0, 0, width - 1, height - 1);
        EXPECT_EQ(whole.least, truth.least);
        EXPECT_EQ(whole.largest, truth.largest);
    }
    EXPECT_GT(exact, all / 10) << "conservative, but no longer of use";
}

TEST(Depth, WeightsFollowDistanceAndAngle) {
    DepthOptions options = small_options();
    options.inverse_z2_weight = true;
    const Camera camera = test_camera();
    {
        TestDepth depth(options);
        Image<float> raw(160, 120, 1, 0.0f);
        for (int y = 0; y < 120; ++y)
            for (int x = 0; x < 160; ++x)
                raw.view().at(x, y) = x < 40 ? 0.4f : x < 80 ? 1.0f : x < 120 ? 2.0f : 0.0f;
        const DepthImage& image = depth.prepare(frame_of(raw, camera, {}));
        const auto weight = [&](int x) { return image.weights[(60 + 1) * image.stride + x + 1]; };
        EXPECT_EQ(weight(10), 4 * 64);  // (1 / 0.4)^2 = 6.25, cut at 4
        EXPECT_NEAR(weight(50), 64, 1);
        EXPECT_NEAR(weight(90), 16, 1);
        EXPECT_EQ(weight(130), 0);
    }
    options.inverse_z2_weight = false;
    options.angle_weight = true;
    TestDepth depth(options);
    const AnalyticScene plane{{{normalised(Vec3d{std::sqrt(3.0), 0, -1}), -1.0}},
                              {}};  // 60 degrees off the axis
    const DepthImage& image = depth.prepare(frame_of(plane.depth(camera, {}), camera, {}));
    const int x = 79, y = 59;
    ASSERT_NE(image.at(x, y), 0);
    EXPECT_NEAR(image.weights[(y + 1) * image.stride + x + 1], 32, 2);
}

}  // namespace
}  // namespace burin
