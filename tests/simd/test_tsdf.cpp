// SPDX-License-Identifier: MIT
// Kernels of integration: every target against the specification, over random and adversarial input.
#include "simd/tsdf.h"

#include "kernel_test.h"

namespace burin {
namespace {

using namespace simd;

constexpr std::size_t kVoxels = simd::kChunkVoxels;
const std::int16_t kDistances[] = {kUnseen, kFree, 0, 1, -1, 32766, -32766, -32767};
const std::uint16_t kWeights[] = {0, 1, 63, 64, 256, 6400, 64000, 65535};

struct Voxels {
    alignas(64) std::int16_t distances[kVoxels];
    alignas(64) std::uint16_t weights[kVoxels];
    alignas(64) std::int16_t sdf[kVoxels];
    alignas(64) std::uint16_t sums[kVoxels];

    void randomise(Rng& rng, int kind) {
        for (std::size_t i = 0; i < kVoxels; ++i) {
            distances[i] =
                rng.below(3) == 0 ? kDistances[rng.below(8)] : static_cast<std::int16_t>(rng.next());
            if (kind % 5 == 4 && i / 32 % 2) distances[i] = kUnseen;  // whole vectors of them
            weights[i] = static_cast<std::uint16_t>(rng.below(257));
            sums[i] = rng.below(2) ? kWeights[rng.below(8)] : static_cast<std::uint16_t>(rng.next());
            sdf[i] = static_cast<std::int16_t>(std::max<int>(
                -32767, rng.below(4) ? static_cast<std::int16_t>(rng.next()) : kDistances[1 + rng.below(7)]));
            if (sums[i] == 0) sdf[i] = 0;
        }
    }
    bool operator==(const Voxels& o) const { return std::memcmp(this, &o, sizeof *this) == 0; }
};

class Tsdf : public KernelTest {};

TEST_P(Tsdf, Observe) {
    Rng rng(130);
    auto offsets = std::make_unique<ProjectiveOffsets>();
    int touched = 0, free = 0;
    for (int round = 0; round < 600; ++round) {
        const int width = 1 + rng.below(round % 2 ? 40 : 300), height = 1 + rng.below(round % 2 ? 9 : 200);
        const int stride = width + 2;
        auto pixels = tight<std::uint16_t>(static_cast<std::size_t>(stride * (height + 2)), 0);
        auto weights = pixels;
        const std::uint16_t extremes[] = {1, 65533, 65534, 30000};
        for (int y = 1; y <= height; ++y)
            for (int x = 1; x <= width; ++x) {
                const auto i = static_cast<std::size_t>(y * stride + x);
                pixels[i] = rng.below(5) == 0 ? std::uint16_t{0}
                            : round % 3 == 0  ? extremes[rng.below(4)]
                                              : static_cast<std::uint16_t>(1500 + rng.below(100));
                weights[i] = static_cast<std::uint16_t>(rng.below(257));
            }
        DepthWindow window{pixels.data(), round % 4 ? weights.data() : nullptr, width, height, stride,
                           0.001f};
        // A chunk at any tilt before, behind, beside the camera, or on its plane.
        const float f = static_cast<float>(width) * 0.8f, voxel = round % 2 ? 0.01f : 0.05f;
        float axis[3][3];
        for (auto& a : axis)
            for (float& e : a) e = voxel * static_cast<float>(rng.uniform(-1, 1));
        for (std::size_t i = 0; i < kVoxels; ++i) {
            const float x = static_cast<float>(i & 7), y = static_cast<float>(i >> 3 & 7),
                        z = static_cast<float>(i >> 6);
            float p[3];
            for (int k = 0; k < 3; ++k) p[k] = axis[k][0] * x + axis[k][1] * y + axis[k][2] * z;
            offsets->z[i] = p[2];
            offsets->u[i] = f * p[0] + static_cast<float>(width) / 2 * p[2];
            offsets->v[i] = f * p[1] + static_cast<float>(height) / 2 * p[2];
        }
        const float z = round % 5 == 0 ? static_cast<float>(rng.uniform(-0.1, 0.1))
                                       : static_cast<float>(rng.uniform(1.3, 1.7));
        const ProjectiveBase base{static_cast<float>(width) * z * static_cast<float>(rng.uniform(-0.2, 1.2)),
                                  static_cast<float>(height) * z * static_cast<float>(rng.uniform(-0.2, 1.2)),
                                  round % 50 == 49 ? 1e30f : z};
        const TruncationModel model{0.08f, round % 2 == 0, 0.0019f, -0.0015f, 0.0032f, 0.02f};
        Voxels got{}, expected{};
        const bool weighted = window.weights != nullptr;
        const Observation a =
            observe_chunk(window, *offsets, base, model, got.distances, weighted ? got.weights : nullptr);
        const Observation b = scalar::observe_chunk(window, *offsets, base, model, expected.distances,
                                                    weighted ? expected.weights : nullptr);
        ASSERT_EQ(a.touched, b.touched) << round;
        ASSERT_EQ(a.free, b.free) << round;
        ASSERT_TRUE(got == expected) << round;
        touched += a.touched;
        free += a.free;
    }
    EXPECT_GT(touched, 100);
    EXPECT_GT(free, 100);
}

TEST_P(Tsdf, FuseAndCarve) {
    Rng rng(131);
    for (int round = 0; round < 500; ++round) {
        Voxels got, expected;
        got.randomise(rng, round);
        expected = got;
        const float start = round % 4 ? 3276.7f : 16000.0f;
        FuseModel model{static_cast<Drop>(round % 3), start, 1.0f / (32767.0f - start),
                        kWeights[3 + rng.below(5)]};
        const std::uint16_t* w = round % 2 ? nullptr : got.weights;
        if (round % 5 < 3) {
            ASSERT_EQ(fuse_distances(got.distances, w, model, got.sdf, got.sums),
                      scalar::fuse_distances(got.distances, w, model, expected.sdf, expected.sums));
        } else {
            const int times = 1 + rng.below(8);
            ASSERT_EQ(carve_distances(got.distances, w, times, model, got.sdf, got.sums),
                      scalar::carve_distances(got.distances, w, times, model, expected.sdf, expected.sums));
        }
        ASSERT_TRUE(got == expected) << round;
    }
}

TEST_P(Tsdf, NothingSeenNothingChanged) {
    Rng rng(132);
    Voxels voxels;
    voxels.randomise(rng, 0);
    std::fill_n(voxels.distances, kVoxels, kUnseen);
    const Voxels before = voxels;
    const FuseModel model{Drop::none, 1, 1.0f / 32766, 64000};
    EXPECT_EQ(fuse_distances(voxels.distances, nullptr, model, voxels.sdf, voxels.sums), kFree);
    EXPECT_EQ(carve_distances(voxels.distances, nullptr, 4, model, voxels.sdf, voxels.sums), -1);
    EXPECT_TRUE(voxels == before);
}

TEST_P(Tsdf, Colours) {
    Rng rng(133);
    auto offsets = std::make_unique<ProjectiveOffsets>();
    long changed = 0;
    for (int round = 0; round < 300; ++round) {
        const int width = 2 + rng.below(60), height = 1 + rng.below(40);
        const std::ptrdiff_t stride = 3 * width + rng.below(4);
        auto rgb = tight<std::uint8_t>(static_cast<std::size_t>(stride * (height - 1) + 3 * width), 0);
        for (auto& c : rgb) c = static_cast<std::uint8_t>(rng.below(4) ? rng.next() : rng.below(2) * 255);
        const float f = static_cast<float>(width);
        ColourWindow window{rgb.data(),
                            width,
                            height,
                            stride,
                            round % 2 == 1,
                            f,
                            f * 0.9f,
                            f / 2,
                            static_cast<float>(height) / 2,
                            0.2f,
                            -0.5f,
                            0.001f,
                            -0.002f,
                            0.4f};
        for (std::size_t i = 0; i < kVoxels; ++i) {
            offsets->z[i] = 0.02f * static_cast<float>(i >> 6);
            offsets->u[i] = f * 0.03f * static_cast<float>(i & 7) + window.cx * offsets->z[i];
            offsets->v[i] = f * 0.03f * static_cast<float>(i >> 3 & 7) + window.cy * offsets->z[i];
        }
        const float z = static_cast<float>(round % 7 == 0 ? rng.uniform(-0.2, 0.2) : rng.uniform(0.3, 2));
        const ProjectiveBase base{f * z * static_cast<float>(rng.uniform(-0.1, 1)),
                                  static_cast<float>(height) * z * static_cast<float>(rng.uniform(-0.1, 1)),
                                  z};
        Voxels v;
        v.randomise(rng, round);
        const ColourModel model{static_cast<std::int16_t>(rng.below(32767)),
                                static_cast<std::uint32_t>(rng.next())};
        alignas(64) std::uint8_t got[4 * kVoxels], expected[4 * kVoxels], before[4 * kVoxels];
        for (std::size_t i = 0; i < 4 * kVoxels; ++i)
            got[i] = static_cast<std::uint8_t>(i % 4 == 3 ? rng.below(kColourMemory + 1) : rng.below(256));
        std::memcpy(expected, got, sizeof got);
        std::memcpy(before, got, sizeof got);
        fuse_colours(v.distances, window, *offsets, base, model, got);
        scalar::fuse_colours(v.distances, window, *offsets, base, model, expected);
        ASSERT_EQ(std::memcmp(got, expected, sizeof got), 0) << round;
        changed += std::memcmp(got, before, sizeof got) != 0;
    }
    EXPECT_GT(changed, 100);
}

BURIN_EVERY_TARGET(Tsdf);

}  // namespace
}  // namespace burin
