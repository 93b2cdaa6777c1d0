// SPDX-License-Identifier: MIT
// Trajectories, calibrations and lists as text.
#include <gtest/gtest.h>

#include <cmath>

#include "dataset_files.h"
#include "datasets/camera_file.h"
#include "datasets/file.h"
#include "datasets/icl_nuim.h"
#include "datasets/trajectory_file.h"
#include "datasets/tum_layout.h"

namespace burin {
namespace {

double rotation_angle(const Se3& a, const Se3& b) {
    const Mat3d R = a.R.transposed() * b.R;
    // From the antisymmetric part: acos of the trace has no digits left at small angles.
    const double s = norm(Vec3d{R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1)}) / 2;
    return std::atan2(s, (R(0, 0) + R(1, 1) + R(2, 2) - 1) / 2);
}

Se3 pose(double x, double angle) {  // at x, turned about z
    return *se3_from_quaternion({x, 0, 0}, {0, 0, std::sin(angle / 2), std::cos(angle / 2)});
}

TEST(Text, SecondsAreExact) {
    std::int64_t t = 0;
    ASSERT_TRUE(parse_seconds("1341836537.655691", &t));
    EXPECT_EQ(t, 1341836537655691000);
    ASSERT_TRUE(parse_seconds("-0.25", &t));
    EXPECT_EQ(t, -250000000);
    ASSERT_TRUE(parse_seconds("7", &t));
    EXPECT_EQ(t, 7000000000);
    ASSERT_TRUE(parse_seconds("1.5e+01", &t));
    EXPECT_EQ(t, 15000000000);
    for (const char* bad : {"", ".", "-", "1.2.3", "x", "nan", "inf", "1e300", "99999999999", "1 2"})
        EXPECT_FALSE(parse_seconds(bad, &t)) << bad;
    EXPECT_EQ(format_seconds(1341836537655691000), "1341836537.655691000");
    EXPECT_EQ(format_seconds(-250000000), "-0.250000000");
}

TEST(Text, NamesSortByNumber) {
    const TempFolder folder;
    for (const char* name : {"10.png", "2.png", "1.png", "b", "a"}) folder.text(name, "");
    EXPECT_EQ(list_folder(folder.path()), (std::vector<std::string>{"a", "b", "1.png", "2.png", "10.png"}));
}

TEST(Trajectory, TumReadsWhatItWrites) {
    const TempFolder folder;
    Trajectory written;
    for (int i = 0; i < 20; ++i)
        written.push_back({1341836537000000001 + i * 33333333ll, pose(0.1 * i, 0.3 * i)});
    const std::string path = folder.path("trajectory.txt");
    ASSERT_TRUE(write_tum_trajectory(path, written).ok());
    const Result<Trajectory> read = read_tum_trajectory(path);
    ASSERT_TRUE(read.ok()) << read.status().text();
    ASSERT_EQ(read->size(), written.size());
    for (std::size_t i = 0; i < read->size(); ++i) {
        EXPECT_EQ((*read)[i].t_ns, written[i].t_ns);
        EXPECT_LT(norm((*read)[i].T_world_camera.t - written[i].T_world_camera.t), 1e-9);
        EXPECT_LT(rotation_angle((*read)[i].T_world_camera, written[i].T_world_camera), 1e-8);
    }
}

TEST(Trajectory, ErrorsNameLineValueAndExpectation) {
    struct Case {
        const char *text, *line, *value, *expected;
    };
    for (const Case& c : {Case{"1 0 0 0 0 0 0 1\n\n# c\n2 0 0 0 0 0 1\n", "f:4", "7 values", "8 numbers"},
                          Case{"1 0 0 0 0 0 0 1 9\n", "f:1", "9 values", "8 numbers"},
                          Case{"1 0 x 0 0 0 0 1\n", "f:1", "'x'", "8 numbers"},
                          Case{"1 0 nan 0 0 0 0 1\n", "f:1", "'nan'", "finite"},
                          Case{"1 0 0 -inf 0 0 0 1\n", "f:1", "'-inf'", "finite"},
                          Case{"1 0 0 0 0 0 0 0\n", "f:1", "norm is 0", "1"},
                          Case{"1 0 0 0 0 0 0 1.2\n", "f:1", "norm is 1.2", "1"},
                          Case{"1 2e7 0 0 0 0 0 1\n", "f:1", "2e+07", "at most"},
                          Case{"2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", "f:2", "1.000000000", "rising"},
                          Case{"2 0 0 0 0 0 0 1\n2.0 0 0 0 0 0 0 1\n", "f:2", "2.000000000", "rising"},
                          Case{"1e99 0 0 0 0 0 0 1\n", "f:1", "'1e99'", "seconds"},
                          Case{"# nothing\n", "f", "0 poses", "lines"}}) {
        const Result<Trajectory> read = parse_tum_trajectory(c.text, "f");
        ASSERT_FALSE(read.ok()) << c.text;
        const std::string text = read.status().text();
        EXPECT_EQ(text.find(c.line), 0u) << text;
        EXPECT_NE(text.find(c.value), std::string::npos) << text;
        EXPECT_NE(text.find(c.expected), std::string::npos) << text;
    }
}

TEST(Trajectory, MatrixLinesAndLostPoses) {
    const auto read = parse_matrix_lines(
        "0 -1 0 1 1 0 0 2 0 0 1 3 0 0 0 1\n-inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf 0 0 0 "
        "1\n",
        "f");
    ASSERT_TRUE(read.ok()) << read.status().text();
    ASSERT_EQ(read->size(), 2u);
    EXPECT_TRUE((*read)[0].known);
    EXPECT_EQ((*read)[0].T_world_camera.t, (Vec3d{1, 2, 3}));
    const Vec3d x = (*read)[0].T_world_camera.R * Vec3d{1, 0, 0};
    EXPECT_NEAR(x.y, 1, 1e-12);
    EXPECT_FALSE((*read)[1].known);
    EXPECT_FALSE(parse_matrix_lines("1 0 0 0 0 1 0 0 0 0 nan 0 0 0 0 1\n", "f").ok());
    EXPECT_FALSE(parse_matrix_lines("1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1\n", "f").ok());  // a reflection
    EXPECT_FALSE(parse_matrix_lines("1 .2 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n", "f").ok());  // a shear
    EXPECT_FALSE(parse_matrix_lines("1 0 0 0 0 1 0 0 0 0 1 0 0 0 1\n", "f").ok());     // 15 numbers
    EXPECT_FALSE(parse_pose_file("1 0 0 0\n0 1 0 0\n0 0 1 0\n", "f").ok());            // 12 numbers
    EXPECT_FALSE(parse_pose_file("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n5", "f").ok());  // 17
    EXPECT_TRUE(parse_pose_file("1 0 0 0 0 1\n 0 0\n0 0 1 0\n0 0 0 1\n", "f").ok());
}

TEST(Trajectory, Log) {
    const std::string good =
        "0\t0\t1\n1 0 0 2\n0 1 0 2\n0 0 1 -0.3\n0 0 0 1\n4 4 5\n1 0 0 3\n0 1 0 2\n0 0 1 3.1e-005\n0 0 0 1\n";
    const auto read = parse_log_trajectory(good, "f");
    ASSERT_TRUE(read.ok()) << read.status().text();
    ASSERT_EQ(read->size(), 2u);
    EXPECT_EQ((*read)[1].ids[0], 4);
    EXPECT_EQ((*read)[1].T_world_camera.t, (Vec3d{3, 2, 3.1e-5}));
    for (const char* bad :
         {"0 0 1\n1 0 0 2\n0 1 0 2\n0 0 1 0\n", "0 0\n", "0 0 1.5\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
          "-1 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", "0 0 1\n1 0 0 0\n0 1 0 0\n0 0 2 0\n0 0 0 1\n", ""})
        EXPECT_FALSE(parse_log_trajectory(bad, "f").ok()) << bad;
}

TEST(Trajectory, Interpolation) {
    const Se3 a = pose(0, 0), b = pose(1, 1.2);
    const Se3 third = interpolate(a, b, 1.0 / 3);
    EXPECT_NEAR(third.t.x, 1.0 / 3, 1e-12);
    EXPECT_NEAR(rotation_angle(a, third), 0.4, 1e-12);
    EXPECT_NEAR(rotation_angle(third, b), 0.8, 1e-12);
    // Across the sign change of the quaternion the arc stays the short one.
    const Se3 c = pose(0, 3.0), d = pose(0, 3.4);
    EXPECT_NEAR(rotation_angle(c, interpolate(c, d, 0.5)), 0.2, 1e-12);
    // Nearly equal rotations, where sin(angle) is 0.
    EXPECT_NEAR(rotation_angle(a, interpolate(a, pose(0, 1e-6), 0.5)), 5e-7, 1e-12);
}

TEST(Trajectory, PoseAtTime) {
    const std::int64_t ms = 1'000'000;
    const Trajectory t{{0, pose(0, 0)}, {100 * ms, pose(1, 0)}, {300 * ms, pose(2, 0)}};
    EXPECT_NEAR(pose_at(t, 25 * ms).T_world_camera.t.x, 0.25, 1e-12);
    EXPECT_TRUE(pose_at(t, 100 * ms).known);
    EXPECT_FALSE(pose_at(t, 200 * ms).known);     // a gap of 200 ms
    EXPECT_TRUE(pose_at(t, 299 * ms + 1).known);  // within 1 ms of a pose
    EXPECT_FALSE(pose_at(t, -2 * ms).known);
    EXPECT_TRUE(pose_at(t, -ms).known);
    EXPECT_FALSE(pose_at(t, 302 * ms).known);
    EXPECT_FALSE(pose_at({}, 0).known);
}

TEST(Cameras, TextWithAllKeys) {
    const auto read = parse_camera_text(
        "# a comment\nfx 500\nfy 501\ncx 320\ncy 240\nwidth 640\nheight 480\ndepth_scale 1000\nk1 0.1\n"
        "colour_fx 900\ncolour_width 1280\ncolour_height 720\ncolour_k1 0\nT_colour_depth 0.025 0 0 0 0 0 "
        "1\nT_camera_imu 0 0 0.5 0 0 1 0\n",
        "f");
    ASSERT_TRUE(read.ok()) << read.status().text();
    EXPECT_EQ(read->depth.width, 640);
    EXPECT_EQ(read->depth.k1, 0.1);
    EXPECT_EQ(read->depth_scale, 1000);
    EXPECT_EQ(read->colour.fx, 900);
    EXPECT_EQ(read->colour.fy, 501);
    EXPECT_EQ(read->colour.k1, 0);
    EXPECT_EQ(read->colour.height, 720);
    EXPECT_EQ(read->T_colour_depth.t.x, 0.025);
    EXPECT_EQ(read->T_camera_imu.t.z, 0.5);
    EXPECT_EQ(read->T_camera_imu.R(0, 0), -1);
    EXPECT_EQ(read->T_camera_imu.t.x, 0);
}

TEST(Cameras, TextErrors) {
    const std::string least = "fx 500\nfy 500\ncx 320\ncy 240\n";
    ASSERT_TRUE(parse_camera_text(least, "f").ok());
    struct Case {
        std::string text;
        const char* part;
    };
    for (const Case& c :
         {Case{"fx -500\nfy 500\ncx 320\ncy 240\n", "f:1: fx is -500"},
          Case{"fx 500\nfy 500\ncx 320\n", "no cy"},
          Case{"fx 500\nfy -500\ncx 320\ncy 240\n", "f:2: fy is -500"},
          Case{least + "fx 500\n", "f:5: a second fx"}, Case{least + "foo 1\n", "'foo'"},
          Case{least + "width 640.5\n", "640.5"}, Case{least + "width 99999\n", "99999"},
          Case{least + "depth_scale 0\n", "depth_scale is 0"}, Case{least + "k1 nan\n", "k1 is nan"},
          Case{least + "T_colour_depth 0 0 0\n", "3 values"},
          Case{least + "T_colour_depth 0 0 0 0 0 0 3\n", "norm is 3"}, Case{"\x01\x02 garbage here\n", "??"},
          Case{"525.0 525.0 319.5 239.5\n", "expected 'key value'"}}) {
        const auto read = parse_camera_text(c.text, "f");
        ASSERT_FALSE(read.ok()) << c.text;
        EXPECT_NE(std::string(read.status().text()).find(c.part), std::string::npos) << read.status().text();
    }
}

TEST(Cameras, MatrixAndJson) {
    const auto sun3d = parse_intrinsic_matrix("570.3 0 320\n0 571.3 240\n0 0 1\n", "f");
    ASSERT_TRUE(sun3d.ok()) << sun3d.status().text();
    EXPECT_EQ(sun3d->depth.fy, 571.3);
    EXPECT_EQ(sun3d->depth.cx, 320);
    EXPECT_FALSE(parse_intrinsic_matrix("570 1 320\n0 570 240\n0 0 1\n", "f").ok());
    EXPECT_FALSE(parse_intrinsic_matrix("570 0 320\n0 570 240\n", "f").ok());

    const auto replica = parse_cam_params_json(
        R"({"camera":{"w":1200,"h":680,"fx":600,"fy":601,"cx":599.5,"cy":339.5,"scale":6553.5}})", "f");
    ASSERT_TRUE(replica.ok()) << replica.status().text();
    EXPECT_EQ(replica->depth.width, 1200);
    EXPECT_EQ(replica->depth.fy, 601);
    EXPECT_EQ(replica->depth_scale, 6553.5);
    for (const char* bad :
         {"", "[]", "{", "{}", R"({"camera":{}})",
          R"({"camera":{"w":1200,"h":680,"fx":"600","fy":601,"cx":599.5,"cy":339.5,"scale":6553.5}})",
          R"({"camera":{"w":1200,"h":680,"fx":-600,"fy":601,"cx":599.5,"cy":339.5,"scale":6553.5}})",
          R"({"camera":{"w":1e99,"h":680,"fx":600,"fy":601,"cx":599.5,"cy":339.5,"scale":6553.5}})",
          R"({"camera":{"w":1200,"h":680,"fx":600,"fy":601,"cx":599.5,"cy":339.5,"scale":0}})"})
        EXPECT_FALSE(parse_cam_params_json(bad, "f").ok()) << bad;

    const auto open3d = parse_open3d_intrinsic_json(
        R"({"width":640,"height":480,"intrinsic_matrix":[525,0,0,0,526,0,319.5,239.5,1]})", "f");
    ASSERT_TRUE(open3d.ok()) << open3d.status().text();
    EXPECT_EQ(open3d->depth.fy, 526);
    EXPECT_EQ(open3d->depth.cx, 319.5);
    EXPECT_EQ(open3d->depth_scale, 0);
    // Row-major by mistake: cx where a 0 belongs.
    EXPECT_FALSE(parse_open3d_intrinsic_json(
                     R"({"width":640,"height":480,"intrinsic_matrix":[525,0,319.5,0,525,239.5,0,0,1]})", "f")
                     .ok());
}

TEST(Tum, AssociationsInBothOrders) {
    for (const char* text : {"1.0 rgb/a.png 1.1 depth/b.png\n", "1.1 depth/b.png 1.0 rgb/a.png\n"}) {
        const auto pairs = parse_associations(text, "f");
        ASSERT_TRUE(pairs.ok()) << pairs.status().text();
        EXPECT_EQ((*pairs)[0].colour.file, "rgb/a.png");
        EXPECT_EQ((*pairs)[0].depth.file, "depth/b.png");
        EXPECT_EQ((*pairs)[0].depth.t_ns, 1100000000);
    }
    const auto unsaid = parse_associations("1.0 a.png 1.1 b.png\n", "f");
    ASSERT_TRUE(unsaid.ok());
    EXPECT_EQ((*unsaid)[0].depth.file, "b.png");
    EXPECT_FALSE(parse_associations("1 rgb/1.png depth/1.png\n", "f").ok());
    EXPECT_FALSE(parse_associations("2 rgb/2.png 2 depth/2.png\n1 rgb/1.png 1 depth/1.png\n", "f").ok());
}

TEST(Tum, PairsOneToOneClosestFirst) {
    const std::int64_t ms = 1'000'000;
    // Colour 1 is within 20 ms of both depth images; the closer one gets it.
    const std::vector<StampedFile> colour{{0, "c0"}, {100 * ms, "c1"}, {200 * ms, "c2"}};
    const std::vector<StampedFile> depth{
        {15 * ms, "d0"}, {85 * ms, "d1"}, {104 * ms, "d2"}, {221 * ms, "d3"}};
    const auto pairs = pair_by_time(colour, depth);
    ASSERT_EQ(pairs.size(), 2u);
    EXPECT_EQ(pairs[0].colour.file + pairs[0].depth.file, "c0d0");
    EXPECT_EQ(pairs[1].colour.file + pairs[1].depth.file, "c1d2");
}

TEST(IclNuim, FlipIsItsOwnInverseAndKeepsProjection) {
    const Se3 icl = *se3_from_quaternion({0.3, -0.7, 2.0}, {0.1, -0.2, 0.3, std::sqrt(1 - 0.14)});
    const Se3 T = opencv_from_icl(icl);
    EXPECT_NEAR(T.R.determinant(), 1, 1e-12);
    // A world point seen through K with fy = -480 by the ICL pose, and its mirror image with fy = +480 by
    // ours.
    const Vec3d world{0.4, 1.1, 5.0}, mirrored{0.4, -1.1, 5.0};
    const Vec3d a = icl.inverse() * world, b = T.inverse() * mirrored;
    EXPECT_NEAR(481.2 * a.x / a.z, 481.2 * b.x / b.z, 1e-9);
    EXPECT_NEAR(-480 * a.y / a.z, 480 * b.y / b.z, 1e-9);
    const Se3 back = opencv_from_icl(T);
    EXPECT_LT(norm(back.t - icl.t), 1e-15);
    EXPECT_LT(rotation_angle(back, icl), 1e-12);
}

TEST(IclNuim, PovrayCamera) {
    // Looking along +x with y up: the image's right is -z in POV-Ray's left-handed world.
    const auto read = parse_povray_camera(
        "cam_pos = [1, 2, 3]';\ncam_dir = [2, 0, 0]';\ncam_up = [0, 1, 0]';\ncam_right=[1,0,0]';\n", "f");
    ASSERT_TRUE(read.ok()) << read.status().text();
    EXPECT_EQ(read->t, (Vec3d{1, -2, 3}));  // y turned downwards
    const Vec3d forward = *read * Vec3d{0, 0, 1} - read->t, right = *read * Vec3d{1, 0, 0} - read->t;
    EXPECT_NEAR(forward.x, 1, 1e-12);
    EXPECT_NEAR(right.z, -1, 1e-12);
    const Vec3d down = *read * Vec3d{0, 1, 0} - read->t;
    EXPECT_NEAR(down.y, 1, 1e-12);
    EXPECT_FALSE(
        parse_povray_camera("cam_pos = [1, 2, 3]';\ncam_dir = [0, 1, 0]';\ncam_up = [0, 1, 0]';\n", "f")
            .ok());
    EXPECT_FALSE(parse_povray_camera("cam_pos = [1, 2]';\n", "f").ok());
    EXPECT_FALSE(parse_povray_camera("cam_pos = [1, 2, 3]';\n", "f").ok());
}

}  // namespace
}  // namespace burin
