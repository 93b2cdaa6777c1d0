// SPDX-License-Identifier: MIT
// burin record, and what burin makes of recordings.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <thread>

#include "capture/recording_reader.h"
#include "faults/cli_runner.h"

namespace burin {
namespace {

namespace fs = std::filesystem;

std::string hash_of(const std::string& command, const std::string& source, const TempFolder& folder) {
    static int count = 0;
    const Ran ran = run_burin({command, source, "-o", folder.path("out" + std::to_string(count++)), "--json",
                               "--quiet", "--voxel", "0.02", "--threads", "2"});
    EXPECT_EQ(ran.exit, 0) << ran.err;
    const nlohmann::json report = parse_json(ran.out);
    EXPECT_GT(report.value("tracked", 0), 0) << report.dump();
    return report.value("map_hash", "");
}

// A rendered room, recorded and replayed.
TEST(CliRecord, ReplaysBitForBit) {
    const TempFolder folder;
    const std::string room = folder.path("room");
    const Ran synth = run_burin({"synth", "room", "-o", room, "--frames", "8", "--size", "160x120", "--imu",
                                 "--no-truth-images", "--no-truth-mesh"});
    ASSERT_EQ(synth.exit, 0) << synth.err;
    const std::string scanned = hash_of("scan", room, folder), fused = hash_of("fuse", room, folder);
    for (const char* colour : {"lossless", "raw"}) {
        const Ran ran = run_burin({"record", room, "-o", folder.path(colour), "--colour", colour});
        ASSERT_EQ(ran.exit, 0) << ran.err;
        EXPECT_NE(ran.out.find("recording.burinrec: 8 frames"), std::string::npos) << ran.out;
        EXPECT_EQ(hash_of("scan", folder.path(colour), folder), scanned) << colour;
        EXPECT_EQ(hash_of("fuse", folder.path(colour), folder), fused) << colour;
    }
    const Ran ran = run_burin({"record", room, "-o", folder.path("jpeg"), "--json"});
    ASSERT_EQ(ran.exit, 0) << ran.err;
    const nlohmann::json report = parse_json(ran.out);
    EXPECT_EQ(report["frames"], 8);
    EXPECT_EQ(report["dropped"], 0);
    EXPECT_GT(report["imu_samples"], 40);
    EXPECT_EQ(report["file_bytes"], fs::file_size(folder.path("jpeg/recording.burinrec")));
    EXPECT_GT(report["compression"], 3.0);
    const std::string once = hash_of("scan", folder.path("jpeg"), folder);
    EXPECT_EQ(hash_of("scan", folder.path("jpeg"), folder), once);
    EXPECT_NE(once, scanned) << "jpeg has changed the colours";
}

// A recording that stands in for a sensor is recorded again: every image and every stretch of time is the
// same.
TEST(CliRecord, WhatASensorDelivers) {
    const TempFolder folder;
    write_sequence(folder, 12);
    ASSERT_EQ(run_burin({"record", folder.path(), "-o", folder.path("a"), "--colour", "raw"}).exit, 0);
    const Ran ran = run_burin({"record", "replay:" + folder.path("a") + "?pace=fast", "-o", folder.path("b"),
                               "--colour", "raw", "--lossless", "--json"});
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_EQ(parse_json(ran.out)["frames"], 12);
    RecordingReader a, b;
    RecordedImages images_a, images_b;
    ASSERT_TRUE(a.open(folder.path("a").c_str()).ok() && b.open(folder.path("b").c_str()).ok());
    ASSERT_TRUE(images_a.reserve(a).ok() && images_b.reserve(b).ok());
    ASSERT_EQ(b.frame_count(), 12);
    EXPECT_TRUE(b.findings().closed);
    for (int i = 0; i < 12; ++i) {
        EXPECT_EQ(a.frame(i).t_ns - a.frame(0).t_ns, b.frame(i).t_ns - b.frame(0).t_ns);
        for (int k = 0; k < 2; ++k) {
            const auto kind = static_cast<StreamKind>(k);
            std::vector<std::uint8_t> of_a(a.info().at(kind).image_bytes), of_b(of_a.size());
            RecordHead head;
            Camera camera;
            ASSERT_TRUE(
                images_a.read(a, a.frame(i).recorded.images[k], kind, &head, &camera, of_a.data()).ok());
            ASSERT_TRUE(
                images_b.read(b, b.frame(i).recorded.images[k], kind, &head, &camera, of_b.data()).ok());
            ASSERT_EQ(of_a, of_b) << i;
        }
    }
}

TEST(CliRecord, RecordsTheFramesAskedFor) {
    const TempFolder folder;
    write_sequence(folder, 6);
    const Ran ran = run_burin({"record", folder.path(), "-o", folder.path("r"), "--frames", "2:5", "--json"});
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_EQ(parse_json(ran.out)["frames"], 3);
    // A recording is itself a data set to record from.
    const Ran again = run_burin({"record", folder.path("r"), "-o", folder.path("s"), "--json"});
    ASSERT_EQ(again.exit, 0) << again.err;
    EXPECT_EQ(parse_json(again.out)["frames"], 3);
}

TEST(CliRecord, AnInterruptionClosesIt) {
    const TempFolder folder;
    write_sequence(folder, 250);
    const std::string file = folder.path("r/recording.burinrec");
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        ::execl(BURIN_CLI, BURIN_CLI, "record", folder.path().c_str(), "-o", folder.path("r").c_str(),
                "--quiet", nullptr);
        ::_exit(127);
    }
    std::error_code none;
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!(fs::exists(file, none) && fs::file_size(file, none) > 20000) &&
           std::chrono::steady_clock::now() < give_up)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ::kill(child, SIGINT);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
    RecordingReader reader;
    ASSERT_TRUE(reader.open(file.c_str()).ok());
    EXPECT_TRUE(reader.findings().closed);
    EXPECT_GT(reader.frame_count(), 0);
    EXPECT_LT(reader.frame_count(), 250);
}

