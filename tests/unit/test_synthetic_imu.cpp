// SPDX-License-Identifier: MIT
// The IMU of rendered sequences: the path between the poses, readings against it, noise, and the files.
#include <gtest/gtest.h>

#include <cmath>

#include "dataset_files.h"
#include "datasets/imu_file.h"
#include "datasets/open.h"
#include "datasets/synthetic/camera_path.h"
#include "datasets/synthetic/synth.h"
#include "datasets/synthetic/synth_imu.h"
#include "track/imu_integral.h"

namespace burin {
namespace {

double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

TEST(SmoothPath, PassesThroughEveryPoseAndIsDifferentiatedExactly) {
    const Trajectory poses = builtin_path("room", 3, 60);
    const auto path = SmoothPath::through(poses);
    ASSERT_TRUE(path.ok()) << path.status().text();
    for (const StampedPose& pose : poses) {
        const Se3 T = path->at(pose.t_ns).T_world_camera;
        EXPECT_LT(norm(T.t - pose.T_world_camera.t), 1e-12);
        EXPECT_LT(norm(rotation_vector(T.R.transposed() * pose.T_world_camera.R)), 1e-12);
    }
    // Central differences of 2 h: off by h^2 / 6 of the third derivative, by rounding / h.
    constexpr std::int64_t h_ns = 100'000;
    const double h = seconds(h_ns);
    for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
        // Inside of a piece: from one to the next the third derivative jumps.
        const std::int64_t t = poses[i].t_ns + 1'000'000 + static_cast<std::int64_t>(i) * 500'000;
        const SmoothPath::State a = path->at(t - h_ns), s = path->at(t), b = path->at(t + h_ns);
        const Vec3d v = (b.T_world_camera.t - a.T_world_camera.t) * (0.5 / h);
        EXPECT_LT(norm(v - s.velocity_m_s), 1e-7);
        EXPECT_LT(norm((b.velocity_m_s - a.velocity_m_s) * (0.5 / h) - s.acceleration_m_s2), 1e-5);
        const Vec3d turn = rotation_vector(a.T_world_camera.R.transposed() * b.T_world_camera.R) * (0.5 / h);
        EXPECT_LT(norm(turn - s.turn_rad_s), 1e-6);
        EXPECT_LT(norm((b.turn_rad_s - a.turn_rad_s) * (0.5 / h) - s.turn_rad_s2), 1e-4);
    }
}

TEST(SmoothPath, FewPosesAndBadOnes) {
    const Se3 T{rotation_from_vector({0.1, 0.2, 0.3}), {1, 2, 3}};
    const auto one = SmoothPath::through({{5, T}});
    ASSERT_TRUE(one.ok());
    EXPECT_EQ(one->at(1'000'000'000).T_world_camera.t, T.t);
    EXPECT_EQ(norm(one->at(0).turn_rad_s), 0);
    const auto two = SmoothPath::through({{0, {}}, {1'000'000'000, Se3{{}, {1, 0, 0}}}});
    ASSERT_TRUE(two.ok());
    EXPECT_NEAR(two->at(250'000'000).T_world_camera.t.x, 0.25, 1e-12);
    EXPECT_NEAR(two->at(2'000'000'000).T_world_camera.t.x, 2, 1e-12);  // straight on
    EXPECT_FALSE(SmoothPath::through({}).ok());
    EXPECT_FALSE(SmoothPath::through({{5, T}, {5, T}}).ok());
    const auto flip = SmoothPath::through({{0, {}}, {1, Se3{rotation_from_vector({2.5, 0, 0}), {}}}});
    ASSERT_FALSE(flip.ok());
    EXPECT_NE(std::string(flip.status().text()).find("2.50 radians"), std::string::npos);
}

// Without noise, the gyroscope summed up from frame to frame is the rotation between the frames, and the
// accelerometer summed up twice, given the velocity at the start, leads to the next frame's position.
TEST(SynthImu, SumsUpToTheMotionBetweenFrames) {
    for (const char* scene : {"room", "desk", "corridor"}) {
        const Trajectory poses = builtin_path(scene, 1, default_frame_count(scene));
        const auto path = SmoothPath::through(poses);
        const auto imu = synth_imu(poses, 1000, false, 1);
        ASSERT_TRUE(imu.ok() && path.ok());
        const Se3 T_ci = synth_T_camera_imu();
        double worst_turn = 0, worst_position = 0;
        for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
            const std::int64_t t0 = poses[i].t_ns, t1 = poses[i + 1].t_ns;
            const auto before = imu_of_frame(imu->samples, nullptr, t0);
            const auto samples = imu_of_frame(imu->samples, &t0, t1);
            ImuIntegral integral;
            integral.add_until(t0, before.data(), static_cast<int>(before.size()));
            integral.begin(t0, {});
            integral.add_until(t1, samples.data(), static_cast<int>(samples.size()));
            ASSERT_TRUE(integral.covers(t0, t1)) << i;
            const Se3 T0 = poses[i].T_world_camera * T_ci, T1 = poses[i + 1].T_world_camera * T_ci;
            const Mat3d off = rotation_of(integral.turn()).transposed() * (T0.R.transposed() * T1.R);
            worst_turn = std::max(worst_turn, norm(rotation_vector(off)));
            // p1 = p0 + v0 T + integral of (T - t) (R f - g up).
            const double T = seconds(t1 - t0);
            const SmoothPath::State s = path->at(t0);
            const Vec3d v0 = s.velocity_m_s + s.T_world_camera.R * cross(s.turn_rad_s, T_ci.t);
            const Vec3d pushed = T0.R * (integral.force() * T - integral.force_moment());
            const Vec3d p1 = T0.t + v0 * T + pushed - Vec3d{0, 0, kGravity_m_s2} * (0.5 * T * T);
            worst_position = std::max(worst_position, norm(p1 - T1.t));
        }
        EXPECT_LT(worst_turn, 1e-6) << scene;
        EXPECT_LT(worst_position, 1e-6) << scene;
    }
}

TEST(SynthImu, AtRestItReadsGravityUpwards) {
    const Se3 T = look_at({0, 0, 1}, {1, 0, 1});
    const auto imu = synth_imu({{0, T}, {1'000'000'000, T}}, 100, false, 1);
    ASSERT_TRUE(imu.ok());
    ASSERT_EQ(imu->samples.size(), 101u);
    for (const ImuSample& s : imu->samples) {
        const Vec3d world = T.R * (synth_T_camera_imu().R * s.accel_m_s2);
        EXPECT_LT(norm(world - Vec3d{0, 0, 9.81}), 1e-12);
        EXPECT_LT(norm(s.gyro_rad_s), 1e-12);
    }
    EXPECT_FALSE(synth_imu({{0, T}}, 9, false, 1).ok());
    EXPECT_FALSE(synth_imu({{0, T}}, 8001, false, 1).ok());
    constexpr std::int64_t kEver = 9'000'000'000'000'000'000;
    EXPECT_FALSE(synth_imu({{-kEver, T}, {kEver, T}}, 100, false, 1).ok()) << "570 years";
}

// White noise and walk have the densities that are stated, and depend on the seed alone.
TEST(SynthImu, NoiseHasItsDensities) {
    const Se3 T = look_at({0, 0, 1}, {1, 0, 1});
    const Trajectory poses{{0, T}, {400'000'000'000, T}};
    constexpr int kRate = 200;
    const auto exact = synth_imu(poses, kRate, false, 7), noisy = synth_imu(poses, kRate, true, 7);
    const auto again = synth_imu(poses, kRate, true, 7), other = synth_imu(poses, kRate, true, 8);
    ASSERT_TRUE(exact.ok() && noisy.ok() && again.ok() && other.ok());
    EXPECT_EQ(format_imu(noisy->samples), format_imu(again->samples));
    EXPECT_NE(format_imu(noisy->samples), format_imu(other->samples));
    const std::size_t n = noisy->samples.size();
    double gyro = 0, accel = 0, gyro_walk = 0, accel_walk = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const ImuSample &s = noisy->samples[i], &b = noisy->biases[i], &e = exact->samples[i];
        const Vec3d g = s.gyro_rad_s - b.gyro_rad_s - e.gyro_rad_s;
        const Vec3d a = s.accel_m_s2 - b.accel_m_s2 - e.accel_m_s2;
        gyro += dot(g, g) / 3, accel += dot(a, a) / 3;
        if (i == 0) continue;
        const Vec3d dg = b.gyro_rad_s - noisy->biases[i - 1].gyro_rad_s;
        const Vec3d da = b.accel_m_s2 - noisy->biases[i - 1].accel_m_s2;
        gyro_walk += dot(dg, dg) / 3, accel_walk += dot(da, da) / 3;
    }
    const ImuNoise f;
    const double count = static_cast<double>(n);
    EXPECT_NEAR(std::sqrt(gyro / count / kRate) / f.gyro_rad_s_sqrt_hz, 1, 0.01);
    EXPECT_NEAR(std::sqrt(accel / count / kRate) / f.accel_m_s2_sqrt_hz, 1, 0.01);
    EXPECT_NEAR(std::sqrt(gyro_walk / count * kRate) / f.gyro_walk_rad_s2_sqrt_hz, 1, 0.01);
    EXPECT_NEAR(std::sqrt(accel_walk / count * kRate) / f.accel_walk_m_s3_sqrt_hz, 1, 0.01);
    EXPECT_GT(norm(noisy->biases[0].gyro_rad_s), 1e-3);
    EXPECT_GT(norm(noisy->biases[0].accel_m_s2), 1e-2);
}

// What is written is what the set in memory delivers, to the digits of the files; also through the prefetch
// of frames in any order.
TEST(SynthImu, FilesAndMemoryAgree) {
    const TempFolder folder;
    SynthOptions options;
    options.scene = "desk";
    options.frames = 5;
    options.width = 64, options.height = 48;
    options.truth_images = false;
    options.imu_rate_hz = 200;
    options.output_dir = folder.path("seq");
    Jobs jobs(1);
    const Status status = synthesise(options, {}, jobs);
    ASSERT_TRUE(status.ok()) << status.text();
    const auto files = open_dataset(options.output_dir, "");
    ASSERT_TRUE(files.ok()) << files.status().text();
    const auto memory = SyntheticDataset::create(options);
    ASSERT_TRUE(memory.ok());
    for (int i : {4, 0, 1, 2, 3}) {
        Frame a, b;
        ASSERT_TRUE((*files)->load(i, &a).ok() && (*memory)->load(i, &b).ok());
        ASSERT_EQ(a.imu.size(), b.imu.size());
        ASSERT_GE(a.imu.size(), i == 0 ? 1u : 7u);
        EXPECT_GE(a.imu.back().t_ns, a.t_ns);
        for (std::size_t k = 0; k < a.imu.size(); ++k) {
            EXPECT_EQ(a.imu[k].t_ns, b.imu[k].t_ns);
            EXPECT_LT(norm(a.imu[k].gyro_rad_s - b.imu[k].gyro_rad_s), 1e-9);
            EXPECT_LT(norm(a.imu[k].accel_m_s2 - b.imu[k].accel_m_s2), 1e-9);
        }
        EXPECT_LT(norm(a.T_camera_imu.t - b.T_camera_imu.t), 1e-9);
        EXPECT_LT(norm(rotation_vector(a.T_camera_imu.R.transposed() * b.T_camera_imu.R)), 1e-8);
        EXPECT_GT(norm(a.T_camera_imu.t), 0.01);
    }
    const auto bias = read_imu(options.output_dir + "/truth/imu_bias.txt");
    ASSERT_TRUE(bias.ok()) << bias.status().text();

    // Without the option nothing of it is there.
    options.imu_rate_hz = 0;
    options.output_dir = folder.path("plain");
    ASSERT_TRUE(synthesise(options, {}, jobs).ok());
    EXPECT_FALSE(std::filesystem::exists(options.output_dir + "/imu.txt"));
    EXPECT_EQ(read_bytes(options.output_dir + "/camera.txt").find("imu"), std::string::npos);
    Frame frame;
    frame.imu.resize(3);  // of a frame that was in this memory before
    ASSERT_TRUE((*open_dataset(options.output_dir, ""))->load(0, &frame).ok());
    EXPECT_TRUE(frame.imu.empty());
}

}  // namespace
}  // namespace burin
