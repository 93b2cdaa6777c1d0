// SPDX-License-Identifier: MIT
// Trajectory errors on cases whose answers follow by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "eval/trajectory.h"
#include "test_eval_meshes.h"

using namespace burin;
using burin::testing_meshes::Random;

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr double kPi = 3.14159265358979323846;

Mat3d turn_z(double angle_rad) {
    const double c = std::cos(angle_rad), s = std::sin(angle_rad);
    return {{c, -s, 0, s, c, 0, 0, 0, 1}};
}

Se3 any_pose(Random& random) {
    const Vec3d axis = random.direction();
    const double half = random.between(0.1, 1.5);
    return *se3_from_quaternion(random.point(3), {axis.x * std::sin(half), axis.y * std::sin(half),
                                                  axis.z * std::sin(half), std::cos(half)});
}

// 30 poses a second on a curve that spans all three axes.
Trajectory curve(int count, std::int64_t start_ns = 1'311'868'164'000'000'000) {
    Trajectory out;
    for (int i = 0; i < count; ++i) {
        const double t = i / 30.0;
        out.push_back({start_ns + i * kSecond / 30,
                       {turn_z(0.4 * t), {std::sin(t), 0.7 * std::cos(1.3 * t), 0.2 * t}}});
    }
    return out;
}

Trajectory positions(std::initializer_list<Vec3d> points) {
    Trajectory out;
    for (const Vec3d& p : points) out.push_back({static_cast<std::int64_t>(out.size()) * kSecond, {{}, p}});
    return out;
}

}  // namespace

TEST(ErrorStats, AreThoseOfNumpy) {
    const ErrorStats s = error_stats({3, 1, 4, 2});
    EXPECT_DOUBLE_EQ(s.mean, 2.5);
    EXPECT_DOUBLE_EQ(s.median, 2.5);
    EXPECT_DOUBLE_EQ(s.max, 4);
    EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(7.5));
    EXPECT_DOUBLE_EQ(s.std_dev, std::sqrt(1.25));
    EXPECT_EQ(s.count, 4);
    EXPECT_DOUBLE_EQ(error_stats({5, 1, 3}).median, 3);
    EXPECT_EQ(error_stats({}).count, 0);
}

TEST(Associate, TakesTheClosestPairsFirstAndEachPoseOnce) {
    const auto at = [](std::initializer_list<int> stamps_ms) {
        Trajectory out;
        for (const int t : stamps_ms) out.push_back({t * 1'000'000ll, {}});
        return out;
    };
    // 100 and 109 both lie near 108: the closer one gets it, the other takes 95.
    const auto pairs = associate(at({100, 109, 300, 500}), at({95, 108, 320, 519, 900}));
    ASSERT_TRUE(pairs.ok());
    ASSERT_EQ(pairs->size(), 3u);
    EXPECT_EQ((*pairs)[0].estimate, 0);
    EXPECT_EQ((*pairs)[0].truth, 0);
    EXPECT_EQ((*pairs)[1].estimate, 1);
    EXPECT_EQ((*pairs)[1].truth, 1);
    EXPECT_EQ((*pairs)[2].estimate, 3);  // 320 is 20 ms from 300: not below the gap
    EXPECT_EQ((*pairs)[2].truth, 3);
}

TEST(AbsoluteError, AlignmentRemovesARigidMotionAndNothingElse) {
    Random random(3);
    const Trajectory truth = curve(90);
    for (int i = 0; i < 20; ++i) {
        const Se3 T = any_pose(random);
        Trajectory estimate = truth;
        for (StampedPose& pose : estimate) pose.T_world_camera = T * pose.T_world_camera;
        const auto aligned = absolute_error(estimate, truth, Alignment::se3);
        ASSERT_TRUE(aligned.ok()) << aligned.status().text();
        EXPECT_EQ(aligned->translation_m.count, 90);
        EXPECT_LT(aligned->translation_m.max, 1e-12);
        EXPECT_LT(norm((aligned->T_truth_estimate * T).t), 1e-12);
        const auto raw = absolute_error(estimate, truth, Alignment::none);
        ASSERT_TRUE(raw.ok());
        double sum = 0;
        for (const StampedPose& p : truth) {
            const Vec3d d = T * p.T_world_camera.t - p.T_world_camera.t;
            sum += dot(d, d);
        }
        EXPECT_NEAR(raw->translation_m.rmse, std::sqrt(sum / 90), 1e-12);
        EXPECT_GT(raw->translation_m.rmse, 0.1);
    }
}

