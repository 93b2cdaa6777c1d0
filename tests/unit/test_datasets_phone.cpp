// SPDX-License-Identifier: MIT
// Exports of phones and logs: what was written comes back, and gives the map that the TUM layout gives.
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "api/c_frame.h"
#include "datasets/convert.h"
#include "datasets/open.h"
#include "phone_files.h"

namespace burin {
namespace {

const std::vector<Shot>& shots() {
    static const std::vector<Shot> all = room_shots(4, 160, 120);
    return all;
}

std::unique_ptr<Dataset> open_as(const std::string& path, const std::string& format) {
    auto opened = open_dataset(path, "");
    EXPECT_TRUE(opened.ok()) << opened.status().text();
    if (!opened.ok()) return nullptr;
    EXPECT_EQ((*opened)->format(), format);
    return std::move(*opened);
}

struct Expect {
    bool colour = true, confidence = false, poses = true;
};

void expect_shots(const Dataset& dataset, const Expect& expect) {
    ASSERT_EQ(dataset.frame_count(), static_cast<int>(shots().size()));
    Frame f;
    for (int i = dataset.frame_count() - 1; i >= 0; --i) {  // any order
        const Shot& s = shots()[static_cast<std::size_t>(i)];
        const Status status = dataset.load(i, &f);
        ASSERT_TRUE(status.ok()) << status.text();
        EXPECT_EQ(f.t_ns, s.t_us * 1000);
        if (f.depth_u16.empty()) {
            for (std::size_t p = 0; p < s.depth_mm.pixels.size(); ++p)
                ASSERT_EQ(f.depth_f32.pixels[p], static_cast<float>(s.depth_mm.pixels[p]) * 0.001f);
        } else {
            EXPECT_EQ(f.depth_u16.pixels, s.depth_mm.pixels);
            EXPECT_EQ(f.depth_unit_m, 0.001);
        }
        EXPECT_EQ(f.colour.pixels, expect.colour ? s.rgb.pixels : std::vector<std::uint8_t>());
        EXPECT_EQ(f.confidence.pixels, expect.confidence ? s.confidence.pixels : std::vector<std::uint8_t>());
        EXPECT_EQ(f.min_confidence, expect.confidence ? 1 : 0);
        EXPECT_NEAR(f.depth_camera.fx, s.camera.fx, 1e-5);
        EXPECT_NEAR(f.depth_camera.cy, s.camera.cy, 1e-5);
        EXPECT_EQ(f.depth_camera.width, s.camera.width);
        EXPECT_EQ(f.has_pose, expect.poses);
        if (!expect.poses) continue;
        for (int k = 0; k < 9; ++k) EXPECT_NEAR(f.T_world_camera.R.m[k], s.T_world_camera.R.m[k], 1e-12);
        EXPECT_NEAR(norm(f.T_world_camera.t - s.T_world_camera.t), 0, 1e-12);
    }
}

// Of the map that these frames give. fine: depth goes through the bilateral filter, whose steps are the same
// for 16-bit and floating-point depth; without it 16-bit depth stays in its own steps.
std::uint64_t hash_of(const Dataset& dataset, bool fine = false) {
    burin_config config = burin_config_default();
    config.voxel_m = 0.02f;
    config.budget_bytes = 64u << 20;
    config.max_width = 160;
    config.max_height = 120;
    config.bilateral = fine;
    std::uint64_t bytes = 0;
    EXPECT_EQ(burin_bytes(&config, &bytes), BURIN_OK);
    void* memory = std::aligned_alloc(4096, (bytes + 4095) / 4096 * 4096);
    burin_map map;
    EXPECT_EQ(burin_create(&config, memory, bytes, &map), BURIN_OK);
    Frame frame;
    for (int i = 0; i < dataset.frame_count(); ++i) {
        EXPECT_TRUE(dataset.load(i, &frame).ok());
        const burin_frame view = c_frame(frame);
        burin_frame_result result;
        EXPECT_EQ(burin_integrate(map, &view, &result), BURIN_OK) << burin_last_error(map);
    }
    burin_statistics stats;
    burin_stats(map, &stats);
    EXPECT_GT(stats.chunks_live, 100u);
    std::uint64_t hash = 0;
    burin_hash(map, &hash);
    burin_destroy(&map);
    std::free(memory);
    return hash;
}

std::uint64_t tum_hash(int least_confidence, bool fine = false) {
    const TempFolder folder;
    write_tum(folder, shots(), least_confidence);
    return hash_of(*open_as(folder.path(), "tum"), fine);
}

TEST(Phone, SensComesBack) {
    const TempFolder folder;
    for (const bool raw : {false, true}) {
        const auto dataset = open_as(folder.text("a.sens", sens_of(shots(), raw)), "sens");
        ASSERT_TRUE(dataset);
        expect_shots(*dataset, {});
        EXPECT_EQ(dataset->notes(), "");
    }
}

TEST(Phone, SensGivesTheMapOfTum) {
    std::vector<Shot> rounded = shots();  // intrinsics are 32-bit there
    const TempFolder folder, tum;
    for (Shot& s : rounded)
        s.camera.fx = float(s.camera.fx), s.camera.fy = float(s.camera.fy), s.camera.cx = float(s.camera.cx),
        s.camera.cy = float(s.camera.cy);
    write_tum(tum, rounded, 0);
    const auto dataset = open_as(folder.text("a.sens", sens_of(shots(), false)), "sens");
    EXPECT_EQ(hash_of(*dataset), hash_of(*open_as(tum.path(), "tum")));
}

TEST(Phone, SensMarksLostFramesAndMendsStamps) {
    std::vector<Shot> some = shots();
    some[1].T_world_camera.R.m[0] = -INFINITY;
    for (Shot& s : some) s.t_us = 0;
    const TempFolder folder;
    const auto dataset = open_as(folder.text("a.sens", sens_of(some, false)), "sens");
    ASSERT_TRUE(dataset);
    Frame f;
    ASSERT_TRUE(dataset->load(1, &f).ok());
    EXPECT_FALSE(f.has_pose);
    EXPECT_EQ(f.t_ns, 33333333);
    EXPECT_NE(dataset->notes().find("1 of 4 frames have no pose"), std::string::npos) << dataset->notes();
    EXPECT_NE(dataset->notes().find("30 Hz"), std::string::npos) << dataset->notes();
}

TEST(Phone, KlgComesBack) {
    const TempFolder folder, tum;
    write_tum(tum, shots(), 0);
    folder.text("camera.txt", read_bytes(tum.path("camera.txt")) + "width 160\nheight 120\n");
    folder.text("a.klg.freiburg", read_bytes(tum.path("groundtruth.txt")));
    for (const bool raw : {false, true}) {
        const auto dataset = open_as(folder.text("a.klg", klg_of(shots(), raw)), "klg");
        ASSERT_TRUE(dataset);
        expect_shots(*dataset, {});
        EXPECT_EQ(hash_of(*dataset), tum_hash(0));
    }
}

TEST(Phone, KlgWithoutAnythingBesideIt) {
    const TempFolder folder;
    const auto dataset = open_as(folder.text("a.klg", klg_of(shots(), false)), "klg");
    ASSERT_TRUE(dataset);
    Frame f;
    ASSERT_TRUE(dataset->load(0, &f).ok());
    EXPECT_EQ(f.depth_camera.width, 160);  // from the colour image
    EXPECT_EQ(f.depth_camera.fx, 132);     // 528 / 4
    EXPECT_FALSE(f.has_pose);
    EXPECT_NE(dataset->notes().find("ElasticFusion's default"), std::string::npos) << dataset->notes();
}

// The writer was killed: its count is still 0 and the last frame is not whole.
TEST(Phone, KlgThatWasNotClosed) {
    const TempFolder folder;
    std::string bytes = klg_of(shots(), false);
    std::memset(bytes.data(), 0, 4);
    const auto dataset = open_as(folder.text("a.klg", bytes.substr(0, bytes.size() - 1)), "klg");
    ASSERT_TRUE(dataset);
    EXPECT_EQ(dataset->frame_count(), 3);
    EXPECT_NE(dataset->notes().find("was not closed"), std::string::npos) << dataset->notes();
}

TEST(Phone, StrayComesBack) {
    const TempFolder folder;
    write_stray(folder, shots());
    // Without a video the matrix is taken to be that of 1920x1440.
    const Camera& c = shots()[0].camera;
    folder.text("camera_matrix.csv", digits(12 * c.fx) + ", 0.0, " + digits(12 * (c.cx + 0.5) - 0.5) +
                                         "\n0.0, " + digits(12 * c.fy) + ", " +
                                         digits(12 * (c.cy + 0.5) - 0.5) + "\n0.0, 0.0, 1.0");
    const auto dataset = open_as(folder.path(), "stray");
    ASSERT_TRUE(dataset);
    expect_shots(*dataset, {false, true, true});
    EXPECT_NE(dataset->notes().find("no rgb.mp4"), std::string::npos) << dataset->notes();
}

TEST(Phone, StrayImuInGravitiesOrMetres) {
    for (const double unit : {1.0, 9.81}) {
        const TempFolder folder;
        write_stray(folder, shots());
        std::string imu = "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n";
        // Held upright in landscape, as the rendered poses are: CoreMotion's x points up and reads gravity.
        for (int i = 0; i < 60; ++i)
            imu += digits(0.05 + 0.01 * i) + ", " + digits(-unit) + ", 0.0, 0.0, 0.0, 0.5, 0.0\n";
        folder.text("imu.csv", imu);
        const auto dataset = open_as(folder.path(), "stray");
        ASSERT_TRUE(dataset);
        Frame f;
        ASSERT_TRUE(dataset->load(2, &f).ok());
        ASSERT_GE(f.imu.size(), 9u);
        const Mat3d R = f.T_world_camera.R * f.T_camera_imu.R;
        EXPECT_NEAR(norm(R * f.imu[0].accel_m_s2 - Vec3d{0, 0, 9.81}), 0, 1e-9);
        EXPECT_EQ(f.imu[0].gyro_rad_s.y, 0.5);
    }
}

TEST(Phone, PolycamComesBackAndGivesTheMapOfTum) {
    const TempFolder folder;
    write_polycam(folder, shots());
    const auto dataset = open_as(folder.path(), "polycam");
    ASSERT_TRUE(dataset);
    expect_shots(*dataset, {true, true, true});
    EXPECT_EQ(hash_of(*dataset), tum_hash(1));
    EXPECT_NE(tum_hash(1), tum_hash(0));
}

#ifdef BURIN_HAVE_ZIP
TEST(Phone, Record3dComesBackAndGivesTheMapOfTum) {
    const TempFolder folder;
    const auto dataset = open_as(folder.text("a.r3d", r3d_of(shots())), "record3d");
    ASSERT_TRUE(dataset);
    expect_shots(*dataset, {true, true, true});
    EXPECT_EQ(hash_of(*dataset, true), tum_hash(1, true));
}

TEST(Phone, Record3dByManyThreads) {
    const TempFolder folder;
    const auto dataset = open_as(folder.text("a.r3d", r3d_of(shots())), "record3d");
    ASSERT_TRUE(dataset);
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) threads.emplace_back([&] { expect_shots(*dataset, {true, true, true}); });
    for (std::thread& thread : threads) thread.join();
}
#endif

// A cut at any of many places, and a changed byte: one line that names the file, or the same frames.
void expect_one_line(const std::string& path, int* refused) {
    auto opened = open_dataset(path, "");
    Status status = opened.ok() ? Status() : opened.status();
    Frame f;
    for (int i = 0; status.ok() && i < (*opened)->frame_count(); ++i) status = (*opened)->load(i, &f);
    *refused += !status.ok();
    if (status.ok()) return;
    EXPECT_EQ(std::strchr(status.text(), '\n'), nullptr);
    EXPECT_NE(std::string(status.text()).find(path), std::string::npos) << status.text();
}

TEST(Phone, CutAndDamagedFilesSayOneLine) {
    const TempFolder folder;
    const std::vector<Shot> small = room_shots(2, 16, 12);
    std::vector<std::pair<std::string, std::string>> files = {{"a.sens", sens_of(small, false)},
                                                              {"a.klg", klg_of(small, false)}};
#ifdef BURIN_HAVE_ZIP
    files.emplace_back("a.r3d", r3d_of(small));
#endif
    for (const auto& [name, bytes] : files) {
        int cut = 0, changed = 0;
        constexpr int kTries = 100;
        // The count of IMU frames at the end of .sens is not read.
        const std::size_t most = bytes.size() - (name == "a.sens" ? 8 : 0);
        for (int i = 0; i < kTries; ++i) {
            const std::size_t at = most * static_cast<std::size_t>(i) / kTries;
            expect_one_line(folder.text(name, bytes.substr(0, at)), &cut);
            std::string other = bytes;
            other[at] = static_cast<char>(other[at] ^ 0x55);
            expect_one_line(folder.text(name, other), &changed);
        }
        EXPECT_EQ(cut, kTries) << name;
        EXPECT_GT(changed, kTries / 4) << name;
    }
}

TEST(Phone, ConvertedToTumItIsTheSame) {
    const TempFolder folder;
    write_polycam(folder, shots());
    const auto dataset = open_as(folder.path(), "polycam");
    ASSERT_TRUE(dataset);
    ConvertSummary summary;
    const auto go_on = [](int, int) { return true; };
    const Status status = convert_to_tum(*dataset, folder.path("tum"), {}, go_on, &summary);
    ASSERT_TRUE(status.ok()) << status.text();
    EXPECT_EQ(summary.with_colour, 4);
    EXPECT_EQ(summary.notes, "");
    const auto converted = open_as(folder.path("tum"), "tum");
    ASSERT_TRUE(converted);
    expect_shots(*converted, {true, true, true});
    EXPECT_EQ(hash_of(*converted), hash_of(*dataset));
    EXPECT_FALSE(
        convert_to_tum(*dataset, folder.path("tum"), {}, go_on, &summary).ok());  // never over another
}

TEST(Phone, FilesAndFoldersAreNotMistaken) {
    const TempFolder folder;
    const std::string path = folder.text("a.sens", sens_of(shots(), true));
    EXPECT_NE(std::string(open_dataset(path, "tum").status().text()).find("expected a folder"),
              std::string::npos);
    EXPECT_NE(std::string(open_dataset(folder.path(), "sens").status().text()).find("expected a file"),
              std::string::npos);
    EXPECT_NE(std::string(open_dataset(folder.text("a.txt", "x"), "").status().text()).find("a file .sens"),
              std::string::npos);
}

}  // namespace
}  // namespace burin
