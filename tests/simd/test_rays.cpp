// SPDX-License-Identifier: MIT
// Ray casting: the kernels on every target against the specification, and whole images against those of the
// specification.
#include "simd/rays.h"

#include "kernel_test.h"
#include "map/raycast.h"

namespace burin {
namespace {

using namespace simd;

class Rays : public KernelTest {};

// Rays in every state that ray casting leaves them in, and in some that it does not.
RayPacket random_rays(Rng& rng, int round) {
    RayPacket r{};
    for (float& s : r.start) s = static_cast<float>(rng.uniform(-0.5, 7.5));
    for (int i = 0; i < kRays; ++i) {
        Vec3f d = to_float(normalised(Vec3d{rng.normal(), rng.normal(), rng.normal()}));
        if (rng.below(4) == 0) d[rng.below(3)] = 0;  // along a wall
        d = normalised(d);
        if (rng.below(8) == 0) d = {rng.below(2) ? -1.0f : 1.0f, 0, rng.below(2) ? -0.0f : 0.0f};
        for (int k = 0; k < 3; ++k) {
            r.direction[k][i] = d[k];
            r.inverse[k][i] = d[k] != 0 ? 1.0f / d[k] : 0.0f;
        }
        r.t[i] = static_cast<float>(rng.below(5) ? rng.uniform(0, 600) : rng.uniform(0, 31000));
        if (rng.below(10) == 0) r.t[i] = 0;
        r.t_end[i] =
            rng.below(6) == 0 || round % 7 == 6 ? -1.0f : r.t[i] + static_cast<float>(rng.uniform(-2, 8));
        r.front[i] = rng.below(2) ? -1.0f : r.t[i] - static_cast<float>(rng.uniform(0, 4));
        r.fine_end[i] = rng.below(2) ? -1.0f : r.t[i] + static_cast<float>(rng.uniform(-1, 1));
        r.before_d[i] = rng.below(2) ? -1.0f : static_cast<float>(rng.uniform(0, 2));
        r.before_t[i] = r.t[i] - 1;
        r.chunk[0][i] = r.chunk[1][i] = r.chunk[2][i] = 0;
    }
    return r;
}

testing::AssertionResult same_rays(const RayPacket& got, const RayPacket& expected, std::uint64_t of) {
    for (int i = 0; i < kRays; ++i) {
        const auto differs = [&](const auto* a, const auto* b) { return std::memcmp(&a[i], &b[i], 4) != 0; };
        if (differs(got.t, expected.t) || differs(got.t_end, expected.t_end) ||
            differs(got.front, expected.front) || differs(got.fine_end, expected.fine_end) ||
            differs(got.before_d, expected.before_d) || differs(got.before_t, expected.before_t))
            return testing::AssertionFailure()
                   << "ray " << i << " is at " << got.t[i] << ", expected " << expected.t[i];
        if (!(of >> i & 1)) continue;
        for (int k = 0; k < 3; ++k)
            if (differs(got.chunk[k], expected.chunk[k]))
                return testing::AssertionFailure() << "chunk of ray " << i;
        if (differs(got.chunk_low, expected.chunk_low) || differs(got.chunk_high, expected.chunk_high) ||
            differs(got.voxel, expected.voxel))
            return testing::AssertionFailure() << "voxel of ray " << i;
    }
    return testing::AssertionSuccess();
}

TEST_P(Rays, LocateAndStep) {
    Rng rng(150);
    const std::int32_t readings[] = {kNoChunkThere, kNotObserved, 0, 1, -1, 32767, -32767, 16383, 16384};
    long steps = 0;
    for (int round = 0; round < 3000; ++round) {
        RayPacket got = random_rays(rng, round), expected = got;
        const std::uint64_t walking = locate_voxels(&got);
        ASSERT_EQ(walking, scalar::locate_voxels(&expected)) << round;
        ASSERT_TRUE(same_rays(got, expected, walking)) << round;
        auto read = tight<std::int32_t>(kRays, 0);
        for (std::int32_t& r : read) r = readings[rng.below(9)];
        const float units = round % 2 ? 4.0f / 32767 : static_cast<float>(rng.uniform(1, 30)) / 32767;
        ASSERT_EQ(step_rays(&got, read.data(), units), scalar::step_rays(&expected, read.data(), units))
            << round;
        ASSERT_TRUE(same_rays(got, expected, walking)) << round;
        for (int i = 0; i < kRays; ++i) steps += walking >> i & 1;
    }
    EXPECT_GT(steps, 50000);
}

TEST(RaysSpecification, TheAddressIsThatOfTheNearestVoxel) {
    Rng rng(151);
    for (int round = 0; round < 200; ++round) {
        RayPacket r = random_rays(rng, 0);
        const std::uint64_t walking = scalar::locate_voxels(&r);
        for (int i = 0; i < kRays; ++i) {
            if (!(walking >> i & 1)) continue;
            for (int k = 0; k < 3; ++k) {
                const double v = static_cast<double>(r.start[k]) +
                                 static_cast<double>(r.direction[k][i]) * static_cast<double>(r.t[i]);
                const int voxel = 8 * r.chunk[k][i] + (r.voxel[i] >> 3 * k & 7);
                ASSERT_LE(std::fabs(v - voxel), 0.51);
                ASSERT_EQ(r.chunk_low[i] >> 3 * k & 7, r.chunk[k][i] & 7);
                ASSERT_EQ(r.chunk_high[i] >> 10 * k & 1023, r.chunk[k][i] >> 3 & 1023);
            }
        }
    }
}

// A step out of a chunk ends in the next one, whatever the direction.
TEST_P(Rays, LeaveTheirChunk) {
    Rng rng(152);
    const auto nothing = tight<std::int32_t>(kRays, kNoChunkThere);
    for (int round = 0; round < 300; ++round) {
        RayPacket r = random_rays(rng, 0);
        for (int i = 0; i < kRays; ++i) {
            r.t[i] = static_cast<float>(rng.uniform(0, 1000));
            r.t_end[i] = 2000;
            r.front[i] = r.fine_end[i] = -1;
        }
        locate_voxels(&r);
        const RayPacket before = r;
        ASSERT_EQ(step_rays(&r, nothing.data(), 1), 0u);
        locate_voxels(&r);
        for (int i = 0; i < kRays; ++i) {
            ASSERT_GT(r.t[i], before.t[i]);
            ASSERT_LT(r.t[i], before.t[i] + 8 * 1.7321f + 0.02f);
            int moved = 0;
            for (int k = 0; k < 3; ++k) moved += std::abs(r.chunk[k][i] - before.chunk[k][i]);
            ASSERT_GE(moved, 1) << "ray " << i << " at " << before.t[i];
            ASSERT_LE(moved, 3);
        }
    }
}

TEST_P(Rays, ImagesDoNotDependOnTheTarget) {
    TestVolume t({1500, true, 0.01f, 0.04f});
    t.fill({-4, -4, -4}, {3, 3, 3}, [](Vec3d p) { return norm(p) - 0.2; });
    Rng rng(153);
    for (std::uint32_t slot = 0; slot < t.volume.live(); ++slot)
        for (int i = 0; i < burin::kChunkVoxels; ++i) {
            if (rng.below(40) == 0) t.volume.geometry(slot).weight[i] = 0;
            for (auto& c : t.volume.colour(slot).rgbn[i]) c = static_cast<std::uint8_t>(rng.below(256));
        }
    struct Images {
        std::vector<float> depth, normals;
        std::vector<std::uint8_t> rgb;
    };
    const auto cast = [&](const Camera& camera, const Se3& T, int threads) {
        const auto n = static_cast<std::size_t>(camera.width * camera.height);
        Images images{tight<float>(n, 9), tight<float>(3 * n, 9), tight<std::uint8_t>(3 * n, 9)};
        Jobs jobs(threads);
        raycast(t.volume, camera, T, 4, {images.depth.data(), images.normals.data(), images.rgb.data()},
                jobs);
        return images;
    };
    int hits = 0;
    for (const auto& [width, height] : {std::pair{1, 1}, {7, 9}, {8, 8}, {33, 17}, {160, 120}})
        for (int view = 0; view < 4; ++view) {
            const Vec3d eye =
                normalised(Vec3d{rng.normal(), rng.normal(), rng.normal()}) * rng.uniform(0.1, 1.2);
            const Camera camera = test_camera(width, height);
            const Se3 T = look_from(eye, {0.01, -0.02, 0.005}, {0.1, 0.9, 0.3});
            const Images got = cast(camera, T, 2);
            ASSERT_TRUE(simd::select_target("scalar"));
            const Images expected = cast(camera, T, 1);
            ASSERT_TRUE(simd::select_target(GetParam()));
            ASSERT_TRUE(same_bytes(got.depth, expected.depth));
            ASSERT_TRUE(same_bytes(got.normals, expected.normals));
            ASSERT_TRUE(same_bytes(got.rgb, expected.rgb));
            for (const float d : got.depth) hits += d > 0;
        }
    EXPECT_GT(hits, 1000);
}

BURIN_EVERY_TARGET(Rays);

}  // namespace
}  // namespace burin
