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
        frame.weights = round % 11 == 0 ? weights.data() : nullptr;
        frame.width = width;
        frame.height = height;
        frame.stride = stride;
        frame.unit_m = 0.001f;
        frame.truncation = {0.08f, round % 5 == 1, 0.0019f, -0.0015f, 0.0032f, 0.02f};
        frame.drop = round % 9 == 3 ? Drop::linear : round % 9 == 6 ? Drop::exponential : Drop::none;
        frame.drop_start_m = 0.01f;
        const float to_units = frame.truncation.units_per_m();
        const float sizes_m[] = {0.05f, 0.002f, 0.01f, 0.02f};
        const float voxel = sizes_m[round / 2 % 4] * to_units;
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
        }
        fill_groups();
    }
    void fill_groups() {
        GroupOffsets& o = frame.groups;
        o.centre_u = static_cast<float>(frame.width) / 2 + 1;
        o.centre_v = static_cast<float>(frame.height) / 2 + 1;
        o.most_across = o.most_z = 0;
        float across_u[kGroupVoxels], across_v[kGroupVoxels], z[kGroupVoxels];
        for (int k = 0; k < kGroupVoxels; ++k) {
            put(static_cast<float>(k & 3) - 1.5f, static_cast<float>(k >> 3) - 1.5f,
                static_cast<float>(k >> 2 & 1) - 0.5f, &across_u[k], &across_v[k], &z[k]);
            across_u[k] -= o.centre_u * z[k];
            across_v[k] -= o.centre_v * z[k];
            o.most_across = std::max({o.most_across, across_u[k], across_v[k]});
            o.most_z = std::max(o.most_z, z[k]);
        }
        const auto part = [](float value, float most) {
            return static_cast<std::int16_t>(std::lround(32767.0f * value / most));
        };
        for (int k = 0; k < kGroupVoxels; ++k) {
            o.across_u[k] = part(across_u[k], o.most_across);
            o.across_v[k] = part(across_v[k], o.most_across);
            o.z[k] = part(z[k], o.most_z);
        }
        for (int g = 0; g < kGroups; ++g)
            put(static_cast<float>(4 * (g & 1)) + 1.5f, static_cast<float>(4 * (g >> 1 & 1)) + 1.5f,
                static_cast<float>(2 * (g >> 2)) + 0.5f, &o.middle_u[g], &o.middle_v[g], &o.middle_z[g]);
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
        put(0, 0, 1, &p.voxel_u[2], &p.voxel_v[2], &p.voxel_z[2]);
        p.centre_u = frame.groups.centre_u;
        p.centre_v = frame.groups.centre_v;
        p.most_across = frame.groups.most_across;
        p.most_z = frame.groups.most_z;
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
    const float reach = batch.group_reach[0];
    if (chunk.inside && scene.frame.allows_groups(chunk.along))
        chunk.pixels = reach < kNarrowReach ? Pixels::narrow
                       : reach < kWideReach ? Pixels::wide
                                            : Pixels::exact;
    return chunk;
}

TEST_P(Tsdf, Observe) {
    Rng rng(130);
    int touched = 0, free = 0, inside = 0, narrow = 0, wide = 0;
    for (int round = 0; round < 6000; ++round) {
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
            Pixels::exact,
            round % 3 == 1 ? static_cast<float>(rng.uniform(1, 1.4)) : 1.0f};
        if (round % 50 != 49) chunk = with_hints(scene, chunk);
        inside += chunk.inside;
        narrow += chunk.pixels == Pixels::narrow;
        wide += chunk.pixels == Pixels::wide;
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
    EXPECT_GT(narrow, 50);
    EXPECT_GT(wide, 50);
}

// The affine map against each voxel's own division, on an image whose depth tells the pixel.
TEST_P(Tsdf, GroupsFindThePixelsOfTheirVoxels) {
    Rng rng(135);
    int chunks = 0, moved = 0;
    for (int round = 2; round < 6000; round += 2) {
        Scene scene(rng, round);
        scene.frame.weights = nullptr;
        scene.frame.drop = Drop::none;
        scene.frame.truncation.quadratic = false;
        const int stride = scene.frame.stride;
        for (int y = 1; y <= scene.frame.height; ++y)
            for (int x = 1; x <= scene.frame.width; ++x)
                scene.pixels[static_cast<std::size_t>(y * stride + x)] =
                    static_cast<std::uint16_t>(1500 + std::abs((round % 4 ? x : y) % 64 - 32));
        const float to_units = scene.frame.truncation.units_per_m();
        const float z = to_units * static_cast<float>(rng.uniform(1.45, 1.55));
        const float along = round % 3 ? 1.0f : static_cast<float>(rng.uniform(1, 1.2));
        const ProjectedChunk chunk = with_hints(
            scene, {static_cast<float>(scene.frame.width) * z * static_cast<float>(rng.uniform(0.1, 0.9)),
                    static_cast<float>(scene.frame.height) * z * static_cast<float>(rng.uniform(0.1, 0.9)), z,
                    false, false, Pixels::exact, along});
        const float reach = chunk.pixels == Pixels::narrow ? kNarrowReach : kWideReach;
        if (chunk.pixels == Pixels::exact || reach * reach > 0.4f * scene.f) continue;
        ProjectedChunk exact = chunk;
        exact.pixels = Pixels::exact;
        Voxels got{}, expected{};
        observe_chunk(scene.frame, chunk, got.distances, got.weights);
        scalar::observe_chunk(scene.frame, exact, expected.distances, expected.weights);
        ++chunks;
        const float pixel = 0.001f * to_units * along;  // what the next pixel changes at most
        for (std::size_t i = 0; i < kVoxels; ++i) {
            const int off = std::abs(got.distances[i] - expected.distances[i]);
            if (off <= 4) continue;
            ++moved;
            ASSERT_TRUE(static_cast<float>(off) <= pixel + 5 || expected.distances[i] == kUnseen ||
                        got.distances[i] == kUnseen)
                << round << ": " << got.distances[i] << ", expected " << expected.distances[i];
        }
    }
    EXPECT_GT(chunks, 100);
    // Off by up to reach^2 / f pixels at the corners of groups; 0.4 here at most.
    EXPECT_LT(moved, chunks * static_cast<int>(kVoxels) / 20);
    std::printf("%d of %d voxels take another pixel\n", moved, chunks * static_cast<int>(kVoxels));
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
