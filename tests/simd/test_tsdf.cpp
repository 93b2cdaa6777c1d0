// SPDX-License-Identifier: MIT
// Kernels of integration: every target against the specification, over random and adversarial input.
#include "simd/tsdf.h"

#include "kernel_test.h"
#include "simd/visibility.h"

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

// A camera of focal length f over an image, and a chunk at any tilt before, behind, beside it, or on its
// plane.
struct Scene {
    std::vector<std::uint16_t> pixels, weights;
    DepthProjection frame{};
    float axis[3][3];  // of a voxel along x, y, z: camera coordinates, stored units
    float f;

    Scene(Rng& rng, int round) {
        const int width = 1 + rng.below(round % 2 ? 40 : 300), height = 1 + rng.below(round % 2 ? 9 : 200);
        const int stride = width + 2;
        pixels = tight<std::uint16_t>(static_cast<std::size_t>(stride * (height + 2)), 0);
        weights = pixels;
        const std::uint16_t extremes[] = {1, 65533, 65534, 30000};
        for (int y = 1; y <= height; ++y)
            for (int x = 1; x <= width; ++x) {
                const auto i = static_cast<std::size_t>(y * stride + x);
                pixels[i] = rng.below(5) == 0 ? std::uint16_t{0}
                            : round % 3 == 0  ? extremes[rng.below(4)]
                                              : static_cast<std::uint16_t>(1500 + rng.below(100));
                weights[i] = static_cast<std::uint16_t>(rng.below(257));
            }
        frame.pixels = pixels.data();
        frame.weights = round % 4 == 0 ? weights.data() : nullptr;
        frame.width = width;
        frame.height = height;
        frame.stride = stride;
        frame.unit_m = 0.001f;
        frame.truncation = {0.08f, round % 5 == 1, 0.0019f, -0.0015f, 0.0032f, 0.02f};
        frame.drop = round % 8 == 3 ? Drop::linear : round % 8 == 6 ? Drop::exponential : Drop::none;
        frame.drop_start_m = 0.01f;
        const float to_units = frame.truncation.units_per_m();
        const float voxel = (round % 2 ? 0.002f : 0.05f) * to_units;
        f = static_cast<float>(width) * 0.8f;
        for (auto& a : axis)
            for (float& e : a) e = voxel * static_cast<float>(rng.uniform(-1, 1));
        for (int i = 0; i < kBlocks; ++i) {
            const float x = static_cast<float>(4 * (i & 1)), y = static_cast<float>(4 * (i >> 1 & 1)),
                        z = static_cast<float>(i >> 2);
            ProjectiveOffsets& o = frame.offsets;
            for (int k = 0; k < kBlockVoxels; ++k)
                put(x + static_cast<float>(k & 3), y + static_cast<float>(k >> 2), z, &o.block[i].u[k],
                    &o.block[i].v[k], &o.block[i].z[k]);
            put(x + 1.5f, y + 1.5f, z, &o.middle_u[i], &o.middle_v[i], &o.middle_z[i]);
        }
    }
    // Projective coordinates of a difference of points, in voxels.
    void put(float x, float y, float z, float* u, float* v, float* w) const {
        float p[3];
        for (int k = 0; k < 3; ++k) p[k] = axis[k][0] * x + axis[k][1] * y + axis[k][2] * z;
        *u = f * p[0] + (static_cast<float>(frame.width) / 2 + 1) * p[2];
        *v = f * p[1] + (static_cast<float>(frame.height) / 2 + 1) * p[2];
        *w = p[2];
    }
    ChunkProjection projection() const {
        ChunkProjection p{};
        for (int k = 0; k < 8; ++k)
            put(static_cast<float>(7 * (k & 1)), static_cast<float>(7 * (k >> 1 & 1)),
                static_cast<float>(7 * (k >> 2)), &p.corner_u[k], &p.corner_v[k], &p.corner_z[k]);
        put(1, 0, 0, &p.voxel_u[0], &p.voxel_v[0], &p.voxel_z[0]);
        put(0, 1, 0, &p.voxel_u[1], &p.voxel_v[1], &p.voxel_z[1]);
        return p;
    }
};

// The hints must be true: as ChunkReach derives them.
ProjectedChunk with_hints(const Scene& scene, ProjectedChunk chunk) {
    ChunkProjection p = scene.projection();
    p.origin_u = chunk.u;
    p.origin_v = chunk.v;
    p.origin_z = chunk.z;
    ChunkBatch batch{};
    scalar::project_chunks(p, &batch);
    chunk.far = batch.least_z[0] > 32800.0f;
    chunk.inside = chunk.far && batch.least_u[0] > 1 && batch.least_v[0] > 1 &&
                   batch.most_u[0] < static_cast<float>(scene.frame.width) &&
                   batch.most_v[0] < static_cast<float>(scene.frame.height);
    chunk.small = chunk.far && batch.block_reach[0] < kWindowReach;
    return chunk;
}

