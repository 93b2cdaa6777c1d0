// SPDX-License-Identifier: MIT
// Kernels of colour: every target against the specification, over random and adversarial input.
#include "simd/colour.h"

#include "kernel_test.h"

namespace burin {
namespace {

using namespace simd;
constexpr int kVoxels = simd::kChunkVoxels;

class Colour : public KernelTest {};

TEST_P(Colour, VoxelsOfTheBand) {
    Rng rng(140);
    alignas(64) std::int16_t distances[kVoxels];
    alignas(64) const std::uint8_t colours[4 * kVoxels] = {};
    for (int round = 0; round < 400; ++round) {
        const std::int16_t awkward[] = {kUnseen, kFree, 0, 1, -1, -32767, 100, -100, 101, -101};
        const int density = rng.below(101);
        for (std::int16_t& d : distances)
            d = rng.below(100) >= density ? (round % 2 ? kUnseen : kFree)
                : rng.below(2)            ? awkward[rng.below(10)]
                                          : static_cast<std::int16_t>(rng.next());
        const auto band = static_cast<std::int16_t>(round % 3 ? 100 : rng.below(32767));
        std::vector<std::uint16_t> got(kListRoom, 999), expected = got;
        const int count = select_voxels(distances, band, colours, got.data());
        ASSERT_EQ(count, scalar::select_voxels(distances, band, colours, expected.data()));
        const int whole = (count + 15) & ~15;
        got.resize(static_cast<std::size_t>(whole));
        expected.resize(static_cast<std::size_t>(whole));
        ASSERT_TRUE(same_bytes(got, expected)) << round;
    }
}

TEST_P(Colour, PixelsAndMeans) {
    Rng rng(141);
    long changed = 0, outside = 0;
    for (int round = 0; round < 400; ++round) {
        const int width = 2 + rng.below(60), height = 1 + rng.below(40);
        ColourFrame frame{};
        frame.width = width;
        frame.height = height;
        frame.stride = 3 * width + rng.below(4);
        auto rgb = tight<std::uint8_t>(static_cast<std::size_t>(frame.stride * (height - 1) + 3 * width), 0);
        for (auto& c : rgb) c = static_cast<std::uint8_t>(rng.below(4) ? rng.next() : rng.below(2) * 255);
        frame.rgb = rgb.data();
        frame.number = static_cast<std::uint32_t>(rng.next());
        const float f = static_cast<float>(width);
        frame.distorted = round % 2 == 1;
        frame.fx = f;
        frame.fy = f * 0.9f;
        frame.cx = f / 2;
        frame.cy = static_cast<float>(height) / 2;
        frame.k1 = 0.2f;
        frame.k2 = -0.5f;
        frame.p1 = 0.001f;
        frame.p2 = -0.002f;
        frame.k3 = 0.4f;
        for (int k = 0; k < 3; ++k) {
            frame.step_u[k] = 0.03f * f * static_cast<float>(rng.uniform(-1, 1));
            frame.step_v[k] = 0.03f * f * static_cast<float>(rng.uniform(-1, 1));
            frame.step_z[k] = 0.02f * static_cast<float>(rng.uniform(-1, 1));
        }
        const float z = static_cast<float>(round % 7 == 0 ? rng.uniform(-0.2, 0.2) : rng.uniform(0.3, 2));
        const ProjectiveBase base{f * z * static_cast<float>(rng.uniform(-0.1, 1)),
                                  static_cast<float>(height) * z * static_cast<float>(rng.uniform(-0.1, 1)),
                                  z};
        alignas(64) std::int16_t distances[kVoxels];
        for (std::int16_t& d : distances) d = rng.below(3) ? std::int16_t{0} : kFree;
        alignas(64) std::uint8_t got[4 * kVoxels], expected[4 * kVoxels], before[4 * kVoxels];
        for (int i = 0; i < 4 * kVoxels; ++i)
            got[i] = static_cast<std::uint8_t>(i % 4 == 3 ? rng.below(kColourMemory + 1) : rng.below(256));
        std::memcpy(expected, got, sizeof got);
        std::memcpy(before, got, sizeof got);
        alignas(64) std::uint16_t list[kListRoom];
        const int count = scalar::select_voxels(distances, 10, got, list);
        alignas(64) std::int32_t pixels[kVoxels], expected_pixels[kVoxels];
        find_pixels(list, count, frame, base, pixels);
        scalar::find_pixels(list, count, frame, base, expected_pixels);
        ASSERT_EQ(std::memcmp(pixels, expected_pixels, sizeof(std::int32_t) * ((count + 15) & ~15)), 0)
            << round;
        for (int k = 0; k < count; ++k) outside += pixels[k] < 0;
        ASSERT_EQ(fuse_colours(list, count, frame, pixels, got),
                  scalar::fuse_colours(list, count, frame, pixels, expected));
        ASSERT_EQ(std::memcmp(got, expected, sizeof got), 0) << round;
        changed += std::memcmp(got, before, sizeof got) != 0;
    }
    EXPECT_GT(changed, 100);
    EXPECT_GT(outside, 1000);
}

BURIN_EVERY_TARGET(Colour);

}  // namespace
}  // namespace burin
