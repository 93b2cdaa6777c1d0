// SPDX-License-Identifier: MIT
// What a frame may bring: colour in every pixel format gives the map of the same image in RGB, and depth that
// the sensor is not sure of gives the map of the same depth with holes.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "api_checks.h"
#include "scene_helpers.h"

namespace burin {
namespace {

constexpr int kWidth = 160, kHeight = 120;

struct Scene {
    Camera camera = test_camera(kWidth, kHeight);
    Se3 pose = arc_pose(0, 3);
    Image<float> depth = ball_and_wall().depth(camera, pose);

    burin_frame frame() const { return c_frame(frame_of(depth, camera, pose)); }
    burin_frame with_colour(const std::vector<std::uint8_t>& image, burin_pixel_format format,
                            std::uint64_t stride) const {
        burin_frame f = frame();
        f.colour = image.data();
        f.colour_format = format;
        f.colour_stride_bytes = stride;
        f.colour_camera = c_camera(camera);
        return f;
    }
};

std::uint64_t hash_after(const burin_frame& frame, const burin_config& config = test_config()) {
    const ApiMap map(config);
    for (int i = 0; i < 3; ++i)
        EXPECT_EQ(burin_integrate(map.map, &frame, nullptr), BURIN_OK) << burin_last_error(map.map);
    return map.hash();
}

// Something different in every pixel and channel.
std::vector<std::uint8_t> test_image(int channels) {
    std::vector<std::uint8_t> out(static_cast<std::size_t>(kWidth * kHeight * channels));
    Rng rng(7);
    for (std::uint8_t& c : out) c = static_cast<std::uint8_t>(rng.next());
    return out;
}

// Every pixel of `from` (`channels` bytes) by `put`, rows of `stride` bytes filled up with rubbish.
template <class Put>
std::vector<std::uint8_t> rearranged(const std::vector<std::uint8_t>& from, int channels, int pixel_bytes,
                                     int stride, Put&& put) {
    std::vector<std::uint8_t> out(static_cast<std::size_t>(stride * kHeight), 0xee);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            put(&from[static_cast<std::size_t>(channels * (y * kWidth + x))],
                &out[static_cast<std::size_t>(stride * y + pixel_bytes * x)]);
    return out;
}

TEST(Formats, OrderOfChannelsAndPaddingDoNotMatter) {
    const Scene scene;
    const std::vector<std::uint8_t> rgb = test_image(3);
    const std::uint64_t wanted = hash_after(scene.with_colour(rgb, BURIN_PIXEL_RGB8, 3 * kWidth));
    EXPECT_NE(wanted, hash_after(scene.frame()));
    const auto same = [](const std::uint8_t* in, std::uint8_t* out) { std::copy_n(in, 3, out); };
    const auto swapped = [](const std::uint8_t* in, std::uint8_t* out) {
        std::reverse_copy(in, in + 3, out);
    };
    struct {
        burin_pixel_format format;
        int bytes;
        bool swap;
    } const cases[] = {{BURIN_PIXEL_RGB8, 3, false},
                       {BURIN_PIXEL_BGR8, 3, true},
                       {BURIN_PIXEL_RGBA8, 4, false},
                       {BURIN_PIXEL_BGRA8, 4, true}};
    for (const auto& c : cases)
        for (const int padding : {0, 5}) {
            const int stride = c.bytes * kWidth + padding;
            const auto image = c.swap ? rearranged(rgb, 3, c.bytes, stride, swapped)
                                      : rearranged(rgb, 3, c.bytes, stride, same);
            EXPECT_EQ(hash_after(scene.with_colour(image, c.format, static_cast<std::uint64_t>(stride))),
                      wanted)
                << "format " << c.format << ", padding " << padding;
        }
}

TEST(Formats, Grey) {
    const Scene scene;
    const std::vector<std::uint8_t> grey = test_image(1);
    const auto rgb = rearranged(grey, 1, 3, 3 * kWidth,
                                [](const std::uint8_t* in, std::uint8_t* out) { std::fill_n(out, 3, *in); });
    EXPECT_EQ(hash_after(scene.with_colour(grey, BURIN_PIXEL_GREY8, kWidth)),
              hash_after(scene.with_colour(rgb, BURIN_PIXEL_RGB8, 3 * kWidth)));
}

struct Yuv {
    std::uint8_t y, u, v;
};

// ITU-R BT.601 from its luma weights, in doubles.
Vec3d to_rgb(Yuv c, bool video_range) {
    const double y = video_range ? (c.y - 16) / 219.0 : c.y / 255.0, scale = video_range ? 224.0 : 255.0;
    const double b = y + 2 * (1 - 0.114) * (c.u - 128) / scale, r = y + 2 * (1 - 0.299) * (c.v - 128) / scale;
    const double g = (y - 0.299 * r - 0.114 * b) / 0.587;
    const auto byte = [](double x) { return std::clamp(255 * x, 0.0, 255.0); };
    return {byte(r), byte(g), byte(b)};
}

TEST(Formats, YuvBecomesTheColourOfItsDefinition) {
    const Scene scene;
    Rng rng(11);
    for (int trial = 0; trial < 12; ++trial) {
        const auto byte = [&] { return static_cast<std::uint8_t>(rng.next()); };
        const Yuv c = {byte(), byte(), byte()};
        std::vector<std::uint8_t> yuyv, luma(kWidth * kHeight, c.y), uv, vu;
        for (int i = 0; i < kWidth * kHeight / 2; ++i) yuyv.insert(yuyv.end(), {c.y, c.u, c.y, c.v});
        for (int i = 0; i < kWidth * kHeight / 4; ++i)
            uv.insert(uv.end(), {c.u, c.v}), vu.insert(vu.end(), {c.v, c.u});
        for (const burin_pixel_format format : {BURIN_PIXEL_YUYV, BURIN_PIXEL_NV12, BURIN_PIXEL_NV21}) {
            const bool packed = format == BURIN_PIXEL_YUYV;
            burin_frame f = scene.with_colour(packed ? yuyv : luma, format, packed ? 2 * kWidth : kWidth);
            f.chroma = format == BURIN_PIXEL_NV12 ? uv.data() : vu.data();
            f.chroma_stride_bytes = kWidth;
            const ApiMap map(test_config());
            ASSERT_EQ(burin_integrate(map.map, &f, nullptr), BURIN_OK) << burin_last_error(map.map);
            std::vector<std::uint8_t> rgb(3 * kWidth * kHeight);
            ASSERT_EQ(
                burin_raycast(map.map, &f.depth_camera, &f.T_world_camera, nullptr, nullptr, rgb.data()),
                BURIN_OK);
            const Vec3d wanted = to_rgb(c, packed);
            const std::uint8_t* middle = &rgb[3 * (kHeight / 2 * kWidth + kWidth / 2)];
            for (int k = 0; k < 3; ++k) EXPECT_NEAR(middle[k], wanted[k], 1.01) << "format " << format;
        }
    }
}

// Each pixel takes the chroma of its own pair: the right ones of neighbours that differ.
TEST(Formats, ChromaBelongsToItsPixels) {
    const Scene scene;
    const std::vector<std::uint8_t> luma = test_image(1);
    std::vector<std::uint8_t> uv(kWidth * kHeight / 2), grown(2 * kWidth * kHeight);
    Rng rng(3);
    for (std::uint8_t& c : uv) c = static_cast<std::uint8_t>(rng.next());
    burin_frame f = scene.with_colour(luma, BURIN_PIXEL_NV12, kWidth);
    f.chroma = uv.data();
    f.chroma_stride_bytes = kWidth;
    const std::uint64_t wanted = hash_after(f);
    std::vector<std::uint8_t> vu = uv;
    for (std::size_t i = 0; i < vu.size(); i += 2) std::swap(vu[i], vu[i + 1]);
    f.chroma = vu.data();
    EXPECT_NE(hash_after(f), wanted);
    f.colour_format = BURIN_PIXEL_NV21;
    EXPECT_EQ(hash_after(f), wanted);
}

TEST(Confidence, DepthBelowTheThresholdIsNoDepth) {
    Scene scene;
    std::vector<std::uint8_t> confidence(static_cast<std::size_t>(kWidth * kHeight));
    Rng rng(5);
    for (std::uint8_t& c : confidence) c = static_cast<std::uint8_t>(rng.below(3));
    for (const bool distorted : {false, true})
        for (const std::uint32_t bilateral : {0u, 1u}) {
            Scene holes;
            for (Scene* s : {&scene, &holes}) s->camera.k1 = distorted ? 0.05 : 0;
            for (std::size_t i = 0; i < confidence.size(); ++i)
                if (confidence[i] < 2) holes.depth.pixels[i] = 0;
            burin_config config = test_config();
            config.bilateral = bilateral;
            burin_frame f = scene.frame();
            f.confidence = confidence.data();
            f.confidence_stride_bytes = kWidth;
            EXPECT_EQ(hash_after(f, config), hash_after(scene.frame(), config))
                << "a threshold of 0 drops nothing";
            f.min_confidence = 2;
            EXPECT_EQ(hash_after(f, config), hash_after(holes.frame(), config));
            f.min_confidence = 3;
            burin_frame_result result;
            const ApiMap map(config);
            EXPECT_EQ(burin_integrate(map.map, &f, &result), BURIN_OK);
            EXPECT_EQ(result.valid_pixels, 0u);
        }
}

}  // namespace
}  // namespace burin
