// SPDX-License-Identifier: MIT
// Saved maps: what comes back is what went in, and whatever is damaged is found.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "dataset_files.h"
#include "scene_helpers.h"

namespace burin {
namespace {

namespace fs = std::filesystem;
const Camera kCamera = test_camera();

void fuse(burin_map map, int begin, int end) {
    Rng rng(70);
    for (int i = 0; i < end; ++i) {
        const Se3 T = arc_pose(i, 10);
        AnalyticScene scene = ball_and_wall();
        if (i >= 5) scene.balls.clear();  // carving has to go on as well
        Image<float> depth = scene.depth(kCamera, T);
        Image<std::uint8_t> colour(160, 120, 3);
        for (float& d : depth.pixels) d += static_cast<float>(0.004 * rng.normal());
        for (std::uint8_t& c : colour.pixels) c = static_cast<std::uint8_t>(rng.below(256));
        if (i < begin) continue;
        FrameView view = frame_of(depth, kCamera, T);
        view.colour = colour.view();
        view.colour_camera = kCamera;
        const burin_frame frame = c_frame(view);
        ASSERT_EQ(burin_integrate(map, &frame, nullptr), BURIN_OK) << burin_last_error(map);
    }
}

TEST(MapFile, FusingOnIsFusingStraightThrough) {
    const TempFolder folder;
    for (const std::uint32_t colour : {1u, 0u}) {
        burin_config config = test_config();
        config.colour = colour;
        config.weight = BURIN_WEIGHT_INVERSE_Z2;
        config.drop = BURIN_DROP_EXPONENTIAL;
        config.max_weight = 3;
        const ApiMap straight(config), first(config), second(config);
        fuse(straight.map, 0, 10);
        const std::string path = folder.path("map.burin");
        fuse(first.map, 0, 4);
        ASSERT_EQ(burin_save(first.map, path.c_str()), BURIN_OK) << burin_last_error(first.map);
        fuse(second.map, 2, 3);  // what was there goes
        ASSERT_EQ(burin_load(second.map, path.c_str()), BURIN_OK) << burin_last_error(second.map);
        std::uint64_t listed = 0;
        burin_statistics loaded;
        burin_dirty_chunks(second.map, nullptr, 0, &listed);
        ASSERT_EQ(burin_stats(second.map, &loaded), BURIN_OK);
        EXPECT_EQ(listed, loaded.chunks_live) << "nothing of a loaded map has been meshed";
        EXPECT_EQ(second.hash(), first.hash());
        EXPECT_EQ(second.stats().frames, 4u);
        EXPECT_EQ(second.stats().chunks_live, first.stats().chunks_live);
        fuse(second.map, 4, 10);
        EXPECT_EQ(second.hash(), straight.hash()) << (colour ? "with" : "without") << " colour";
        EXPECT_EQ(second.stats().frames, 10u);

        burin_file_info info;
        ASSERT_EQ(burin_file_probe(path.c_str(), &info), BURIN_OK);
        EXPECT_EQ(info.hash, first.hash());
        EXPECT_EQ(info.chunks, first.stats().chunks_live);
        EXPECT_EQ(info.frames, 4u);
        EXPECT_EQ(info.has_colour, colour);
        EXPECT_EQ(info.voxel_m, config.voxel_m);
        EXPECT_EQ(std::memcmp(&info.config, &config, sizeof config), 0);
        EXPECT_EQ(fs::file_size(path) % 2048, 0u);
    }
}

TEST(MapFile, SameMapSameBytes) {
    const TempFolder folder;
    burin_config config = test_config();
    const ApiMap one(config), again(config);
    fuse(one.map, 0, 3);
    ASSERT_EQ(burin_save(one.map, folder.path("a").c_str()), BURIN_OK);
    ASSERT_EQ(burin_load(again.map, folder.path("a").c_str()), BURIN_OK);
    ASSERT_EQ(burin_save(again.map, folder.path("b").c_str()), BURIN_OK);
    EXPECT_EQ(read_bytes(folder.path("a")), read_bytes(folder.path("b")));
}

TEST(MapFile, ASmallerBudgetIsToldWhatItTakes) {
    const TempFolder folder;
    burin_config config = test_config();
    const ApiMap map(config);
    fuse(map.map, 0, 6);
    const std::string path = folder.path("map.burin");
    ASSERT_EQ(burin_save(map.map, path.c_str()), BURIN_OK);
    config.budget_bytes = 3u << 20;
    const ApiMap small(config);
    ASSERT_LT(small.stats().chunks_capacity, map.stats().chunks_live);
    fuse(small.map, 0, 1);
    const std::uint64_t before = small.hash();
    EXPECT_EQ(burin_load(small.map, path.c_str()), BURIN_INSUFFICIENT_MEMORY);
    EXPECT_EQ(small.hash(), before) << "a call that fails changes nothing";
    const std::string text = burin_last_error(small.map);
    const std::size_t at = text.find("budget of ");
    ASSERT_NE(at, std::string::npos) << text;
    config.budget_bytes = std::strtoull(text.c_str() + at + 10, nullptr, 10);
    const ApiMap enough(config);
    EXPECT_EQ(burin_load(enough.map, path.c_str()), BURIN_OK) << burin_last_error(enough.map);
    EXPECT_EQ(enough.hash(), map.hash());
    EXPECT_EQ(enough.stats().chunks_capacity, map.stats().chunks_live) << "the least budget is not the least";

    burin_file_info info;
    ASSERT_EQ(burin_file_probe(path.c_str(), &info), BURIN_OK);
    EXPECT_EQ(info.least_budget_bytes, config.budget_bytes);
}

TEST(MapFile, DoesNotFitAnotherConfiguration) {
    const TempFolder folder;
    const ApiMap map(test_config());
    fuse(map.map, 0, 1);
    const std::string path = folder.path("map.burin");
    ASSERT_EQ(burin_save(map.map, path.c_str()), BURIN_OK);
    burin_config other[3] = {test_config(0.03f), test_config(), test_config()};
    other[1].truncation_voxels = 5;
    other[2].colour = 0;
    for (const burin_config& config : other) {
        const ApiMap wrong(config);
        EXPECT_EQ(burin_load(wrong.map, path.c_str()), BURIN_INVALID_ARGUMENT);
        EXPECT_NE(std::string(burin_last_error(wrong.map)).find(path), std::string::npos);
    }
}

// --------------------------------------------------------------------------------------------------- damaged
// files

class DamagedMap : public testing::Test {
  protected:
    DamagedMap() : map_(config()), into_(config()), path_(folder_.path("map.burin")) {
        // Few chunks: one patch of a wall.
        Image<float> depth(160, 120);
        for (int y = 50; y < 58; ++y)
            for (int x = 70; x < 80; ++x) depth.view().at(x, y) = 1.0f;
        const burin_frame frame = c_frame(frame_of(depth, kCamera, {}));
        EXPECT_EQ(burin_integrate(map_.map, &frame, nullptr), BURIN_OK);
        EXPECT_EQ(burin_save(map_.map, path_.c_str()), BURIN_OK);
        bytes_ = read_bytes(path_);
        hash_ = map_.hash();
        EXPECT_LT(bytes_.size(), 80000u);
    }
    static burin_config config() {
        burin_config c = test_config();
        c.budget_bytes = 4u << 20;
        return c;
    }
    burin_status load(const std::string& bytes) {
        std::ofstream(path_, std::ios::binary | std::ios::trunc) << bytes;
        const burin_status status = burin_load(into_.map, path_.c_str());
        if (status != BURIN_OK) {
            const std::string text = burin_last_error(into_.map);
            EXPECT_NE(text.find(path_), std::string::npos) << text;
            EXPECT_EQ(text.find('\n'), std::string::npos) << text;
        }
        return status;
    }