TEST(AbsoluteError, ScaleIsFoundOnlyWithSim3) {
    const Trajectory truth = positions({{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}});
    const Trajectory estimate = positions({{2, 0, 5}, {0, 2, 5}, {-2, 0, 5}, {0, -2, 5}});
    const auto se3 = absolute_error(estimate, truth, Alignment::se3);
    ASSERT_TRUE(se3.ok());
    for (const double e : se3->error_m) EXPECT_NEAR(e, 1, 1e-12);
    EXPECT_NEAR(se3->translation_m.rmse, 1, 1e-12);
    EXPECT_NEAR(se3->translation_m.std_dev, 0, 1e-7);
    const auto sim3 = absolute_error(estimate, truth, Alignment::sim3);
    ASSERT_TRUE(sim3.ok());
    EXPECT_NEAR(sim3->scale, 0.5, 1e-12);
    EXPECT_LT(sim3->translation_m.max, 1e-12);
}

TEST(AbsoluteError, KnownResidualsRemain) {
    // Offsets +d, -d along z at opposite corners of a square neither turn nor shift it.
    const double d = 0.03;
    const Trajectory truth = positions({{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}});
    const Trajectory estimate = positions({{1, 0, d}, {0, 1, -d}, {-1, 0, d}, {0, -1, -d}});
    const auto error = absolute_error(estimate, truth, Alignment::se3);
    ASSERT_TRUE(error.ok());
    EXPECT_NEAR(error->translation_m.rmse, d, 1e-12);
    EXPECT_NEAR(error->translation_m.mean, d, 1e-12);
}

TEST(AbsoluteError, AMirrorImageIsNotARotation) {
    Trajectory estimate = curve(90);
    const Trajectory truth = estimate;
    for (StampedPose& pose : estimate) pose.T_world_camera.t.x = -pose.T_world_camera.t.x;
    const auto error = absolute_error(estimate, truth, Alignment::se3);
    ASSERT_TRUE(error.ok());
    EXPECT_NEAR(error->T_truth_estimate.R.determinant(), 1, 1e-12);
    EXPECT_GT(error->translation_m.rmse, 0.05);
}

