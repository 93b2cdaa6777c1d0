// SPDX-License-Identifier: MIT
// Bad input, as a table: a good data set is spoiled in one place, and the error must be one line that names
// the file, the value and what was expected, at opening or at the first load.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <functional>

#include "dataset_files.h"
#include "datasets/open.h"

namespace burin {
namespace {

namespace fs = std::filesystem;

void good_tum(const TempFolder& f) {
    for (int i = 0; i < 2; ++i) {
        f.depth("depth/" + std::to_string(i) + ".png", 8, 6, 5000, 1);
        f.colour("rgb/" + std::to_string(i) + ".png", 8, 6, 1);
    }
    f.text("associations.txt", "1.0 rgb/0.png 1.0 depth/0.png\n2.0 rgb/1.png 2.0 depth/1.png\n");
    f.text("groundtruth.txt", "1.0 0 0 0 0 0 0 1\n2.0 1 0 0 0 0 0 1\n");
    f.text("camera.txt", "fx 5\nfy 5\ncx 3.5\ncy 2.5\nwidth 8\nheight 6\ndepth_scale 5000\n");
    f.text("imu.txt", "# t gx gy gz ax ay az\n0.9 0 0 0 0 0 9.81\n1.1 0 0 0 0 0 9.81\n2.1 0 0 0 0 0 9.81\n");
}

void good_scenes(const TempFolder& f) {
    f.depth("frame-000000.depth.png", 640, 480, 1000, 1);
    f.colour("frame-000000.color.png", 640, 480, 1);
    f.text("frame-000000.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
}

void good_replica(const TempFolder& f) {
    f.depth("results/depth000000.png", 8, 6, 1000, 1);
    f.text("traj.txt", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n");
    f.text("cam_params.json",
           R"({"camera": {"w": 8, "h": 6, "fx": 5, "fy": 5, "cx": 3.5, "cy": 2.5, "scale": 1000}})");
}

void good_redwood(const TempFolder& f) {
    f.depth("depth/0.png", 8, 6, 1000, 1);
    f.colour("color/0.png", 8, 6, 1);
    f.text("odometry.log", "0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    f.text("camera_intrinsic.json",
           R"({"width": 8, "height": 6, "intrinsic_matrix": [5, 0, 0, 0, 5, 0, 3.5, 2.5, 1]})");
}

void cut(const std::string& path) { fs::resize_file(path, fs::file_size(path) / 2); }

void depth8(const TempFolder& f, const std::string& name) {
    const Image<std::uint8_t> image(8, 6, 1, 50);
    ASSERT_TRUE(write_png(f.path(name), image.view()).ok());
}

struct Case {
    const char* what;
    std::function<void(const TempFolder&)> good, spoil;
    const char *file, *value, *expected;  // parts of the message
};

// Opens and loads every frame; the first error.
Status first_error(const std::string& path, const std::string& format) {
    Result<std::unique_ptr<Dataset>> opened = open_dataset(path, format);
    if (!opened) return opened.status();
    Frame frame;
    for (int i = 0; i < (*opened)->frame_count(); ++i) {
        const Status status = (*opened)->load(i, &frame);
        if (!status) {
            EXPECT_TRUE(frame.depth_u16.empty() && frame.depth_f32.empty() && frame.colour.empty())
                << "half a frame";
            return status;
        }
    }
    return {};
}

const Case kCases[] = {
    {"missing depth image", good_tum, [](const TempFolder& f) { fs::remove(f.path("depth/1.png")); },
     "depth/1.png", "not there", "expected an image"},
    {"missing colour image", good_tum, [](const TempFolder& f) { fs::remove(f.path("rgb/0.png")); },
     "rgb/0.png", "not there", "expected an image"},
    {"truncated depth", good_tum, [](const TempFolder& f) { cut(f.path("depth/0.png")); }, "depth/0.png",
     "too early", "expected a whole image"},
    {"truncated colour", good_tum, [](const TempFolder& f) { cut(f.path("rgb/1.png")); }, "rgb/1.png",
     "too early", "expected a whole image"},
    {"empty depth file", good_tum, [](const TempFolder& f) { f.text("depth/0.png", ""); }, "depth/0.png",
     "0 bytes", "expected an image"},
    {"text as image", good_tum, [](const TempFolder& f) { f.text("depth/0.png", "<html>not found</html>"); },
     "depth/0.png", "22 bytes", "expected an image"},
    {"8-bit depth", good_tum, [](const TempFolder& f) { depth8(f, "depth/1.png"); }, "depth/1.png", "8-bit",
     "expected 16-bit grey"},
    {"colour as depth", good_tum, [](const TempFolder& f) { f.colour("depth/1.png", 8, 6, 1); },
     "depth/1.png", "3 channels", "expected 16-bit grey"},
    {"depth of another size", good_tum, [](const TempFolder& f) { f.depth("depth/1.png", 6, 8, 1, 1); },
     "depth/1.png", "6x8", "expected 8x6"},
    {"colour of another size", good_tum, [](const TempFolder& f) { f.colour("rgb/1.png", 16, 12, 1); },
     "rgb/1.png", "16x12", "expected 8x6"},
    {"NaN pose", good_tum, [](const TempFolder& f) { f.text("groundtruth.txt", "1 nan 0 0 0 0 0 1\n"); },
     "groundtruth.txt:1", "'nan'", "expected 8 finite"},
    {"zero quaternion", good_tum, [](const TempFolder& f) { f.text("groundtruth.txt", "1 0 0 0 0 0 0 0\n"); },
     "groundtruth.txt:1", "norm is 0", "expected 1"},
    {"unsorted truth", good_tum,
     [](const TempFolder& f) { f.text("groundtruth.txt", "2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n"); },
     "groundtruth.txt:2", "1.000000000", "expected rising"},
    {"unsorted images", good_tum,
     [](const TempFolder& f) {
         f.text("associations.txt", "2 rgb/1.png 2 depth/1.png\n1 rgb/0.png 1 depth/0.png\n");
     },
     "associations.txt:2", "1.000000000", "expected rising"},
    {"truncated truth line", good_tum,
     [](const TempFolder& f) { f.text("groundtruth.txt", "1 0 0 0 0 0 0 1\n2 0 0\n"); }, "groundtruth.txt:2",
     "3 values", "expected 8"},
    {"empty truth", good_tum, [](const TempFolder& f) { f.text("groundtruth.txt", ""); }, "groundtruth.txt",
     "0 poses", "expected"},
    {"zero frames", good_tum, [](const TempFolder& f) { f.text("associations.txt", "# none\n"); },
     "associations.txt", "0 pairs", "expected"},
    {"short association", good_tum, [](const TempFolder& f) { f.text("associations.txt", "1 rgb/0.png\n"); },
     "associations.txt:1", "2 words", "expected"},
    {"negative focal length", good_tum,
     [](const TempFolder& f) { f.text("camera.txt", "fx -5\nfy 5\ncx 3.5\ncy 2.5\n"); }, "camera.txt:1",
     "fx is -5", "expected a positive"},
    {"infinite focal length", good_tum,
     [](const TempFolder& f) { f.text("camera.txt", "fx inf\nfy 5\ncx 3.5\ncy 2.5\n"); }, "camera.txt:1",
     "inf", "expected"},
    {"focal length absurd for the size", good_tum,
     [](const TempFolder& f) { f.text("camera.txt", "fx 5e6\nfy 5\ncx 3.5\ncy 2.5\n"); }, "", "5e+06",
     "expected"},
    {"garbage camera.txt", good_tum,
     [](const TempFolder& f) { f.text("camera.txt", std::string("\0\x7f\xff\n\x1b[31m", 9)); },
     "camera.txt:1", "'", "expected 'key value'"},
    {"camera.txt of one long line", good_tum,
     [](const TempFolder& f) { f.text("camera.txt", std::string(100000, 'x')); }, "camera.txt:1", "xxx...",
     "expected 'key value'"},
    {"a folder in place of a depth image", good_tum,
     [](const TempFolder& f) {
         fs::remove(f.path("depth/0.png"));
         fs::create_directory(f.path("depth/0.png"));
     },
     "depth/0.png", "not there", "expected an image"},
    {"NaN in the IMU's samples", good_tum,
     [](const TempFolder& f) { f.text("imu.txt", "# t\n1 0 0 nan 0 0 9.81\n"); }, "imu.txt:2", "'nan'",
     "expected an angular velocity"},
    {"infinite specific force", good_tum, [](const TempFolder& f) { f.text("imu.txt", "1 0 0 0 0 0 inf\n"); },
     "imu.txt:1", "'inf'", "expected a specific force"},
    {"degrees for radians", good_tum,
     [](const TempFolder& f) { f.text("imu.txt", "1 -250.5 0 0 0 0 9.81\n"); }, "imu.txt:1", "'-250.5'",
     "at most 100 rad/s"},
    {"a word in the IMU's samples", good_tum,
     [](const TempFolder& f) { f.text("imu.txt", "1 0 0 0 x 0 9.81\n"); }, "imu.txt:1", "'x'",
     "expected a specific force"},
    {"short line in imu.txt", good_tum,
     [](const TempFolder& f) { f.text("imu.txt", "1 0 0 0 0 0 9.81\n2 0 0 0\n"); }, "imu.txt:2", "4 values",
     "expected 7"},
    {"IMU stamps that do not rise", good_tum,
     [](const TempFolder& f) { f.text("imu.txt", "2 0 0 0 0 0 9.81\n2 0 0 0 0 0 9.81\n"); }, "imu.txt:2",
     "2.000000000", "expected rising"},
    {"IMU stamp that is none", good_tum,
     [](const TempFolder& f) { f.text("imu.txt", "now 0 0 0 0 0 9.81\n"); }, "imu.txt:1", "'now'",
     "expected seconds"},
    {"empty imu.txt", good_tum, [](const TempFolder& f) { f.text("imu.txt", "# none\n"); }, "imu.txt",
     "0 samples", "expected"},
    {"an extrinsic of the IMU that is no rotation", good_tum,
     [](const TempFolder& f) {
         f.text("camera.txt", "fx 5\nfy 5\ncx 3.5\ncy 2.5\nT_camera_imu 0 0 0 0 0 0 2\n");
     },
     "camera.txt:5", "norm is 2", "expected a rigid T_camera_imu"},
    {"two extrinsics of the IMU", good_tum,
     [](const TempFolder& f) {
         f.text("camera.txt",
                "fx 5\nfy 5\ncx 3.5\ncy 2.5\nT_camera_imu 0 0 0 0 0 0 1\nT_camera_imu 0 0 0 0 0 0 1\n");
     },
     "camera.txt:6", "T_camera_imu", "expected it once with 7"},
    {"NaN pose file", good_scenes,
     [](const TempFolder& f) { f.text("frame-000000.pose.txt", "nan 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"); },
     "frame-000000.pose.txt", "entry 0", "not finite"},
    {"scaled pose", good_scenes,
     [](const TempFolder& f) { f.text("frame-000000.pose.txt", "2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n"); },
     "frame-000000.pose.txt", "off by 3", "expected"},
    {"mirrored pose", good_scenes,
     [](const TempFolder& f) { f.text("frame-000000.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n"); },
     "frame-000000.pose.txt", "determinant -1", "expected"},
    {"pose with a bad last row", good_scenes,
     [](const TempFolder& f) { f.text("frame-000000.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n"); },
     "frame-000000.pose.txt", "0 0 0 2", "expected 0 0 0 1"},
    {"short pose file", good_scenes,
     [](const TempFolder& f) { f.text("frame-000000.pose.txt", "1 0 0 0\n"); }, "frame-000000.pose.txt",
     "4 numbers", "expected the 16"},
    {"bad intrinsic matrix", good_scenes,
     [](const TempFolder& f) { f.text("camera-intrinsics.txt", "585 0 320\n0 -585 240\n0 0 1\n"); },
     "camera-intrinsics.txt", "-585", "expected a positive"},
    {"depth that does not fit the default", good_scenes,
     [](const TempFolder& f) { f.depth("frame-000000.depth.png", 320, 240, 1, 1); }, "frame-000000.depth.png",
     "320x240", "expected 640x480"},
    {"bad trajectory line", good_replica,
     [](const TempFolder& f) { f.text("traj.txt", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0\n"); }, "traj.txt:1",
     "15 values", "expected 16"},
    {"NaN in the trajectory", good_replica,
     [](const TempFolder& f) { f.text("traj.txt", "1 0 0 nan 0 1 0 0 0 0 1 0 0 0 0 1\n"); }, "traj.txt:1",
     "entry 3", "not finite"},
    {"broken JSON", good_replica, [](const TempFolder& f) { f.text("cam_params.json", "{\"camera\": {"); },
     "cam_params.json", "no JSON object", "expected"},
    {"negative intrinsics in JSON", good_replica,
     [](const TempFolder& f) {
         f.text("cam_params.json",
                R"({"camera": {"w": 8, "h": 6, "fx": -5, "fy": 5, "cx": 3.5, "cy": 2.5, "scale": 1000}})");
     },
     "cam_params.json", "-5", "expected"},
    {"zero scale in JSON", good_replica,
     [](const TempFolder& f) {
         f.text("cam_params.json",
                R"({"camera": {"w": 8, "h": 6, "fx": 5, "fy": 5, "cx": 3.5, "cy": 2.5, "scale": 0}})");
     },
     "cam_params.json", "scale is 0", "expected"},
    {"cut log", good_redwood,
     [](const TempFolder& f) { f.text("odometry.log", "0 0 1\n1 0 0 0\n0 1 0 0\n"); }, "odometry.log:1",
     "2 rows", "expected 4"},
    {"log of falling indices", good_redwood,
     [](const TempFolder& f) {
         f.text("odometry.log", "1 1 2\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0 0 1\n");
     },
     "odometry.log:6", "index 0", "expected one above 1"},
    {"row-major intrinsic matrix", good_redwood,
     [](const TempFolder& f) {
         f.text("camera_intrinsic.json",
                R"({"width": 8, "height": 6, "intrinsic_matrix": [5, 0, 3.5, 0, 5, 2.5, 0, 0, 1]})");
     },
     "camera_intrinsic.json", "intrinsic_matrix", "expected"},
    {"no images", good_redwood, [](const TempFolder& f) { fs::remove(f.path("depth/0.png")); }, "",
     "0 frames", "expected at least 1"},
};

TEST(BadDatasets, Table) {
    for (const Case& c : kCases) {
        SCOPED_TRACE(c.what);
        const TempFolder folder;
        c.good(folder);
        {
            const Status status = first_error(folder.path(), "");
            ASSERT_TRUE(status.ok()) << "before spoiling: " << status.text();
        }
        c.spoil(folder);
        const Status status = first_error(folder.path(), "");
        ASSERT_FALSE(status.ok());
        const std::string text = status.text();
        EXPECT_NE(text.find(folder.path()), std::string::npos) << text;
        for (const char* part : {c.file, c.value, c.expected})
            EXPECT_NE(text.find(part), std::string::npos) << text;
        for (const char ch : text) EXPECT_TRUE(ch >= 0x20 && ch < 0x7f) << "unprintable: " << text;
        EXPECT_TRUE(status.code() == Code::format || status.code() == Code::io) << int(status.code());
    }
}

TEST(BadDatasets, FoldersThatAreNone) {
    const TempFolder folder;
    const std::string file = folder.text("a.txt", "x");
    for (const std::string& path : {folder.path("missing"), std::string()}) {
        const Status status = first_error(path, "");
        ASSERT_FALSE(status.ok());
        EXPECT_EQ(status.code(), Code::io);
        EXPECT_NE(std::string(status.text()).find(path), std::string::npos) << status.text();
        EXPECT_NE(std::string(status.text()).find("expected the folder"), std::string::npos) << status.text();
    }
    // Nothing fits: the message lists what would, of files for a file and of folders for a folder.
    const Status no_file = first_error(file, ""), no_folder = first_error(folder.path(), "");
    EXPECT_EQ(no_file.code(), Code::format);
    EXPECT_EQ(no_folder.code(), Code::format);
    for (const std::string& format : dataset_formats()) {
        const bool in_file = std::string(no_file.text()).find(format + ": ") != std::string::npos;
        const bool in_folder = std::string(no_folder.text()).find(format + ": ") != std::string::npos;
        EXPECT_NE(in_file, in_folder) << format << "\n" << no_file.text() << "\n" << no_folder.text();
    }
    // Each format by force, and one that is unknown.
    for (const std::string& format : dataset_formats()) {
        const Status status = first_error(folder.path(), format);
        ASSERT_FALSE(status.ok()) << format;
        EXPECT_NE(std::string(status.text()).find(folder.path()), std::string::npos) << status.text();
        EXPECT_NE(std::string(status.text()).find("expected"), std::string::npos) << status.text();
    }
    const Status unknown = first_error(folder.path(), "kitti");
    ASSERT_FALSE(unknown.ok());
    EXPECT_NE(std::string(unknown.text()).find("'kitti'"), std::string::npos);
    EXPECT_NE(std::string(unknown.text()).find("tum"), std::string::npos);
}

TEST(BadDatasets, UnreadableFile) {
    const TempFolder folder;
    good_tum(folder);
    ASSERT_EQ(::chmod(folder.path("groundtruth.txt").c_str(), 0), 0);
    if (::geteuid() == 0) GTEST_SKIP() << "root may read everything";
    const Status status = first_error(folder.path(), "");
    ASSERT_FALSE(status.ok());
    EXPECT_NE(std::string(status.text()).find("Permission denied"), std::string::npos) << status.text();
}

// A pipe in place of a file must not make the program wait for ever.
TEST(BadDatasets, PipeInPlaceOfAnImage) {
    const TempFolder folder;
    good_tum(folder);
    fs::remove(folder.path("depth/0.png"));
    ASSERT_EQ(::mkfifo(folder.path("depth/0.png").c_str(), 0600), 0);
    const Status status = first_error(folder.path(), "");
    ASSERT_FALSE(status.ok());
    EXPECT_NE(std::string(status.text()).find("depth/0.png"), std::string::npos) << status.text();
}

// A file that disappears between opening and loading.
TEST(BadDatasets, GoneAfterOpening) {
    const TempFolder folder;
    good_tum(folder);
    const Result<std::unique_ptr<Dataset>> opened = open_dataset(folder.path(), "");
    ASSERT_TRUE(opened.ok()) << opened.status().text();
    fs::remove(folder.path("depth/1.png"));
    Frame frame;
    EXPECT_TRUE((*opened)->load(0, &frame).ok());
    const Status status = (*opened)->load(1, &frame);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.code(), Code::io);
    EXPECT_NE(std::string(status.text()).find("depth/1.png"), std::string::npos) << status.text();
    EXPECT_FALSE((*opened)->load(2, &frame).ok());
    EXPECT_FALSE((*opened)->load(-1, &frame).ok());
}

}  // namespace
}  // namespace burin
