// SPDX-License-Identifier: MIT
// Predictions on motions that are known, what is learnt on the way, and input that is not as it should be.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "datasets/imu_file.h"
#include "datasets/synthetic/camera_path.h"
#include "datasets/synthetic/portable_math.h"
#include "datasets/synthetic/synth_imu.h"
#include "track/motion_prior.h"

namespace burin {
namespace {

constexpr std::int64_t kFrameNs = 33'333'333;

double off_rad(const Se3& a, const Se3& b) { return norm(rotation_vector(a.R.transposed() * b.R)); }
double off_m(const Se3& a, const Se3& b) { return norm(a.t - b.t); }

// Turns and moves at constant rates.
Se3 steady(std::int64_t t_ns) {
    const double t = static_cast<double>(t_ns) * 1e-9;
    return {rotation_from_vector({0.3, -0.2, 0.5}) * rotation_from_vector(Vec3d{0.4, 0.9, -0.3} * t),
            Vec3d{1, 2, 3} + Vec3d{0.5, -0.3, 0.2} * t};
}

Vec3d gaussian(std::uint64_t seed, std::uint64_t i) {
    using synthetic::hash_bits;
    return {synthetic::normal_pair(hash_bits(seed, i, 0)).a, synthetic::normal_pair(hash_bits(seed, i, 1)).a,
            synthetic::normal_pair(hash_bits(seed, i, 2)).a};
}

// A tracker that is off by some millimetres and milliradians an axis in every frame.
Se3 tracked(const Se3& T, std::uint64_t i, double off = 0.001) {
    return {T.R * rotation_from_vector(gaussian(11, i) * off), T.t + gaussian(12, i) * off};
}

struct Flight {
    Trajectory poses;
    SynthImu imu;
    std::vector<ImuSample> samples(std::size_t i) const {
        return imu_of_frame(imu.samples, i > 0 ? &poses[i - 1].t_ns : nullptr, poses[i].t_ns);
    }
};
Flight flight(const char* scene, int frames, bool noise, int rate = 200) {
    Flight f;
    f.poses = builtin_path(scene, 1, frames);
    auto imu = synth_imu(f.poses, rate, noise, 1);
    EXPECT_TRUE(imu.ok());
    f.imu = std::move(*imu);
    return f;
}

Prediction predict(MotionPrior& prior, const Flight& f, std::size_t i) {
    const auto samples = f.samples(i);
    return prior.predict(f.poses[i].t_ns, samples.data(), static_cast<int>(samples.size()),
                         synth_T_camera_imu());
}

static_assert(sizeof(MotionPrior) <= 3072, "what the header says");

TEST(MotionPrior, ConstantVelocityIsExactOnASteadyMotionAlsoOverGaps) {
    MotionPrior prior;
    EXPECT_EQ(prior.predict(0, nullptr, 0, {}).rotation_sigma_rad, std::numeric_limits<double>::infinity());
    prior.observe(0, steady(0));
    const Prediction second = prior.predict(kFrameNs, nullptr, 0, {});
    EXPECT_EQ(off_m(second.constant_velocity, steady(0)), 0) << "one pose has no velocity";
    EXPECT_LT(second.translation_sigma_m, std::numeric_limits<double>::infinity());
    prior.observe(kFrameNs, steady(kFrameNs));
    double before = 0;
    for (const std::int64_t gap : {kFrameNs / 2, kFrameNs, 3 * kFrameNs, 8 * kFrameNs}) {
        const std::int64_t t = kFrameNs + gap;
        const Prediction p = prior.predict(t, nullptr, 0, {});
        EXPECT_LT(off_m(p.constant_velocity, steady(t)), 1e-9) << gap;
        EXPECT_LT(off_rad(p.constant_velocity, steady(t)), 1e-9) << gap;
        EXPECT_EQ(off_m(p.still, steady(kFrameNs)), 0);
        EXPECT_FALSE(p.has_gyro);
        EXPECT_GT(p.translation_sigma_m, before) << "the longer the gap, the less is known";
        before = p.translation_sigma_m;
    }
    // No velocity lasts for seconds.
    const Prediction late = prior.predict(20 * kFrameNs * 30, nullptr, 0, {});
    EXPECT_LT(off_m(late.constant_velocity, late.still), 0.4);
    EXPECT_GT(late.translation_sigma_m, 5) << "of 20 s";
}

// Without normalising, rounding grows about 2.4 times a frame (../shared/notes/tracking.md, pitfall 1).
TEST(MotionPrior, ChainedPredictionsStayOrthonormal) {
    MotionPrior prior;
    prior.observe(0, steady(0));
    prior.observe(kFrameNs, steady(kFrameNs));
    for (int i = 2; i < 2002; ++i) {
        const Prediction p = prior.predict(i * kFrameNs, nullptr, 0, {});
        prior.observe(i * kFrameNs, p.constant_velocity);
    }
    const Se3 T = prior.predict(2002 * kFrameNs, nullptr, 0, {}).constant_velocity;
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) EXPECT_NEAR(dot(T.R.column(a), T.R.column(b)), a == b ? 1 : 0, 1e-14);
    EXPECT_LT(off_rad(T, steady(2002 * kFrameNs)), 1e-6);
    EXPECT_LT(off_m(T, steady(2002 * kFrameNs)), 1e-6);
}

TEST(MotionPrior, TheGyroscopeTellsTheRotation) {
    const Flight f = flight("room", 100, false);
    MotionPrior prior;
    double with = 0, without = 0;
    for (std::size_t i = 0; i < f.poses.size(); ++i) {
        const Prediction p = predict(prior, f, i);
        ASSERT_EQ(p.has_gyro, i > 0) << i;
        if (i > 2) {
            with = std::max(with, off_rad(p.gyro, f.poses[i].T_world_camera));
            without = std::max(without, off_rad(p.constant_velocity, f.poses[i].T_world_camera));
        }
        prior.observe(f.poses[i].t_ns, f.poses[i].T_world_camera);
    }
    EXPECT_LT(with, 1e-5) << "200 samples a second joined by straight lines";
    EXPECT_GT(without, 100 * with);
}

// With noise, a tracker that is off, and a bias of a degree a second: errors are what the prediction says,
// also where the tracker is worse than it was thought to be.
TEST(MotionPrior, LearnsTheBiasAndSaysHowGoodItIs) {
    const Flight f = flight("room", 300, true);
    for (const double noise : {0.001, 0.003}) {
        MotionPrior prior;
        Vec3d bias;
        double sigma = 0;
        EXPECT_FALSE(prior.gyro_bias(&bias, &sigma));
        double turn = 0, shift = 0, gyro = 0, velocity = 0;
        int n = 0;
        for (std::size_t i = 0; i < f.poses.size(); ++i) {
            const Prediction p = predict(prior, f, i);
            const Se3 T = tracked(f.poses[i].T_world_camera, i, noise);
            if (i >= 60) {
                const double r = off_rad(p.gyro, T), t = off_m(p.gyro, T);
                turn += r * r / 3 / (p.rotation_sigma_rad * p.rotation_sigma_rad);
                shift += t * t / 3 / (p.translation_sigma_m * p.translation_sigma_m);
                gyro += r * r, velocity += std::pow(off_rad(p.constant_velocity, T), 2), ++n;
            }
            prior.observe(f.poses[i].t_ns, T);
        }
        ASSERT_TRUE(prior.gyro_bias(&bias, &sigma));
        const Vec3d truth = f.imu.biases.back().gyro_rad_s;
        EXPECT_GT(norm(truth), 0.01);
        EXPECT_LT(norm(bias - truth), 0.0006) << "0.03 degrees a second";
        EXPECT_LT(norm(bias - truth), 3 * sigma);
        EXPECT_LT(gyro, 0.5 * velocity);
        for (const double ratio : {std::sqrt(turn / n), std::sqrt(shift / n)}) {
            EXPECT_GT(ratio, 0.8) << noise;
            EXPECT_LT(ratio, 1.25) << noise;
        }
    }
}

TEST(MotionPrior, GravityWithinHalfADegree) {
    for (const char* scene : {"room", "desk", "corridor"}) {
        const Flight f = flight(scene, 200, true);
        // A world that is not upright, as that of a tracker which starts at its first frame.
        const Se3 T_world_scene = f.poses[0].T_world_camera.inverse();
        const Vec3d truth = T_world_scene.R * Vec3d{0, 0, 1};
        MotionPrior prior;
        Vec3d up;
        double sigma = 0;
        for (std::size_t i = 0; i < f.poses.size(); ++i) {
            predict(prior, f, i);
            prior.observe(f.poses[i].t_ns, tracked(T_world_scene * f.poses[i].T_world_camera, i));
            EXPECT_TRUE(i >= 20 || !prior.gravity(&up, &sigma)) << "too early";
        }
        ASSERT_TRUE(prior.gravity(&up, &sigma)) << scene;
        EXPECT_NEAR(norm(up), 1, 1e-12);
        const double off = norm(cross(up, truth));
        EXPECT_GT(dot(up, truth), 0);
        EXPECT_LT(off, 0.5 * 3.14159 / 180) << scene;
        EXPECT_LT(off, 3 * sigma) << scene << ": it says how good it is, " << sigma;
    }
}

// An accelerometer in units of g is not taken for one at rest in space.
TEST(MotionPrior, NoGravityFromOtherUnits) {
    Flight f = flight("room", 100, false);
    for (ImuSample& s : f.imu.samples) s.accel_m_s2 = s.accel_m_s2 * (1 / 9.81);
    MotionPrior prior;
    for (std::size_t i = 0; i < f.poses.size(); ++i) {
        predict(prior, f, i);
        prior.observe(f.poses[i].t_ns, f.poses[i].T_world_camera);
    }
    Vec3d up;
    double sigma = 0;
    EXPECT_FALSE(prior.gravity(&up, &sigma));
}

// Frames that were not tracked: the gyroscope bridges them, since their samples are remembered.
TEST(MotionPrior, BridgesFramesThatWereNotTracked) {
    const Flight f = flight("room", 100, false, 1000);
    MotionPrior prior;
    for (std::size_t i = 0; i < f.poses.size(); ++i) {
        const Prediction p = predict(prior, f, i);
        const bool lost = i >= 40 && i < 70;
        if (i == 70) {  // a second later
            EXPECT_TRUE(p.has_gyro);
            EXPECT_LT(off_rad(p.gyro, f.poses[i].T_world_camera), 1e-4);
            EXPECT_GT(p.translation_sigma_m, 0.3);
        }
        if (!lost) prior.observe(f.poses[i].t_ns, f.poses[i].T_world_camera);
    }
    // Found again elsewhere: no velocity over the jump, and gravity is still known.
    Vec3d up;
    double sigma = 0;
    ASSERT_TRUE(prior.gravity(&up, &sigma));
    prior.forget_motion();
    EXPECT_EQ(prior.predict(4'000'000'000, nullptr, 0, {}).translation_sigma_m,
              std::numeric_limits<double>::infinity());
    EXPECT_TRUE(prior.gravity(&up, &sigma));
    prior.clear();
    EXPECT_FALSE(prior.gravity(&up, &sigma));
}

TEST(MotionPrior, BadSamplesArePassedOver) {
    const Flight f = flight("room", 60, false);
    const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
    const Se3 T_ci = synth_T_camera_imu();
    MotionPrior clean, dirty;
    for (std::size_t i = 0; i < f.poses.size(); ++i) {
        auto samples = f.samples(i);
        const Prediction a = clean.predict(f.poses[i].t_ns, samples.data(), int(samples.size()), T_ci);
        // NaN, infinite, twice, and one of long ago, in between.
        const std::size_t middle = samples.size() / 2;
        ImuSample bad = samples[middle];
        bad.gyro_rad_s.y = nan;
        samples.insert(samples.begin() + long(middle), bad);
        bad = samples[middle];
        bad.accel_m_s2.z = inf;
        samples.insert(samples.begin() + long(middle), bad);
        samples.insert(samples.begin() + long(middle), samples[middle + 2]);
        samples.insert(samples.end() - 1, ImuSample{-1'000'000'000, {5, 5, 5}, {1, 2, 3}});
        const Prediction b = dirty.predict(f.poses[i].t_ns, samples.data(), int(samples.size()), T_ci);
        const Prediction twice = dirty.predict(f.poses[i].t_ns, samples.data(), int(samples.size()), T_ci);
        for (int k = 0; k < 9; ++k) {
            EXPECT_EQ(a.gyro.R.m[k], b.gyro.R.m[k]) << i;
            EXPECT_EQ(b.gyro.R.m[k], twice.gyro.R.m[k]) << i;
        }
        clean.observe(f.poses[i].t_ns, f.poses[i].T_world_camera);
        dirty.observe(f.poses[i].t_ns, f.poses[i].T_world_camera);
    }
    Vec3d up[2];
    double sigma[2];
    ASSERT_TRUE(clean.gravity(&up[0], &sigma[0]) && dirty.gravity(&up[1], &sigma[1]));
    EXPECT_EQ(up[0], up[1]);
}

// A hole in the samples: no gyroscope for this frame, and again after it.
TEST(MotionPrior, HolesInTheSamples) {
    Flight f = flight("room", 60, false);
    std::erase_if(f.imu.samples,
                  [](const ImuSample& s) { return s.t_ns > 1'000'000'000 && s.t_ns < 1'040'000'000; });
    MotionPrior prior;
    int without = 0;
    for (std::size_t i = 0; i < f.poses.size(); ++i) {
        const Prediction p = predict(prior, f, i);
        if (i > 0 && !p.has_gyro) ++without;
        EXPECT_TRUE(!p.has_gyro || off_rad(p.gyro, f.poses[i].T_world_camera) < 1e-5) << i;
        prior.observe(f.poses[i].t_ns, f.poses[i].T_world_camera);
    }
    EXPECT_GE(without, 1);
    EXPECT_LE(without, 2);
}

TEST(MotionPrior, StampsAndPosesThatAreNotAsTheyShouldBe) {
    MotionPrior prior;
    prior.observe(0, steady(0));
    prior.observe(kFrameNs, steady(0));
    prior.observe(kFrameNs, steady(kFrameNs));  // the same frame, refined
    Prediction p = prior.predict(2 * kFrameNs, nullptr, 0, {});
    EXPECT_LT(off_m(p.constant_velocity, steady(2 * kFrameNs)), 1e-9);
    // For the stamp of the last pose, and before it: that pose.
    for (const std::int64_t t : {kFrameNs, std::int64_t(0)})
        EXPECT_EQ(off_m(prior.predict(t, nullptr, 0, {}).constant_velocity, steady(kFrameNs)), 0);
    Se3 bad = steady(2 * kFrameNs);
    bad.R(1, 1) = std::nan("");
    prior.observe(2 * kFrameNs, bad);
    p = prior.predict(2 * kFrameNs, nullptr, 0, {});
    EXPECT_LT(off_m(p.constant_velocity, steady(2 * kFrameNs)), 1e-9);
    // Time runs backwards: a new motion.
    prior.observe(-kFrameNs, steady(5));
    p = prior.predict(0, nullptr, 0, {});
    EXPECT_EQ(off_m(p.constant_velocity, steady(5)), 0);
    // The ends of time.
    prior.observe(std::numeric_limits<std::int64_t>::min(), steady(0));
    p = prior.predict(std::numeric_limits<std::int64_t>::max(), nullptr, 0, {});
    EXPECT_TRUE(std::isfinite(p.constant_velocity.t.x));
}

}  // namespace
}  // namespace burin