TEST(AbsoluteError, StraightLinesStillAlign) {
    const Trajectory truth = positions({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
    const Trajectory estimate = positions({{5, 5, 0}, {5, 6, 0}, {5, 7, 0}, {5, 8, 0}});
    const auto error = absolute_error(estimate, truth, Alignment::se3);
    ASSERT_TRUE(error.ok());
    EXPECT_LT(error->translation_m.max, 1e-12);
}

TEST(TrajectoryFaults, DegenerateInputsAreNamed) {
    const auto says = [](const Status& status, const char* part) {
        EXPECT_FALSE(status.ok());
        EXPECT_NE(std::strstr(status.text(), part), nullptr) << status.text() << " should say " << part;
    };
    const Trajectory truth = curve(90);
    says(absolute_error({}, truth, Alignment::se3).status(), "estimated trajectory is empty");
    says(absolute_error(truth, {}, Alignment::se3).status(), "true trajectory is empty");
    says(absolute_error(curve(2), truth, Alignment::none).status(), "2 of 2 estimated poses");
    says(absolute_error(curve(90, 0), truth, Alignment::se3).status(),
         "0 of 90 estimated poses have a true pose within");
    Trajectory still = truth;
    for (StampedPose& pose : still) pose.T_world_camera.t = {4, 5, 6};
    says(absolute_error(still, truth, Alignment::se3).status(),
         "positions of the estimated trajectory are equal");
    says(absolute_error(truth, still, Alignment::sim3).status(),
         "positions of the true trajectory are equal");
    EXPECT_TRUE(absolute_error(still, truth, Alignment::none).ok());
    Trajectory unsorted = truth;
    std::swap(unsorted[4], unsorted[5]);
    says(absolute_error(unsorted, truth, Alignment::se3).status(), "expected ascending stamps");
    says(relative_error(truth, unsorted, {}).status(), "pose 5 of the true trajectory");
    Trajectory infinite = truth;
    infinite[7].T_world_camera.t.x = NAN;
    says(absolute_error(infinite, truth, Alignment::none).status(),
         "pose 7 of the estimated trajectory is not finite");
    says(relative_error(truth, truth, {RelativeDelta::Unit::seconds, 0}).status(), "delta is 0");
    says(relative_error(truth, truth, {RelativeDelta::Unit::frames, 1.5}).status(), "whole number");
    says(relative_error(curve(2), truth, {}).status(), "0 pose pairs");
    says(relative_error(curve(90, 0), truth, {}).status(), "0 pose pairs");
}

TEST(RelativeError, DriftPerSecondIsMeasuredPerSecond) {
    // Straight on at 1 m/s, estimated at 1.1 m/s: 0.1 m a second; the turn is off by 0.05 rad/s.
    Trajectory truth, estimate;
    for (int i = 0; i < 300; ++i) {
        const double t = i / 30.0;
        truth.push_back({i * kSecond / 30, {{}, {0, 0, t}}});
        estimate.push_back({i * kSecond / 30, {{}, {0, 0, 1.1 * t}}});
    }
    auto error = relative_error(estimate, truth, {});
    ASSERT_TRUE(error.ok()) << error.status().text();
    EXPECT_NEAR(error->translation_m.rmse, 0.1, 1e-9);
    EXPECT_NEAR(error->translation_m.std_dev, 0, 1e-7);
    EXPECT_NEAR(error->rotation_rad.max, 0, 1e-12);
    EXPECT_EQ(error->translation_m.count,
              269);  // of 270 pairs the one that ends in the last pose is left out
    for (StampedPose& pose : estimate)
        pose.T_world_camera.R = turn_z(0.05 * static_cast<double>(pose.t_ns) * 1e-9);
    error = relative_error(estimate, truth, {});
    ASSERT_TRUE(error.ok());
    EXPECT_NEAR(error->rotation_rad.rmse, 0.05, 1e-9);
    error = relative_error(estimate, truth, {RelativeDelta::Unit::frames, 1});
    ASSERT_TRUE(error.ok());
    EXPECT_NEAR(error->translation_m.rmse, 0.1 / 30, 1e-9);
    EXPECT_NEAR(error->rotation_rad.mean, 0.05 / 30, 1e-9);
    EXPECT_EQ(error->translation_m.count, 298);
    error = relative_error(estimate, truth, {RelativeDelta::Unit::seconds, 2});
    ASSERT_TRUE(error.ok());
    EXPECT_NEAR(error->translation_m.rmse, 0.2, 1e-9);
}

TEST(RelativeError, AWorldFrameOfItsOwnChangesNothing) {
    Random random(9);
    const Trajectory truth = curve(120);
    Trajectory estimate = truth, moved;
    for (StampedPose& pose : estimate) pose.T_world_camera.t = pose.T_world_camera.t + random.point(0.01);
    moved = estimate;
    const Se3 T = any_pose(random);
    for (StampedPose& pose : moved) pose.T_world_camera = T * pose.T_world_camera;
    const auto a = relative_error(estimate, truth, {}), b = relative_error(moved, truth, {});
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_GT(a->translation_m.rmse, 0.005);
    EXPECT_NEAR(a->translation_m.rmse, b->translation_m.rmse, 1e-12);
    EXPECT_NEAR(a->rotation_rad.rmse, b->rotation_rad.rmse, 1e-9);
}

TEST(RelativeError, HalfATurnIsPi) {
    Trajectory truth, estimate;
    for (int i = 0; i < 5; ++i) {
        truth.push_back({i * kSecond, {{}, {}}});
        estimate.push_back({i * kSecond, {turn_z(kPi * i), {}}});
    }
    const auto error = relative_error(estimate, truth, {});
    ASSERT_TRUE(error.ok());
    EXPECT_NEAR(error->rotation_rad.mean, kPi, 1e-12);
}

TEST(PathLength, SumsTheSteps) {
    EXPECT_DOUBLE_EQ(path_length_m(positions({{0, 0, 0}, {3, 4, 0}, {3, 4, 2}, {3, 4, 2}})), 7);
    EXPECT_EQ(path_length_m({}), 0);
}
