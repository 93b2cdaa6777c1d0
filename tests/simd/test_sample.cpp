// SPDX-License-Identifier: MIT
// Trilinear sampling: kernels on every target against the specification, and batches of points against one
// at a time.
#include "simd/sample.h"

#include "kernel_test.h"
#include "map/sample.h"
#include "map/sample_batch.h"

namespace burin {
namespace {

using namespace simd;

constexpr float kSentinel = 12345.0f;

class Sample : public KernelTest {};

TEST_P(Sample, Locate) {
    Rng rng(140);
    for (int round = 0; round < 2000; ++round) {
        const int count = 1 + rng.below(kSampleBatch);
        const auto n = static_cast<std::size_t>(count);
        std::vector<float> p[3];
        LatticeMap map;
        const double scale = round % 3 ? 200 : 1;
        for (float& m : map.m) m = static_cast<float>(scale * rng.uniform(-1, 1));
        for (float& o : map.offset) o = static_cast<float>(rng.uniform(-1, 1));
        if (round % 5 == 0) map = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
        for (auto& axis : p) {
            axis = tight<float>(n, 0);
            for (float& v : axis) switch (rng.below(5)) {
                    case 0:
                        v = awkward_floats()[static_cast<std::size_t>(
                            rng.below(static_cast<int>(awkward_floats().size())))];
                        break;
                    case 1:
                        v = static_cast<float>(rng.below(17) - 8);  // on the voxels' centres
                        break;
                    case 2:
                        v = std::nextafter(static_cast<float>(rng.below(17) - 8),
                                           rng.below(2) ? 1e9f : -1e9f);
                        break;
                    case 3:
                        v = std::nextafter(rng.below(2) ? kLatticeLimit : -kLatticeLimit,
                                           rng.below(2) ? 0.0f : 1e9f);
                        break;
                    default:
                        v = static_cast<float>(rng.uniform(-4, 4));
                }
        }
        Cells got{}, expected{};
        locate_cells(map, p[0].data(), p[1].data(), p[2].data(), count, &got);
        scalar::locate_cells(map, p[0].data(), p[1].data(), p[2].data(), count, &expected);
        for (std::size_t i = 0; i < n; ++i) {
            ASSERT_EQ(got.v[0][i], expected.v[0][i]) << i;
            for (int k = 0; k < 3; ++k) {
                ASSERT_TRUE(k == 0 || got.v[k][i] == expected.v[k][i]) << i;
                ASSERT_EQ(std::memcmp(&got.t[k][i], &expected.t[k][i], 4), 0) << i;
                ASSERT_TRUE(got.t[k][i] >= 0 && got.t[k][i] <= 1);
            }
        }
    }
}

TEST_P(Sample, Interpolate) {
    Rng rng(141);
    const std::int16_t distances[] = {0, 1, -1, 32767, -32767, -32768};
    const std::uint16_t weights[] = {1, 64, 32768, 65535};
    long known = 0;
    for (int round = 0; round < 2000; ++round) {
        Corners corners;
        Cells cells{};
        const auto half = [&](int shift, std::uint16_t v) { return static_cast<std::uint32_t>(v) << shift; };
        for (int i = 0; i < kSampleBatch; ++i) {
            for (int row = 0; row < 4; ++row) {
                corners.sdf[row][i] = corners.weight[row][i] = 0;
                for (const int shift : {0, 16}) {
                    const auto d =
                        round % 2 ? distances[rng.below(6)] : static_cast<std::int16_t>(rng.next());
                    corners.sdf[row][i] |= half(shift, static_cast<std::uint16_t>(d));
                    corners.weight[row][i] |=
                        half(shift, rng.below(16) ? weights[rng.below(4)] : std::uint16_t{0});
                }
            }
            const float ends[] = {0.0f, 1.0f, 1e-45f, 0x1.fffffep-1f};
            for (auto& t : cells.t)
                t[i] = rng.below(4) ? static_cast<float>(rng.uniform(0, 1)) : ends[rng.below(4)];
        }
        const SampleScale scale{static_cast<float>(rng.uniform(1e-7, 1e-5)),
                                static_cast<float>(rng.uniform(1e-5, 1e-3))};
        const int count = 1 + rng.below(kSampleBatch);
        const bool with_gradients = round % 3 != 0;
        std::vector<float> out[2] = {std::vector<float>(4 * kSampleBatch, kSentinel),
                                     std::vector<float>(4 * kSampleBatch, kSentinel)};
        const auto run = [&](auto kernel, std::vector<float>& to) {
            auto* gradients = reinterpret_cast<float(*)[kSampleBatch]>(to.data() + kSampleBatch);
            kernel(corners, cells.t, count, scale, to.data(), with_gradients ? gradients : nullptr);
            for (int k = 0; k < 4; ++k)
                std::fill(to.begin() + k * kSampleBatch + count, to.begin() + (k + 1) * kSampleBatch, 0.0f);
        };
        run(interpolate_cells, out[0]);
        run(scalar::interpolate_cells, out[1]);
        ASSERT_TRUE(same_bytes(out[0], out[1])) << round;
        for (int i = 0; i < count; ++i)
            known += out[0][static_cast<std::size_t>(i)] == out[0][static_cast<std::size_t>(i)];
    }
    EXPECT_GT(known, 10000);
}

// Chunks here and there, some voxels without weight, so that every cell is whole, or on a border, or misses
// something.
struct RandomMap {
    explicit RandomMap(Vec3i where) : map({400, false, 0.005f, 0.02f}), base(where) {
        Rng rng(142);
        for (int z = -3; z < 3; ++z)
            for (int y = -3; y < 3; ++y)
                for (int x = -3; x < 3; ++x) {
                    if (rng.below(10) == 0) continue;
                    ChunkGeometry& g = map.volume.geometry(map.chunk({base.x + x, base.y + y, base.z + z}));
                    for (int i = 0; i < burin::kChunkVoxels; ++i) {
                        g.sdf[i] = static_cast<std::int16_t>(rng.next());
                        g.weight[i] = rng.below(100) ? std::uint16_t{64} : std::uint16_t{0};
                    }
                }
    }
    Vec3d corner() const { return Vec3d{base.x * 0.04, base.y * 0.04, base.z * 0.04}; }
    TestVolume map;
    Vec3i base;
};

TEST_P(Sample, BatchesAreTheSamplersValues) {
    for (const Vec3i where : {Vec3i{0, 0, 0}, Vec3i{-25000, 17, 25000}, Vec3i{1000000, -1000000, 5}}) {
        RandomMap random(where);
        const Volume& volume = random.map.volume;
        Rng rng(143);
        std::vector<double> points;
        for (int i = 0; i < 5000; ++i)
            for (int k = 0; k < 3; ++k) {
                double p = random.corner()[k] + rng.uniform(-0.14, 0.14);
                if (rng.below(6) == 0) p = random.corner()[k] + 0.005 * (rng.below(48) - 24 + 0.5);
                if (rng.below(200) == 0) p = rng.below(2) ? 1e300 : static_cast<double>(NAN);
                points.push_back(p);
            }
        auto distances = tight<float>(5000, 0), gradients = tight<float>(15000, 0);
        BatchSampler batch(volume);
        batch.sample(points.data(), 5000, distances.data(), gradients.data());
        auto alone = tight<float>(4999, 0);
        BatchSampler(volume).sample(points.data(), 4999, alone.data(), nullptr);
        Sampler sampler(volume);
        int known = 0, unknown = 0;
        for (std::size_t i = 0; i < 5000; ++i) {
            float d = 0;
            Vec3f g;
            if (!sampler.distance_and_gradient({points[3 * i], points[3 * i + 1], points[3 * i + 2]}, &d,
                                               &g)) {
                ASSERT_NE(distances[i], distances[i]);
                for (std::size_t k = 0; k < 3; ++k) ASSERT_NE(gradients[3 * i + k], gradients[3 * i + k]);
                ++unknown;
                continue;
            }
            ++known;
            ASSERT_EQ(distances[i], d) << i;
            ASSERT_TRUE(i == 4999 || alone[i] == d);
            for (int k = 0; k < 3; ++k) ASSERT_EQ(gradients[3 * i + static_cast<std::size_t>(k)], g[k]) << i;
        }
        EXPECT_GT(known, 1500);
        EXPECT_GT(unknown, 500);
    }
}

// Points of a moving body in single precision: as good a kilometre away as at the origin.
TEST_P(Sample, ABodyFarAwayReadsAsWellAsOneAtHome) {
    for (const Vec3i where : {Vec3i{0, 0, 0}, Vec3i{25000, -25000, 25000}, Vec3i{-1048000, 3, 1048000}}) {
        RandomMap random(where);
        const Volume& volume = random.map.volume;
        Rng rng(144);
        // A rotation by exact thirds of 5-vectors: the map is then known to the last bit.
        const Se3 T{{{0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8}}, random.corner() + Vec3d{0.3, -0.1, 0.2}};
        const std::size_t n = 4000 + 13;
        std::vector<float> p[3] = {tight<float>(n, 0), tight<float>(n, 0), tight<float>(n, 0)};
        const Se3 back = T.inverse();
        for (std::size_t i = 0; i < n; ++i) {
            const Vec3d world = random.corner() + Vec3d{rng.uniform(-0.14, 0.14), rng.uniform(-0.14, 0.14),
                                                        rng.uniform(-0.14, 0.14)};
            const Vec3d body = back * world;
            for (int k = 0; k < 3; ++k) p[k][i] = static_cast<float>(body[k]);
        }
        p[0][7] = NAN;
        p[1][8] = 1e30f;
        auto d = tight<float>(n, 0);
        std::vector<float> g[3] = {d, d, d};
        float* const gradients[3] = {g[0].data(), g[1].data(), g[2].data()};
        BatchSampler(volume).sample(LatticeFrame(volume, T), p[0].data(), p[1].data(), p[2].data(), n,
                                    d.data(), gradients);
        Sampler sampler(volume);
        int known = 0, differ = 0;
        for (std::size_t i = 0; i < n; ++i) {
            // Within a cell of this random field the distance changes by up to 0.04 m a voxel; the
            // coordinates are off by 2^-17 of one.
            float expected = 0;
            Vec3f gradient;
            const bool there =
                sampler.distance_and_gradient(T * Vec3d{p[0][i], p[1][i], p[2][i]}, &expected, &gradient);
            if (there != (d[i] == d[i])) {
                ++differ;  // on the border of a cell
                continue;
            }
            if (!there) continue;
            ++known;
            EXPECT_NEAR(d[i], expected, 4e-6f);
            for (int k = 0; k < 3; ++k) {
                if (std::fabs(gradients[k][i] - gradient[k]) > 1e-3f) ++differ;  // it jumps between cells
            }
        }
        EXPECT_GT(known, 1200);
        EXPECT_LE(differ, 3);
    }
}

BURIN_EVERY_TARGET(Sample);

}  // namespace
}  // namespace burin