    TempFolder folder_;
    const ApiMap map_, into_;
    std::string path_, bytes_;
    std::uint64_t hash_ = 0;
};

TEST_F(DamagedMap, AnyByteThatChangedIsFound) {
    ASSERT_EQ(load(bytes_), BURIN_OK);
    ASSERT_EQ(into_.hash(), hash_);
    Rng rng(71);
    int undetected = 0;
    std::fstream file(path_, std::ios::binary | std::ios::in | std::ios::out);
    const auto put = [&](std::size_t at, char byte) {
        file.seekp(static_cast<std::streamoff>(at));
        file.put(byte);
        file.flush();
    };
    for (std::size_t i = 0; i < bytes_.size(); ++i) {
        put(i, static_cast<char>(bytes_[i] ^ (1 << rng.below(8))));
        const burin_status status = burin_load(into_.map, path_.c_str());
        put(i, bytes_[i]);
        if (status == BURIN_OK && ++undetected <= 3)
            ADD_FAILURE() << "byte " << i << " of " << bytes_.size() << " changed unnoticed";
        ASSERT_TRUE(status == BURIN_OK || status == BURIN_FORMAT || status == BURIN_UNSUPPORTED)
            << status << " at byte " << i;
    }
    EXPECT_EQ(burin_load(into_.map, path_.c_str()), BURIN_OK);
    EXPECT_EQ(undetected, 0);
}

TEST_F(DamagedMap, AnyLengthButTheRightOneIsFound) {
    for (std::size_t length = 0; length < bytes_.size(); length += length < 4096 ? 64 : 512)
        ASSERT_EQ(load(bytes_.substr(0, length)), BURIN_FORMAT)
            << length << " of " << bytes_.size() << " bytes";
    EXPECT_EQ(load(bytes_.substr(0, bytes_.size() - 1)), BURIN_FORMAT);
    EXPECT_EQ(load(bytes_ + '\0'), BURIN_FORMAT);
    EXPECT_EQ(load(bytes_ + bytes_), BURIN_FORMAT);
}

TEST_F(DamagedMap, LeavesAnEmptyMapThatWorks) {
    std::string damaged = bytes_;
    damaged[damaged.size() - 100] ^= 1;  // found only at the very end
    ASSERT_EQ(load(damaged), BURIN_FORMAT);
    EXPECT_EQ(into_.stats().chunks_live, 0u);
    EXPECT_EQ(into_.stats().frames, 0u);
    ASSERT_EQ(load(bytes_), BURIN_OK);
    EXPECT_EQ(into_.hash(), hash_);
}

TEST_F(DamagedMap, OtherVersionsAndByteOrdersAreNamed) {
    std::string other = bytes_;
    other[8] = 2;  // version
    EXPECT_EQ(load(other), BURIN_UNSUPPORTED);
    EXPECT_NE(std::string(burin_last_error(into_.map)).find("version 2"), std::string::npos);
    other = bytes_;
    std::swap(other[12], other[15]);
    std::swap(other[13], other[14]);
    EXPECT_EQ(load(other), BURIN_UNSUPPORTED);
    other = bytes_;
    other[0] = 'X';
    EXPECT_EQ(load(other), BURIN_FORMAT);
}

// ----------------------------------------------------------------------------------------------------------
// writing

TEST_F(DamagedMap, MissingAndUnwritablePaths) {
    EXPECT_EQ(burin_load(into_.map, folder_.path("none").c_str()), BURIN_IO);
    EXPECT_EQ(burin_load(into_.map, folder_.path().c_str()), BURIN_IO)
        << "a folder: " << burin_last_error(into_.map);
    burin_file_info info;
    EXPECT_EQ(burin_file_probe(folder_.path("none").c_str(), &info), BURIN_IO);
    EXPECT_EQ(burin_save(map_.map, folder_.path("none/map.burin").c_str()), BURIN_IO);
    EXPECT_NE(std::string(burin_last_error(map_.map)).find("none/map.burin"), std::string::npos);
    EXPECT_EQ(burin_save(map_.map, ""), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_save(map_.map, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_save(map_.map, folder_.path().c_str()), BURIN_IO) << "a folder";
    EXPECT_EQ(burin_save(map_.map, "/dev/full"), BURIN_IO);
    EXPECT_TRUE(fs::is_character_file("/dev/full"));
    EXPECT_EQ(map_.hash(), hash_);
}

TEST_F(DamagedMap, AFullDiskLeavesWhatWasThere) {
    const std::string disk = folder_.path("disk");
    fs::create_directory(disk);
    if (::mount("burin-test", disk.c_str(), "tmpfs", 0, "size=64k") != 0)
        GTEST_SKIP() << "SKIPPED: no right to mount a small tmpfs";
    const ApiMap large(test_config());
    fuse(large.map, 0, 2);
    for (const bool old : {false, true}) {
        if (old) std::ofstream(disk + "/map.burin") << "old";
        EXPECT_EQ(burin_save(large.map, (disk + "/map.burin").c_str()), BURIN_IO);
        EXPECT_NE(std::string(burin_last_error(large.map)).find("map.burin"), std::string::npos);
        EXPECT_FALSE(fs::exists(disk + "/map.burin.part"));
        EXPECT_EQ(fs::exists(disk + "/map.burin"), old);
        if (old) {
            EXPECT_EQ(read_bytes(disk + "/map.burin"), "old");
        }
    }
    EXPECT_EQ(::umount(disk.c_str()), 0);
}

}  // namespace
}  // namespace burin