TEST_P(Tsdf, Observe) {
    Rng rng(130);
    int touched = 0, free = 0, inside = 0, small = 0, rim = 0;
    for (int round = 0; round < 1500; ++round) {
        const Scene scene(rng, round);
        const float to_units = scene.frame.truncation.units_per_m();
        const float z = to_units * (round % 7 == 0 ? static_cast<float>(rng.uniform(-0.1, 0.1))
                                                   : static_cast<float>(rng.uniform(1.3, 1.7)));
        ProjectedChunk chunk{
            static_cast<float>(scene.frame.width) * z * static_cast<float>(rng.uniform(-0.2, 1.2)),
            static_cast<float>(scene.frame.height) * z * static_cast<float>(rng.uniform(-0.2, 1.2)),
            round % 50 == 49 ? 1e30f : z,
            false,
            false,
            false,
            round % 3 == 1 ? static_cast<float>(rng.uniform(1, 1.4)) : 1.0f};
        if (round % 50 != 49) chunk = with_hints(scene, chunk);
        inside += chunk.inside;
        small += chunk.small;
        rim += chunk.small && !chunk.inside;
        Voxels got{}, expected{};
        const Observation a =
            observe_chunk(scene.frame, chunk, got.distances, got.weights, round % 2 ? got.sdf : nullptr);
        const Observation b =
            scalar::observe_chunk(scene.frame, chunk, expected.distances, expected.weights, nullptr);
        ASSERT_EQ(a.touched, b.touched) << round;
        ASSERT_EQ(a.free, b.free) << round;
        if (!a.touched && !a.free) continue;
        ASSERT_TRUE(got == expected) << round;
        touched += a.touched;
        free += a.free;
    }
    EXPECT_GT(touched, 200);
    EXPECT_GT(free, 200);
    EXPECT_GT(inside, 50);
    EXPECT_GT(small, 100);
    EXPECT_GT(rim, 20);
}

TEST_P(Tsdf, FuseAndCarve) {
    Rng rng(131);
    for (int round = 0; round < 500; ++round) {
        Voxels got, expected;
        got.randomise(rng, round);
        for (std::uint16_t& sum : got.sums) sum = std::min<std::uint16_t>(sum, 64000);
        expected = got;
        const std::uint16_t max_weight = std::min<std::uint16_t>(kWeights[3 + rng.below(5)], 64000);
        const std::uint16_t* w = round % 2 ? nullptr : got.weights;
        // The observations that weigh nothing are marked by observe_chunk.
        if (w)
            for (std::size_t i = 0; i < kVoxels; ++i)
                if (w[i] == 0) got.distances[i] = expected.distances[i] = kUnseen;
        if (round % 5 < 3) {
            const std::uint16_t nears[] = {0, 1, 4000, 16383, 32766};
            const std::uint16_t near = nears[rng.below(5)];
            std::uint16_t moved = 1, moved_spec = 2;
            ASSERT_EQ(fuse_distances(got.distances, w, max_weight, got.sdf, got.sums, near, &moved),
                      scalar::fuse_distances(got.distances, w, max_weight, expected.sdf, expected.sums, near,
                                             &moved_spec));
            ASSERT_EQ(moved, moved_spec) << round << ", near " << near;
        } else {
            const int times = 1 + rng.below(8);
            ASSERT_EQ(
                carve_distances(got.distances, w, times, max_weight, got.sdf, got.sums),
                scalar::carve_distances(got.distances, w, times, max_weight, expected.sdf, expected.sums));
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
    EXPECT_EQ(fuse_distances(voxels.distances, nullptr, 64000, voxels.sdf, voxels.sums), kFree);
    EXPECT_EQ(carve_distances(voxels.distances, nullptr, 4, 64000, voxels.sdf, voxels.sums), -1);
    EXPECT_TRUE(voxels == before);
}

TEST_P(Tsdf, MovedTellsStepsNearTheSurface) {
    // One voxel at a time, anywhere in the chunk: before, distance, weight before -> what is told.
    struct Case {
        int before, distance, sum, moved;
    };
    const Case cases[] = {{100, 300, 64, 100},       // half way
                          {1000, -1000, 192, 500},   // through zero
                          {1001, 1001, 64, 0},       // seen, and as it was
                          {3000, 9000, 64, 0},       // from far to farther
                          {3000, 1000, 64, 1000},    // arrives at 2000, the limit
                          {2000, 30000, 64, 14000},  // leaves
                          {0, 2000, 0, 65535},       // new and near
                          {0, 2001, 0, 0},           // new and far
                          {0, kFree, 0, 0}};         // new free space
    Rng rng(134);
    for (const Case& c : cases)
        for (const bool weighted : {false, true}) {
            Voxels v{};
            std::fill_n(v.distances, kVoxels, kUnseen);
            std::fill_n(v.weights, kVoxels, kWeightOne);
            const auto i = static_cast<std::size_t>(rng.below(kVoxels));
            v.distances[i] = static_cast<std::int16_t>(c.distance);
            v.sdf[i] = static_cast<std::int16_t>(c.before);
            v.sums[i] = static_cast<std::uint16_t>(c.sum);
            std::uint16_t moved = 7;
            fuse_distances(v.distances, weighted ? v.weights : nullptr, 6400, v.sdf, v.sums, 2000, &moved);
            EXPECT_EQ(moved, c.moved) << c.before << " to " << c.distance << " at " << i;
        }
}

BURIN_EVERY_TARGET(Tsdf);

}  // namespace
}  // namespace burin
