// SPDX-License-Identifier: MIT
// Depth and colour in one system, and which poses are believed.
#include "track/verdict.h"

#include <gtest/gtest.h>

#include <cmath>

#include "track/joint.h"

namespace burin {
namespace {

const double kNan = static_cast<double>(NAN);

// 10000 points, all held well.
PoseFit good_fit() {
    PoseFit fit;
    for (int i = 0; i < 6; ++i) fit.measured.system.A[i][i] = 1e8;
    fit.measured.depth_points = fit.measured.considered = 10000;
    fit.measured.known = 9000;
    fit.measured.close = 8500;
    return fit;
}
TrackingState state_of_fit(const PoseFit& fit, const Twist& jump = {}, double gap_s = 0.033) {
    return judge(fit, 2, jump, gap_s).state;
}

TEST(Verdict, SaysWhatToBelieve) {
    const auto with = [](auto&& change) {
        PoseFit fit = good_fit();
        change(fit.measured);
        return state_of_fit(fit);
    };
    const Verdict v = judge(good_fit(), 2, {{0.03, 0, 0.04}, {0, 0.01, 0}}, 0.033);
    EXPECT_EQ(v.state, TrackingState::tracking);
    EXPECT_DOUBLE_EQ(v.close_share, 8500.0 / 9000);
    EXPECT_DOUBLE_EQ(v.known_share, 0.9);
    EXPECT_DOUBLE_EQ(v.jump_m, 0.05);
    EXPECT_DOUBLE_EQ(v.jump_rad, 0.01);
    EXPECT_EQ(v.free_directions, 0);
    EXPECT_DOUBLE_EQ(v.weakest_m, std::sqrt(100 / 1e8 * 4)) << "rotation, as arc at 2 m";
    EXPECT_EQ(v.keyframe_share, 0);

    EXPECT_EQ(state_of_fit({}), TrackingState::lost);
    EXPECT_EQ(with([](Measured& m) { m.close = 4000; }), TrackingState::weak);
    EXPECT_EQ(with([](Measured& m) { m.close = 2000; }), TrackingState::lost);
    EXPECT_EQ(with([](Measured& m) { m.known = 2000, m.close = 1900; }), TrackingState::weak);
    EXPECT_EQ(with([](Measured& m) { m.known = 900, m.close = 890; }), TrackingState::lost);
    EXPECT_EQ(with([](Measured& m) { m.depth_points = 500, m.known = m.close = 499; }), TrackingState::lost);
    EXPECT_EQ(with([](Measured& m) { m.depth_points = m.known = m.close = 500; }), TrackingState::tracking);

    PoseFit free = good_fit();
    free.measured.system.A[0][0] = 1e6;  // 10 mm
    EXPECT_EQ(state_of_fit(free), TrackingState::weak);
    EXPECT_EQ(judge(free, 2, {}, 0).free_directions, 1);
    EXPECT_DOUBLE_EQ(judge(free, 2, {}, 0).weakest_m, 0.01);
    free.measured.system = {};
    EXPECT_EQ(judge(free, 2, {}, 0).free_directions, 6);
    EXPECT_EQ(judge(free, 0, {}, 0).free_directions, 6) << "no depth to measure arcs at";

    // 1 mm by the sum of many small gradients, beside 0.03 mm of the best held motion: noise.
    PoseFit noise = good_fit();
    noise.measured.system.A[0][0] = 1e8;
    noise.measured.system.A[2][2] = 1e11;
    EXPECT_EQ(state_of_fit(noise), TrackingState::weak);
    noise.measured.system.A[2][2] = 5e9;
    EXPECT_EQ(state_of_fit(noise), TrackingState::tracking);

    EXPECT_EQ(state_of_fit(good_fit(), {{0.12, 0, 0}, {}}), TrackingState::tracking);
    EXPECT_EQ(state_of_fit(good_fit(), {{0.15, 0, 0}, {}}), TrackingState::lost);
    EXPECT_EQ(state_of_fit(good_fit(), {{0.15, 0, 0}, {}}, 0.1), TrackingState::tracking) << "more time";
    EXPECT_EQ(state_of_fit(good_fit(), {{}, {0, 0.25, 0}}), TrackingState::lost);
}

TEST(Verdict, WhatIsNoNumberIsNeverBelieved) {
    for (const double bad : {kNan, static_cast<double>(INFINITY)})
        for (int i = 0; i < 6; ++i) {
            Twist jump;
            (i < 3 ? jump.v[i] : jump.w[i - 3]) = bad;
            EXPECT_EQ(state_of_fit(good_fit(), jump), TrackingState::lost) << i << ' ' << bad;
            PoseFit fit = good_fit();
            fit.measured.system.A[i][i] = kNan;
            EXPECT_EQ(state_of_fit(fit), TrackingState::weak) << i;
        }
    for (double Measured::*field : {&Measured::close, &Measured::known, &Measured::depth_points}) {
        PoseFit fit = good_fit();
        fit.measured.*field = kNan;
        EXPECT_EQ(state_of_fit(fit), TrackingState::lost);
    }
    EXPECT_EQ(state_of_fit(good_fit(), {}, kNan), TrackingState::lost);
}

// A measurement that says what it is told.
struct Told final : PoseMeasurement {
    Measured begin_level(const Se3&, int) override { return ++begun, says; }
    Measured measure(const Se3&, int) override { return says; }
    void scale_is(double scale) { scale_ = scale; }
    Measured says;
    int begun = 0;
};

TEST(JointMeasurement, WeighsColourByTheScaleOfDepth) {
    Told depth, colour;
    depth.says.system.A[0][0] = 8;
    depth.says.system.cost = 3;
    depth.says.system.points = 90;
    depth.says.considered = depth.says.depth_points = 100;
    depth.says.known = 95;
    depth.says.close = 80;
    depth.says.median = 0.6;
    colour.says.system.A[0][0] = 100;
    colour.says.system.cost = 10;
    colour.says.system.points = 40;
    colour.says.considered = colour.says.bright = 50;
    colour.says.seen = 40;
    JointMeasurement joint;
    joint.look_at(depth, colour, 2);
    for (const auto& [scale, weight] : {std::pair{0.5, 4.0}, {0.05, 8.0}, {1.5, 1.0}}) {
        depth.scale_is(scale);
        const Measured m = joint.begin_level({}, 1);
        EXPECT_DOUBLE_EQ(m.system.A[0][0], 8 + weight * 100) << scale;
        EXPECT_DOUBLE_EQ(m.system.cost, 3 + weight * 10);
        EXPECT_DOUBLE_EQ(m.system.points, 90 + weight * 40);
        EXPECT_DOUBLE_EQ(m.considered, 100 + weight * 50);
        EXPECT_EQ(m.known, 95);
        EXPECT_EQ(m.close, 80);
        EXPECT_EQ(m.depth_points, 100);
        EXPECT_EQ(m.bright, 50);
        EXPECT_EQ(m.seen, 40);
        EXPECT_EQ(m.median, 0.6);
        EXPECT_EQ(joint.scale(), scale);
        depth.scale_is(0.77);  // stays as the level began
        EXPECT_DOUBLE_EQ(joint.measure({}, 1).system.A[0][0], 8 + weight * 100);
    }
    EXPECT_EQ(depth.begun, 3);
    EXPECT_EQ(colour.begun, 3);
}

}  // namespace
}  // namespace burin
