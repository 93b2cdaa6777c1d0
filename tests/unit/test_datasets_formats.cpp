// SPDX-License-Identifier: MIT
// Each layout written small into a folder: recognised, opened, and every fact of a frame where it belongs.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "dataset_files.h"
#include "datasets/file_dataset.h"
#include "datasets/open.h"

namespace burin {
namespace {

const char* const kIdentity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

std::string matrix_at(double x) { return "1 0 0 " + std::to_string(x) + "\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"; }

std::unique_ptr<Dataset> open_as(const std::string& path, const std::string& expected_format) {
    Result<std::unique_ptr<Dataset>> opened = open_dataset(path, "");
    EXPECT_TRUE(opened.ok()) << opened.status().text();
    if (!opened.ok()) return nullptr;
    EXPECT_EQ((*opened)->format(), expected_format);
    return std::move(*opened);
}

Frame load(const Dataset& dataset, int index) {
    Frame frame;
    const Status status = dataset.load(index, &frame);
    EXPECT_TRUE(status.ok()) << status.text();
    return frame;
}

TEST(Formats, ListedOnce) {
    std::vector<std::string> names = dataset_formats();
    for (const char* name : {"tum", "icl_nuim", "7scenes", "replica", "redwood"})
        EXPECT_EQ(std::count(names.begin(), names.end(), name), 1) << name;
}

// rgb.txt and depth.txt, truth at 20 Hz, colour camera of its own size.
TEST(Formats, TumByTimeStamps) {
    const TempFolder folder;
    for (int i = 0; i < 3; ++i) {
        folder.depth("depth/" + std::to_string(i) + ".png", 8, 6, 5000, static_cast<std::uint16_t>(100 + i));
        folder.colour("rgb/" + std::to_string(i) + ".png", 16, 12, static_cast<std::uint8_t>(10 + i));
    }
    folder.text("depth.txt", "# d\n1.00 depth/0.png\n1.10 depth/1.png\n1.20 depth/2.png\n");
    folder.text("rgb.txt", "1.01 rgb/0.png\n1.11 rgb/1.png\n1.25 rgb/2.png\n");
    folder.text("groundtruth.txt", "1.05 0 0 0 0 0 0 1\n1.075 0.5 0 0 0 0 0 1\n1.125 1.5 0 0 0 0 0 1\n");
    folder.text("camera.txt",
                "fx 5\nfy 5\ncx 3.5\ncy 2.5\nwidth 8\nheight 6\ndepth_scale 1000\ncolour_fx 10\ncolour_fy "
                "10\ncolour_cx 7.5\n"
                "colour_cy 5.5\ncolour_width 16\ncolour_height 12\nT_colour_depth 0.02 0 0 0 0 0 1\n");
    const auto dataset = open_as(folder.path(), "tum");
    ASSERT_TRUE(dataset);
    ASSERT_EQ(dataset->frame_count(), 2);  // the third colour image is 50 ms away
    EXPECT_NE(dataset->notes().find("1 of 3 depth images left out"), std::string::npos) << dataset->notes();
    EXPECT_NE(dataset->notes().find("1 of 2 frames have no pose"), std::string::npos) << dataset->notes();
    const Frame before = load(*dataset, 0), frame = load(*dataset, 1);
    EXPECT_FALSE(before.has_pose);
    ASSERT_TRUE(frame.has_pose);
    EXPECT_NEAR(frame.T_world_camera.t.x, 1.0, 1e-12);  // 1.10 is half way from 0.5 to 1.5
    EXPECT_EQ(frame.t_ns, 1100000000);
    EXPECT_EQ(frame.colour_t_ns, 1110000000);
    EXPECT_EQ(frame.depth_u16.pixels[0], 101);
    EXPECT_EQ(frame.depth_u16.pixels[1], 5000);
    EXPECT_DOUBLE_EQ(frame.depth_unit_m, 0.001);
    EXPECT_EQ(frame.colour.pixels[0], 11);
    EXPECT_EQ(frame.colour.channels, 3);
    EXPECT_EQ(frame.colour_camera.width, 16);
    EXPECT_EQ(frame.colour_camera.fx, 10);
    EXPECT_EQ(frame.depth_camera.fx, 5);
    EXPECT_EQ(frame.T_colour_depth.t.x, 0.02);
}

TEST(Formats, TumIntrinsicsByFolderName) {
    for (const char* name : {"rgbd_dataset_freiburg1_desk", "fr1_xyz", "somewhere"}) {
        const TempFolder folder;
        const std::string sub = std::string(name) + "/";
        folder.depth(sub + "depth/0.png", 640, 480, 5000, 1);
        folder.text(sub + "depth.txt", "1 depth/0.png\n");
        const auto dataset = open_as(folder.path(name), "tum");
        ASSERT_TRUE(dataset);
        const Frame frame = load(*dataset, 0);
        const bool known = std::string(name) != "somewhere";
        EXPECT_EQ(frame.depth_camera.fx, known ? 517.3 : 525);
        EXPECT_FALSE(frame.depth_camera.distorted());
        EXPECT_EQ(frame.colour_camera.distorted(), known);
        EXPECT_NE(dataset->notes().find(known ? "freiburg1" : "ROS default"), std::string::npos)
            << dataset->notes();
        EXPECT_TRUE(frame.colour.empty());
        EXPECT_FALSE(frame.has_pose);
    }
}

TEST(Formats, SevenScenesWithGapsAndLostPose) {
    const TempFolder folder;
    for (int n : {0, 1, 5}) {
        const std::string stem = "chess/seq-03/frame-00000" + std::to_string(n);
        folder.depth(stem + ".depth.png", 640, 480, 65535, static_cast<std::uint16_t>(1000 + n));
        folder.colour(stem + ".color.png", 640, 480, static_cast<std::uint8_t>(n));
        if (n != 1) folder.text(stem + ".pose.txt", matrix_at(n));
    }
    const auto dataset = open_as(folder.path("chess"), "7scenes");
    ASSERT_TRUE(dataset);
    ASSERT_EQ(dataset->frame_count(), 3);
    const Frame last = load(*dataset, 2);
    EXPECT_EQ(last.depth_u16.pixels[0], 1005);
    EXPECT_EQ(last.colour.pixels[0], 5);
    EXPECT_EQ(last.T_world_camera.t.x, 5);
    EXPECT_EQ(last.t_ns, 5 * 1'000'000'000ll / 30);
    EXPECT_EQ(last.depth_camera.fx, 585);
    EXPECT_EQ(last.depth_camera.cy, 240);
    EXPECT_DOUBLE_EQ(last.depth_unit_m, 0.001);
    EXPECT_FALSE(load(*dataset, 1).has_pose);
    // With a second sequence beside it, it is the user who chooses.
    folder.depth("chess/seq-04/frame-000000.depth.png", 640, 480, 1, 1);
    const auto two = open_dataset(folder.path("chess"), "");
    ASSERT_FALSE(two.ok());
    EXPECT_NE(std::string(two.status().text()).find("2 sequences (seq-03 to seq-04)"), std::string::npos)
        << two.status().text();
    EXPECT_TRUE(open_as(folder.path("chess/seq-03"), "7scenes"));
}

TEST(Formats, Replica) {
    const TempFolder folder;
    for (int n : {0, 2}) {
        folder.depth("room0/results/depth00000" + std::to_string(n) + ".png", 12, 8, 6554,
                     static_cast<std::uint16_t>(n));
        folder.colour("room0/results/frame00000" + std::to_string(n) + ".png", 12, 8,
                      static_cast<std::uint8_t>(n));
    }
    folder.text("room0/traj.txt",
                "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1\n1 0 0 2 0 1 0 0 0 0 1 0 0 "
                "0 0 1\n");
    folder.text(
        "cam_params.json",
        R"({"camera": {"w": 12, "h": 8, "fx": 10, "fy": 11, "cx": 5.5, "cy": 3.5, "scale": 6553.5}})");
    {
        const auto dataset = open_as(folder.path("room0"), "replica");
        ASSERT_TRUE(dataset);
        ASSERT_EQ(dataset->frame_count(), 2);
        const Frame frame = load(*dataset, 1);
        EXPECT_EQ(frame.T_world_camera.t.x, 2);  // the line of its number, not of its place
        EXPECT_EQ(frame.depth_u16.pixels[0], 2);
        EXPECT_EQ(frame.colour.pixels[0], 2);
        EXPECT_EQ(frame.depth_camera.fy, 11);
        EXPECT_DOUBLE_EQ(frame.depth_unit_m, 1 / 6553.5);
    }
    // The file beside the sequence comes before the one above it.
    folder.text("room0/cam_params.json",
                R"({"camera": {"w": 12, "h": 8, "fx": 20, "fy": 20, "cx": 5.5, "cy": 3.5, "scale": 1000}})");
    EXPECT_EQ(load(*open_as(folder.path("room0"), "replica"), 0).depth_camera.fx, 20);
}

TEST(Formats, ReplicaDefaults) {
    const TempFolder folder;
    folder.depth("results/depth000000.png", 1200, 680, 6554, 0);
    const auto dataset = open_as(folder.path(), "replica");
    ASSERT_TRUE(dataset);
    const Frame frame = load(*dataset, 0);
    EXPECT_EQ(frame.depth_camera.fx, 600);
    EXPECT_EQ(frame.depth_camera.cx, 599.5);
    EXPECT_DOUBLE_EQ(frame.depth_unit_m, 1 / 6553.5);
    EXPECT_FALSE(frame.has_pose);
}

TEST(Formats, RedwoodWithOwnCameraAndNamesOfTime) {
    const TempFolder folder;
    // Redwood's names: number and microseconds, which differ between the two cameras. One colour image is
    // missing.
    folder.depth("depth/0000001-000000000000.png", 8, 6, 1000, 1);
    folder.depth("depth/0000002-000000033369.png", 8, 6, 1000, 2);
    folder.depth("depth/0000003-000000066738.png", 8, 6, 1000, 3);
    folder.colour("image/0000001-000000010000.png", 8, 6, 1);
    folder.colour("image/0000003-000000070000.png", 8, 6, 3);
    folder.text(
        "camera_intrinsic.json",
        R"({"width": 8, "height": 6, "intrinsic_matrix": [7, 0, 0, 0, 7.5, 0, 3.5, 2.5, 1], "depth_scale": 2000})");
    folder.text("trajectory.log",
                "0 0 1\n" + matrix_at(0) + "2 2 3\n" + matrix_at(2) + "3 3 4\n" + matrix_at(3));
    const auto dataset = open_as(folder.path(), "redwood");
    ASSERT_TRUE(dataset);
    ASSERT_EQ(dataset->frame_count(), 3);
    EXPECT_TRUE(load(*dataset, 1).colour.empty());
    EXPECT_FALSE(load(*dataset, 1).has_pose);
    const Frame frame = load(*dataset, 2);
    EXPECT_EQ(frame.colour.pixels[0], 3);
    EXPECT_EQ(frame.depth_u16.pixels[0], 3);
    EXPECT_EQ(frame.T_world_camera.t.x, 2);
    EXPECT_EQ(frame.depth_camera.fy, 7.5);
    EXPECT_DOUBLE_EQ(frame.depth_unit_m, 1.0 / 2000);
    // The odometry of the whole scan wins over a fragment's trajectory.
    folder.text("odometry.log", "0 0 1\n" + matrix_at(7));
    EXPECT_EQ(load(*open_as(folder.path(), "redwood"), 0).T_world_camera.t.x, 7);
}

// ICL-NUIM's POV-Ray files of a wall 2 m away: ray lengths grow to the corners, depth does not.
TEST(Formats, IclPovray) {
    const TempFolder folder;
    const Camera camera{640, 480, 481.2, 480, 319.5, 239.5};
    std::string rays;
    rays.reserve(640 * 480 * 10);
    for (int y = 0; y < 480; ++y)
        for (int x = 0; x < 640; ++x)
            rays += std::to_string(2 * norm(unproject(camera, {double(x), double(y)}))) + " ";
    folder.text("scene_00_0000.depth", rays);
    folder.colour("scene_00_0000.png", 640, 480, 9);
    folder.text("scene_00_0000.txt",
                "cam_pos      = [0.5, 1.5, -2]';\ncam_dir      = [0, 0, 1]';\ncam_up       = [0, 1, 0]';\n");
    const auto dataset = open_as(folder.path(), "icl_nuim");
    ASSERT_TRUE(dataset);
    const Frame frame = load(*dataset, 0);
    EXPECT_TRUE(frame.depth_u16.empty());
    EXPECT_EQ(frame.depth_unit_m, 1);
    ASSERT_EQ(frame.depth_f32.width, 640);
    for (const float z : frame.depth_f32.pixels) ASSERT_NEAR(z, 2, 2e-6);
    EXPECT_EQ(frame.colour.pixels[0], 9);
    ASSERT_TRUE(frame.has_pose);
    EXPECT_EQ(frame.T_world_camera.t, (Vec3d{0.5, -1.5, -2}));
}

TEST(Formats, SlambookPoses) {
    const TempFolder folder;
    folder.colour("color/1.png", 640, 480, 4);
    std::string pgm = "P5 640 480 65535\n";
    pgm.append(2 * 640 * 480, '\1');
    folder.text("depth/1.pgm", pgm);
    folder.text("pose.txt", "0.5 0 0 0 0 0 1");
    const auto dataset = open_as(folder.path(), "slambook");
    ASSERT_TRUE(dataset);
    const Frame frame = load(*dataset, 0);
    EXPECT_EQ(frame.depth_u16.pixels[7], 257);
    EXPECT_EQ(frame.T_world_camera.t.x, 0.5);
}

TEST(Formats, OverrideAndTrailingSlash) {
    const TempFolder folder;
    // Both a 7-Scenes sequence and a TUM list.
    folder.depth("frame-000000.depth.png", 640, 480, 1000, 1);
    folder.text("frame-000000.pose.txt", kIdentity);
    folder.text("depth.txt", "1 frame-000000.depth.png\n");
    EXPECT_TRUE(open_as(folder.path() + "//", "tum"));
    const auto forced = open_dataset(folder.path(), "7scenes");
    ASSERT_TRUE(forced.ok()) << forced.status().text();
    EXPECT_STREQ((*forced)->format(), "7scenes");
    EXPECT_TRUE(load(**forced, 0).has_pose);
}

// load() gives back the buffers it is handed.
TEST(Formats, FrameBuffersAreReused) {
    const TempFolder folder;
    for (int i = 0; i < 2; ++i) {
        folder.depth("depth/" + std::to_string(i) + ".png", 640, 480, 5000, static_cast<std::uint16_t>(i));
        folder.colour("rgb/" + std::to_string(i) + ".png", 640, 480, 1);
    }
    folder.text("associations.txt", "1 rgb/0.png 1 depth/0.png\n2 rgb/1.png 2 depth/1.png\n");
    const auto dataset = open_as(folder.path(), "tum");
    ASSERT_TRUE(dataset);
    Frame frame = load(*dataset, 0);
    const auto* depth = frame.depth_u16.pixels.data();
    const auto* colour = frame.colour.pixels.data();
    ASSERT_TRUE(dataset->load(1, &frame).ok());
    EXPECT_EQ(frame.depth_u16.pixels.data(), depth);
    EXPECT_EQ(frame.colour.pixels.data(), colour);
    EXPECT_EQ(frame.depth_u16.pixels[0], 1);
}

}  // namespace
}  // namespace burin
