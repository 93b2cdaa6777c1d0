// SPDX-License-Identifier: MIT
// The sums of tracking: every target against the specification, and the specification against the formulas.
#include "simd/track.h"

#include "kernel_test.h"

namespace burin {
namespace {

using namespace simd;

class Track : public KernelTest {};

struct Samples {
    // Rounded up to 16, as track.h allows to be read; the others as it demands.
    std::vector<float> x, y, z, inverse_sigma, distance, gradient[3];
    int count;

    Samples(Rng& rng, int n, bool adversarial) : count(n) {
        const auto room = (static_cast<std::size_t>(n) + 15) / 16 * 16;
        const auto value = [&](double low, double high) {
            if (adversarial && rng.below(6) == 0)
                return awkward_floats()[static_cast<std::size_t>(
                    rng.below(static_cast<int>(awkward_floats().size())))];
            return static_cast<float>(rng.uniform(low, high));
        };
        const auto fill = [&](std::vector<float>& v, std::size_t size, double low, double high) {
            v = tight<float>(size, 0);
            for (float& f : v) f = value(low, high);
        };
        fill(x, room, -2, 2);
        fill(y, room, -2, 2);
        fill(z, room, 0.3, 4);
        fill(inverse_sigma, room, 50, 800);
        // Some on either side of the threshold and of the limit, some not there.
        fill(distance, kSampleBatch, -0.06, 0.06);
        for (float& d : distance)
            if (rng.below(5) == 0) d = NAN;
        for (auto& g : gradient) fill(g, kSampleBatch, -1, 1);
    }
    void run(decltype(track_sums)* kernel, const float R[9], const TrackRobust& robust, TrackSums sums,
             float* normalised) const {
        const float* const g[3] = {gradient[0].data(), gradient[1].data(), gradient[2].data()};
        kernel({x.data(), y.data(), z.data(), inverse_sigma.data(), distance.data(), g}, count, R, robust,
               sums, normalised);
    }
};

TrackRobust robust_of(Rng& rng) {
    TrackRobust r;
    r.inverse_scale = static_cast<float>(rng.uniform(0.2, 20));
    r.tukey = rng.below(2) == 0;
    r.threshold = r.tukey ? 4.685f : 1.345f;
    r.limit_m = 0.05f;
    return r;
}

// The same bits; but NaN is NaN: which of two payloads a sum takes is left open by IEEE 754.
testing::AssertionResult same_sums(const TrackSums a, const TrackSums b) {
    for (int term = 0; term < kTrackTerms; ++term)
        for (int lane = 0; lane < kTrackLanes; ++lane) {
            const float p = a[term][lane], q = b[term][lane];
            if (p != p && q != q) continue;
            if (std::memcmp(&p, &q, sizeof p) != 0)
                return testing::AssertionFailure()
                       << "term " << term << " lane " << lane << ": " << p << ", expected " << q;
        }
    return testing::AssertionSuccess();
}

TEST_P(Track, SumsAreTheSpecifications) {
    Rng rng(160);
    long counted = 0, left_out = 0;
    for (int round = 0; round < 3000; ++round) {
        // Every count, several batches into the same sums.
        alignas(64) TrackSums got = {}, expected = {};
        const TrackRobust robust = robust_of(rng);
        const Se3 T = random_pose(rng, 1);
        float R[9];
        for (int i = 0; i < 9; ++i) R[i] = static_cast<float>(T.R.m[i]);
        for (int batch = 0; batch < 2; ++batch) {
            const Samples in(rng, (round + 7 * batch) % (kSampleBatch + 1), round % 2 == 1);
            std::vector<float> one(kSampleBatch, 7), other(kSampleBatch, 7);
            in.run(track_sums, R, robust, got, one.data());
            in.run(scalar::track_sums, R, robust, expected, other.data());
            for (int i = 0; i < in.count; ++i) {
                const float a = one[static_cast<std::size_t>(i)], b = other[static_cast<std::size_t>(i)];
                ASSERT_TRUE((a != a && b != b) || std::memcmp(&a, &b, sizeof a) == 0)
                    << "round " << round << " point " << i << ": " << a << ", expected " << b;
                a >= 0 ? ++counted : ++left_out;
            }
        }
        ASSERT_TRUE(same_sums(got, expected)) << "round " << round;
    }
    EXPECT_GT(counted, 50000);
    EXPECT_GT(left_out, 20000);
}

// What does not count leaves no trace, whatever stands beside it.
TEST_P(Track, PointsWithoutResidualAddNothing) {
    Rng rng(161);
    for (int count = 0; count <= kSampleBatch; ++count) {
        Samples in(rng, count, true);
        for (float& d : in.distance) d = rng.below(2) ? static_cast<float>(NAN) : 0.0501f;
        TrackSums sums = {};
        const TrackSums zero = {};
        std::vector<float> normalised(kSampleBatch, 7);
        const float R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        in.run(track_sums, R, {1.0f, 1.345f, false, 0.05f}, sums, normalised.data());
        ASSERT_TRUE(same_sums(sums, zero)) << count;
        for (int i = 0; i < count; ++i) ASSERT_EQ(normalised[static_cast<std::size_t>(i)], -1);
    }
}

// The gradient of the cost is b: against differences of the cost over small motions of the camera, for a
// plane, whose distance is known everywhere.
TEST_P(Track, BIsTheSlopeOfTheCost) {
    Rng rng(162);
    for (int round = 0; round < 40; ++round) {
        const TrackRobust robust = {4.0f, round % 2 ? 4.685f : 1.345f, round % 2 == 1, 0.5f};
        const Se3 T = random_pose(rng, 1);
        Samples in(rng, kSampleBatch, false);
        const Vec3d n = normalised(Vec3d{rng.normal(), rng.normal(), rng.normal()});
        std::vector<double> offset;  // each point has its own plane, up to 1.6 thresholds away
        for (int i = 0; i < kSampleBatch; ++i) {
            const auto k = static_cast<std::size_t>(i);
            in.inverse_sigma[k] = 100;
            const Vec3d p = T * Vec3d{in.x[k], in.y[k], in.z[k]};
            offset.push_back(dot(n, p) - rng.uniform(-0.005, 0.005));
            for (int axis = 0; axis < 3; ++axis) in.gradient[axis][k] = static_cast<float>(n[axis]);
        }
        const auto sums_at = [&](const Se3& at, TrackSums sums) {
            float R[9];
            for (int i = 0; i < 9; ++i) R[i] = static_cast<float>(at.R.m[i]);
            for (int i = 0; i < kSampleBatch; ++i) {
                const auto k = static_cast<std::size_t>(i);
                in.distance[k] =
                    static_cast<float>(dot(n, at * Vec3d{in.x[k], in.y[k], in.z[k]}) - offset[k]);
            }
            float normalised[kSampleBatch];
            in.run(track_sums, R, robust, sums, normalised);
        };
        const auto total = [](const TrackSums sums, int term) {
            double sum = 0;
            for (int lane = 0; lane < kTrackLanes; ++lane) sum += static_cast<double>(sums[term][lane]);
            return sum;
        };
        TrackSums here = {};
        sums_at(T, here);
        ASSERT_EQ(total(here, kTrackPoints), kSampleBatch);
        for (int axis = 0; axis < 6; ++axis) {
            const double step = 2e-5;
            double cost[2];
            for (int side = 0; side < 2; ++side) {
                Twist xi;
                (axis < 3 ? xi.v[axis] : xi.w[axis - 3]) = side ? step : -step;
                TrackSums there = {};
                sums_at(moved(T, xi), there);
                cost[side] = total(there, kTrackCost);
            }
            // b is in sigmas, the cost in scaled sigmas: one factor of inverse_scale.
            const double slope = (cost[1] - cost[0]) / (2 * step);
            const double expected = total(here, kTrackB + axis) * static_cast<double>(robust.inverse_scale);
            // Rounding of the cost, some 1e-6 of its 64 points' sum, over the step.
            EXPECT_NEAR(slope, expected, 0.02 * std::fabs(expected) + 2.0) << "axis " << axis;
        }
    }
}

BURIN_EVERY_TARGET(Track);

}  // namespace
}  // namespace burin