TEST(CliRecord, AFullDiskIsOneLineAndAGoodFile) {
    const TempFolder folder;
    write_sequence(folder, 30);
    // A limit of 40 KiB on files stands in for a small disk.
    const Ran ran = [&] {
        const std::string out = folder.path("o"), err = folder.path("e");
        const std::string command = "ulimit -f 80; trap '' XFSZ; exec " BURIN_CLI " record " + folder.path() +
                                    " -o " + folder.path("r") + " >" + out + " 2>" + err;
        const int status = std::system(command.c_str());
        return Ran{WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_bytes(out), read_bytes(err)};
    }();
    expect_failure(ran, 1, {"recording.burinrec: the disk is full", "the recording ends after"});
    RecordingReader reader;
    ASSERT_TRUE(reader.open(folder.path("r").c_str()).ok());
    EXPECT_EQ(reader.findings().torn_bytes, 0u);
    EXPECT_GT(reader.frame_count(), 0);
}

TEST(CliRecord, BadInputIsOneLine) {
    const TempFolder folder;
    write_sequence(folder, 3);
    expect_failure(run_burin({"record", folder.path("none"), "-o", folder.path("r")}), 2, {"none"});
    expect_failure(run_burin({"record", folder.path(), "-o", folder.path("r"), "--frames", "9:12"}), 2,
                   {"3 frames", "from 9 on"});
    expect_failure(run_burin({"record", folder.path(), "-o", folder.path("r"), "--colour", "png"}), 2,
                   {"--colour"});
    expect_failure(run_burin({"record", folder.path(), "-o", folder.path("r"), "--quality", "0"}), 2,
                   {"--quality"});
    ASSERT_EQ(run_burin({"record", folder.path(), "-o", folder.path("r")}).exit, 0);
    expect_failure(run_burin({"record", folder.path(), "-o", folder.path("r")}), 1,
                   {"recording.burinrec", "is there already"});
    // The second image of the sequence is gone: what came before it stays.
    fs::remove(folder.path("depth/1.png"));
    fs::create_directories(folder.path("depth/1.png"));
    expect_failure(run_burin({"record", folder.path(), "-o", folder.path("s")}), 2, {"depth/1.png"});
    std::ofstream(folder.path("r/recording.burinrec")) << "nothing";
    expect_failure(run_burin({"scan", folder.path("r"), "-o", folder.path("out")}), 2,
                   {"recording.burinrec", "is no recording"});
}

}  // namespace
}  // namespace burin
