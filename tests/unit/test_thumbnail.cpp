// SPDX-License-Identifier: MIT
// Thumbnails: blurred means of depth and of colour in any format and size.
#include <gtest/gtest.h>

#include "core/hash.h"
#include "fern_helpers.h"
#include "track/thumbnail.h"

namespace burin {
namespace {

DepthOptions sized(int width, int height) {
    DepthOptions o;
    o.max_width = width;
    o.max_height = height;
    return o;
}

Image<std::uint8_t> noise(int width, int height, int channels) {
    Image<std::uint8_t> image(width, height, channels);
    Rng rng(3);
    for (std::uint8_t& c : image.pixels) c = static_cast<std::uint8_t>(rng.below(256));
    return image;
}

TEST(Thumbnail, AnySizeGivesTheMean) {
    const int sizes[][2] = {{640, 480}, {160, 120}, {40, 30}, {8, 6}, {1, 1}, {333, 77}, {1280, 960}};
    for (const auto& size : sizes) {
        const int w = size[0], h = size[1];
        TestDepth depth(sized(w, h));
        const Image<float> flat(w, h, 1, 1.5f);
        FrameView view = frame_of(flat, test_camera(w, h), {});
        // The colour camera's size has nothing to do with the depth camera's.
        Image<std::uint8_t> colour(h, w, 3);
        for (std::size_t i = 0; i < colour.pixels.size(); ++i)
            colour.pixels[i] = static_cast<std::uint8_t>(50 * (i % 3 + 1));
        view.colour = colour.view();
        const Thumbnail t = make_thumbnail(depth.prepare(view), view);
        EXPECT_TRUE(t.has_colour);
        for (int i = 0; i < Thumbnail::kCells; ++i) {
            ASSERT_NEAR(t.depth_mm[i], 1500, 1) << w << "x" << h << " cell " << i;
            for (int c = 0; c < 3; ++c) ASSERT_EQ(t.rgb[3 * i + c], 50 * (c + 1));
        }
    }
}

TEST(Thumbnail, LeftIsLeftAndTopIsTop) {
    TestDepth depth(sized(320, 240));
    Image<float> scene(320, 240);
    Image<std::uint8_t> colour(80, 60, 3);
    for (int y = 0; y < 240; ++y)
        for (int x = 0; x < 320; ++x) scene.view().at(x, y) = x < 160 ? 1.0f : y < 120 ? 2.0f : 3.0f;
    for (int y = 0; y < 60; ++y)
        for (int x = 0; x < 80; ++x)
            for (int c = 0; c < 3; ++c)
                colour.view().at(x, y, c) = static_cast<std::uint8_t>(x < 40 ? 60 : y < 30 ? 120 : 180);
    FrameView view = frame_of(scene, test_camera(320, 240), {});
    view.colour = colour.view();
    const Thumbnail t = make_thumbnail(depth.prepare(view), view);
    const auto at = [](int x, int y) { return y * Thumbnail::kWidth + x; };
    const int cells[][3] = {{at(5, 5), 1000, 60}, {at(34, 5), 2000, 120}, {at(34, 24), 3000, 180}};
    for (const auto& [cell, mm, level] : cells) {
        EXPECT_NEAR(t.depth_mm[cell], mm, 1);
        EXPECT_EQ(t.rgb[3 * cell], level);
    }
    EXPECT_NEAR(t.depth_mm[at(20, 5)], 1500, 100) << "the blur over the edge";
    EXPECT_LT(t.depth_mm[at(18, 5)], t.depth_mm[at(21, 5)]);
}

TEST(Thumbnail, PixelsWithoutDepthDoNotCount) {
    TestDepth depth(sized(320, 240));
    Image<float> scene(320, 240, 1, 2.0f);
    Rng rng(4);
    for (float& d : scene.pixels)
        if (rng.below(2) == 0) d = 0;  // every other reading is missing
    for (int y = 0; y < 240; ++y)
        for (int x = 0; x < 160; ++x) scene.view().at(x, y) = 0;
    const FrameView view = frame_of(scene, test_camera(320, 240), {});
    const Thumbnail t = make_thumbnail(depth.prepare(view), view);
    for (int y = 0; y < Thumbnail::kHeight; ++y) {
        for (int x = 0; x < 15; ++x) ASSERT_EQ(t.depth_mm[y * Thumbnail::kWidth + x], 0);
        for (int x = 20; x < 40; ++x) ASSERT_NEAR(t.depth_mm[y * Thumbnail::kWidth + x], 2000, 1);
    }
    scene.pixels.assign(scene.pixels.size(), 0.0f);
    const Thumbnail none = make_thumbnail(depth.prepare(view), view);
    for (const std::uint16_t mm : none.depth_mm) ASSERT_EQ(mm, 0);
    EXPECT_FALSE(none.has_colour);
}

TEST(Thumbnail, TheSameOnEveryMachine) {
    TestDepth depth(sized(200, 150));
    Image<std::uint16_t> scene(200, 150);
    Rng rng(6);
    for (std::uint16_t& d : scene.pixels) d = static_cast<std::uint16_t>(rng.below(20000));
    FrameView view;
    view.depth_u16 = scene.view();
    view.depth_unit_m = 1.0 / 5000;
    view.depth_camera = test_camera(200, 150);
    const Image<std::uint8_t> rgb = noise(320, 240, 3);
    view.colour = rgb.view();
    const Thumbnail t = make_thumbnail(depth.prepare(view), view);
    EXPECT_EQ(hash_bytes(t.rgb, sizeof t.rgb, hash_bytes(t.depth_mm, sizeof t.depth_mm)),
              1963703453666193182u)
        << "when this is meant to change, count kVersion of fern_section.cpp on";
}

TEST(Thumbnail, FormatsOfOneImageAgree) {
    constexpr int kW = 128, kH = 96;
    TestDepth depth(sized(kW, kH));
    const Image<float> flat(kW, kH, 1, 1.0f);
    FrameView view = frame_of(flat, test_camera(kW, kH), {});
    const DepthImage& image = depth.prepare(view);
    const Image<std::uint8_t> rgb = noise(kW, kH, 3);
    view.colour = rgb.view();
    const Thumbnail expected = make_thumbnail(image, view);
    EXPECT_NE(expected.rgb[0], expected.rgb[3 * 20]);

    const PixelFormat formats[] = {PixelFormat::bgr8, PixelFormat::rgba8, PixelFormat::bgra8};
    for (const PixelFormat format : formats) {
        const int channels = format == PixelFormat::bgr8 ? 3 : 4;
        const bool bgr = format != PixelFormat::rgba8;
        Image<std::uint8_t> other(kW + 5, kH, channels, 255);  // rows with padding
        for (int y = 0; y < kH; ++y)
            for (int x = 0; x < kW; ++x)
                for (int c = 0; c < 3; ++c) other.view().at(x, y, bgr ? 2 - c : c) = rgb.view().at(x, y, c);
        view.colour = other.view();
        view.colour.width = kW;
        view.colour_format = format;
        const Thumbnail t = make_thumbnail(image, view);
        EXPECT_TRUE(std::equal(t.rgb, t.rgb + sizeof t.rgb, expected.rgb)) << static_cast<int>(format);
    }

    // Formats of luminance and chroma: neutral chroma is grey.
    const Image<std::uint8_t> luminance = noise(kW, kH, 1);
    view.colour = luminance.view();
    view.colour_format = PixelFormat::grey8;
    const Thumbnail grey = make_thumbnail(image, view);
    const Image<std::uint8_t> neutral(kW, kH / 2, 1, 128);
    view.chroma = neutral.view();
    for (const PixelFormat format : {PixelFormat::nv12, PixelFormat::nv21}) {
        view.colour_format = format;
        const Thumbnail t = make_thumbnail(image, view);
        EXPECT_TRUE(std::equal(t.rgb, t.rgb + sizeof t.rgb, grey.rgb)) << static_cast<int>(format);
    }
    Image<std::uint8_t> yuyv(kW, kH, 2, 128);
    for (std::size_t i = 0; i < yuyv.pixels.size(); i += 2) yuyv.pixels[i] = 126;  // of 16..235
    view.colour = yuyv.view();
    view.colour_format = PixelFormat::yuyv;
    for (const std::uint8_t c : make_thumbnail(image, view).rgb) ASSERT_EQ(c, 128);
}

}  // namespace
}  // namespace burin
