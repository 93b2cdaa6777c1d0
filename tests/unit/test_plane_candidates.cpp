// SPDX-License-Identifier: MIT
// Step one of plane finding: what single chunks, made by hand, hold.
#include <gtest/gtest.h>

#include <algorithm>

#include "planes/candidates.h"
#include "scene_helpers.h"

namespace burin {
namespace {

constexpr float kVoxel = 0.005f;
constexpr double kVoxelM = static_cast<double>(kVoxel);
constexpr VolumeShape kShape{64, false, kVoxel, 4 * kVoxel};
const Vec3d kCentre{4 * kVoxelM, 4 * kVoxelM, 4 * kVoxelM};  // of chunk (0, 0, 0)

double degrees_between(Vec3d a, Vec3d b) {
    // By the sine, which is exact for small angles.
    return std::atan2(norm(cross(a, b)), dot(a, b)) * 180 / M_PI;
}

Vec3d random_unit(Rng& rng) { return normalised(Vec3d{rng.normal(), rng.normal(), rng.normal()}); }

// Chunk (0, 0, 0) alone: distance(x) in metres, x from its centre.
template <class Distance>
std::vector<Patch> candidates_of(Distance&& distance) {
    TestVolume t(kShape);
    t.fill({0, 0, 0}, {0, 0, 0}, [&](Vec3d p) { return distance(p - kCentre); });
    Patch patches[kChunkPlanes];
    const int count = find_candidates(t.volume, t.volume.find(pack_key({0, 0, 0})), patches);
    return {patches, patches + count};
}

const Patch* nearest_to(const std::vector<Patch>& patches, Vec3d normal) {
    const Patch* best = nullptr;
    for (const Patch& p : patches)
        if (!best || dot(p.unit_normal(), normal) > dot(best->unit_normal(), normal)) best = &p;
    return best;
}

TEST(PlaneCandidates, APlaneWithoutNoiseIsExact) {
    Rng rng(1);
    for (int i = 0; i < 200; ++i) {
        const Vec3d n = random_unit(rng);
        const double d = rng.uniform(-1.5, 1.5) * kVoxelM, stretch = rng.uniform(0.7, 3);
        const auto found = candidates_of([&](Vec3d x) { return stretch * (dot(n, x) + d); });
        ASSERT_EQ(found.size(), 1u) << i;
        const Patch& p = found[0];
        // Distances are whole multiples of 1/32767 of the truncation: half of that is 6e-5 voxels, spread
        // over voxels 2 from the middle 2e-3 degrees at most.
        EXPECT_LT(degrees_between(p.unit_normal(), n), 5e-3) << i;
        EXPECT_NEAR(static_cast<double>(p.offset), d, 5e-4 * kVoxelM) << i;
        EXPECT_NEAR(static_cast<double>(p.stretch), stretch, 1e-3 * stretch) << i;
        EXPECT_LT(static_cast<double>(p.rms_m), 5e-3 * kVoxelM) << i;
        EXPECT_EQ(p.plane, kNoPlane);
        EXPECT_NE(p.cells, 0u);
    }
}

TEST(PlaneCandidates, ANoisyPlaneIsFoundWithinItsDeviation) {
    Rng rng(2);
    double worst = 0;
    for (int i = 0; i < 300; ++i) {
        const Vec3d n = random_unit(rng);
        const double d = rng.uniform(-1.5, 1.5) * kVoxelM, stretch = rng.uniform(0.9, 2),
                     sigma =
                         rng.uniform(0.05, 0.25) * kVoxelM;  // times stretch below 0.6 voxels: still a plane
        const auto found =
            candidates_of([&](Vec3d x) { return stretch * (dot(n, x) + d + sigma * rng.normal()); });
        ASSERT_EQ(found.size(), 1u) << i;
        const Patch& p = found[0];
        // Least squares on p.n voxels that lie some 2 voxels (8 / sqrt(12), less where the plane leaves the
        // chunk early) from their middle: sigma / (2 sqrt(n)) along each of two axes, a quarter more by
        // Tukey's weights on a scale that is estimated; five deviations, 600 draws.
        const double deviation = sigma / kVoxelM / (2 * std::sqrt(static_cast<double>(p.n)));
        const double off = degrees_between(p.unit_normal(), n);
        worst = std::max(worst, off / (deviation * 180 / M_PI));
        EXPECT_LT(off, 5 * 1.25 * deviation * 180 / M_PI) << i << ", sigma " << sigma / kVoxelM << " voxels";
        // At the middle of what was fitted; 2 voxels beside it the tilt adds as much again.
        EXPECT_NEAR(static_cast<double>(p.offset), d, 5 * 1.25 * 2 * deviation * 2 * kVoxelM) << i;
        EXPECT_NEAR(static_cast<double>(p.rms_m), sigma, 0.25 * sigma) << i;
    }
    std::printf("worst angle: %.2f deviations\n", worst);
}

// The edge or corner is within a voxel of the chunk's middle, where it is hardest: at random tilt no octant
// holds one face alone. What is not found is mostly one plane laid over the edge as a chamfer, within 0.6
// voxels of it. The numbers of 100 are below what is found (49 to 74) by three deviations of such a count, 5.
TEST(PlaneCandidates, EdgesAndCorners) {
    Rng rng(3);
    for (int convex = 0; convex < 2; ++convex)
        for (int faces = 2; faces <= 3; ++faces) {
            int all = 0, right = 0;
            for (int i = 0; i < 100; ++i) {
                const Mat3d R = random_pose(rng, 0).R;
                const Vec3d apex{rng.uniform(-1, 1) * kVoxelM, rng.uniform(-1, 1) * kVoxelM,
                                 rng.uniform(-1, 1) * kVoxelM};
                const auto found = candidates_of([&](Vec3d x) {
                    double distance = dot(R.column(0), x - apex);
                    for (int f = 1; f < faces; ++f) {
                        const double other = dot(R.column(f), x - apex);
                        distance = convex ? std::max(distance, other) : std::min(distance, other);
                    }
                    return distance;
                });
                ++all;
                EXPECT_LE(static_cast<int>(found.size()), faces) << i;
                bool each = static_cast<int>(found.size()) == faces;
                for (int f = 0; f < faces && each; ++f) {
                    const Patch* p = nearest_to(found, R.column(f));
                    each = degrees_between(p->unit_normal(), R.column(f)) < 3 &&
                           std::fabs(static_cast<double>(p->offset) + dot(R.column(f), apex)) < 0.2 * kVoxelM;
                }
                right += each;
            }
            std::printf("%s of %d faces: %d of %d\n", convex ? "convex" : "concave", faces, right, all);
            EXPECT_GE(right, faces == 2 ? 55 : 30) << faces << " faces, convex: " << convex;
        }
}

// A chunk is 40 mm: of a ball of 60 mm it sees a cap of at most 3.3 mm height, which is no rougher than a
// plane of a poor sensor. It gives a patch that says so; that patches of a ball join no plane is for the
// layer.
TEST(PlaneCandidates, ABallGivesAPatchThatTouchesIt) {
    Rng rng(4);
    for (int i = 0; i < 50; ++i) {
        const Vec3d towards = random_unit(rng), centre = towards * -0.06;
        const auto found = candidates_of([&](Vec3d x) { return norm(x - centre) - 0.06; });
        ASSERT_LE(found.size(), 1u) << i;
        for (const Patch& p : found) {
            EXPECT_LT(degrees_between(p.unit_normal(), towards), 3) << i;
            // The mean height of the cap lies below its top, by half its height in the middle of the draw.
            EXPECT_GT(static_cast<double>(p.offset), 0) << i;
            EXPECT_LT(static_cast<double>(p.offset), 0.0033) << i;
            EXPECT_GT(static_cast<double>(p.rms_m), 0.05 * kVoxelM) << i;
        }
    }
}

TEST(PlaneCandidates, NothingInNoise) {
    Rng rng(5);
    for (int i = 0; i < 100; ++i)
        EXPECT_EQ(candidates_of([&](Vec3d) { return rng.uniform(-1, 1) * 4 * kVoxelM; }).size(), 0u) << i;
}

TEST(PlaneCandidates, NothingWhereNothingIs) {
    EXPECT_EQ(candidates_of([](Vec3d) { return 1.0; }).size(), 0u) << "free space";
    EXPECT_EQ(candidates_of([](Vec3d) { return -1.0; }).size(), 0u) << "behind everything";
    EXPECT_EQ(candidates_of([](Vec3d) { return 0.0; }).size(), 0u) << "no gradient";

    TestVolume t(kShape);
    Patch patches[kChunkPlanes];
    const std::uint32_t slot = t.chunk({0, 0, 0});
    EXPECT_EQ(find_candidates(t.volume, slot, patches), 0) << "a chunk as it is inserted";
    t.fill({0, 0, 0}, {0, 0, 0}, [](Vec3d x) { return x.z - kCentre.z; });
    EXPECT_EQ(find_candidates(t.volume, slot, patches), 1);
    for (std::uint16_t& weight : t.volume.geometry(slot).weight) weight = 0;
    EXPECT_EQ(find_candidates(t.volume, slot, patches), 0) << "distances that nobody observed";
}

// Seen aslant, one layer of voxels is left within the truncation; the slope then comes from the next chunk.
TEST(PlaneCandidates, ASingleLayerTakesItsSlopeFromTheChunkBeside) {
    constexpr double kStretch = 4.5;
    for (int axis = 0; axis < 3; ++axis)
        for (const int side : {-1, 1}) {  // the free side, and where the neighbour is
            TestVolume t(kShape);
            // 0.3 voxels above the last layer's centres, in this chunk: -1.35 voxels there, 3.15 in the next
            // chunk, and saturated below.
            const double plane = side * 3.8 * kVoxelM;
            const auto distance = [&](Vec3d p) {
                return kStretch * side * (p[axis] - kCentre[axis] - plane);
            };
            Vec3i low, high;
            (side > 0 ? high : low)[axis] = side;
            t.fill(low, high, distance);
            Patch patches[kChunkPlanes];
            const std::uint32_t slot = t.volume.find(pack_key({0, 0, 0}));
            ASSERT_EQ(find_candidates(t.volume, slot, patches), 1);
            Vec3d n;
            n[axis] = side;
            EXPECT_LT(degrees_between(patches[0].unit_normal(), n), 0.01);
            EXPECT_NEAR(static_cast<double>(patches[0].offset), -3.8 * kVoxelM, 1e-3 * kVoxelM);
            EXPECT_NEAR(static_cast<double>(patches[0].stretch), kStretch, 0.01);
            EXPECT_EQ(patches[0].axis, axis);

            // Without it the truncated layer below tells a slope that is too small: the plane is farther.
            TestVolume alone(kShape);
            alone.fill({0, 0, 0}, {0, 0, 0}, distance);
            const int count = find_candidates(alone.volume, alone.volume.find(pack_key({0, 0, 0})), patches);
            if (count > 0) {
                EXPECT_GT(std::fabs(static_cast<double>(patches[0].offset)), 3.9 * kVoxelM);
                EXPECT_LT(std::fabs(static_cast<double>(patches[0].offset)), 4.1 * kVoxelM);
            }
        }
}

// The sums that a global plane is fitted to: those of foot points on the patch's own plane.
TEST(PlaneCandidates, SumsOfFootPointsGiveThePlaneBack) {
    Rng rng(6);
    for (int i = 0; i < 50; ++i) {
        const Vec3d n = random_unit(rng), at{rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(-3, 3)};
        const double d = rng.uniform(-1, 1) * kVoxelM;
        const auto found = candidates_of([&](Vec3d x) { return dot(n, x) + d; });
        ASSERT_EQ(found.size(), 1u);
        const PlaneFit fit = fit_plane(found[0].scatter(at), n);
        EXPECT_LT(degrees_between(fit.normal, n), 0.02);
        EXPECT_NEAR(dot(n, fit.centroid - at) + d, 0, 1e-3 * kVoxelM);
        EXPECT_GT(fit.variance[1], kVoxelM * kVoxelM) << "spread over the chunk";
        EXPECT_LE(fit.variance[0], fit.variance[1]);
        EXPECT_GE(static_cast<double>(found[0].n), 40);
    }
}

}  // namespace
}  // namespace burin
