// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "capture/crc32.h"
#include "datasets/open.h"
#include "unit/recording_rig.h"

namespace burin {
namespace {

std::string read_all(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

void expect_whole(const std::string& path, int frames) {
    RecordingReader reader;
    const Status opened = reader.open(path.c_str());
    ASSERT_TRUE(opened.ok()) << opened.text();
    ASSERT_EQ(reader.frame_count(), frames);
    RecordedImages images;
    ASSERT_TRUE(images.reserve(reader).ok());
    for (int n = 0; n < frames; ++n) ASSERT_NO_FATAL_FAILURE(expect_rig_frame(reader, images, n, n));
}

TEST(Recording, GivesBackAllThatWasRecorded) {
    const TempFolder folder;
    for (const RecordedColour colour :
         {RecordedColour::lossless, RecordedColour::raw, RecordedColour::jpeg}) {
        RecordingOptions options = rig_options();
        options.colour = colour;
        const std::string path = folder.path(std::to_string(static_cast<int>(colour)));
        ASSERT_NO_FATAL_FAILURE(record_rig(path, 20, options));
        ASSERT_NO_FATAL_FAILURE(expect_whole(path, 20));
        RecordingReader reader;
        ASSERT_TRUE(reader.open(path.c_str()).ok());
        const RecordingReader::Findings& f = reader.findings();
        EXPECT_TRUE(f.closed);
        EXPECT_EQ(f.torn_bytes + f.damaged_bytes + f.incomplete_frames + f.dropped_frames, 0u);
        EXPECT_EQ(f.lost_images[0], 2u);
        const DeviceInfo is = reader.info(), was = rig_device();
        EXPECT_STREQ(is.serial, was.serial);
        EXPECT_STREQ(reader.header().source, "rig:");
        EXPECT_TRUE(is.has_imu);
        EXPECT_EQ(is.T_camera_imu.t.y, was.T_camera_imu.t.y);
        for (int k = 0; k < kStreamKinds; ++k) {
            EXPECT_EQ(is.streams[k].width, was.streams[k].width);
            EXPECT_EQ(is.streams[k].image_bytes, was.streams[k].image_bytes);
            if (was.streams[k].width == 0) continue;
            EXPECT_EQ(is.streams[k].unit_m, was.streams[k].unit_m);
            EXPECT_EQ(is.streams[k].T_stream_depth.t.x, was.streams[k].T_stream_depth.t.x);
        }
        // Two depth images share each colour image, which is written once.
        EXPECT_EQ(reader.frame(6).recorded.images[1], reader.frame(7).recorded.images[1]);
        EXPECT_NE(reader.frame(6).recorded.images[1], reader.frame(8).recorded.images[1]);
    }
}

TEST(Recording, IsADataSet) {
    const TempFolder folder;
    ASSERT_NO_FATAL_FAILURE(record_rig(folder.path("r"), 8));
    const auto dataset = open_dataset(folder.path("r"), "");
    ASSERT_TRUE(dataset.ok()) << dataset.status().text();
    EXPECT_STREQ((*dataset)->format(), "recording");
    ASSERT_EQ((*dataset)->frame_count(), 8);
    const DeviceInfo info = rig_device();
    Frame frame;
    for (const int n : {3, 0, 5, 4}) {
        const RigFrame expected(info, n);
        const Status loaded = (*dataset)->load(n, &frame);
        ASSERT_TRUE(loaded.ok()) << loaded.text();
        EXPECT_EQ(frame.t_ns, expected.captured.t_ns);
        EXPECT_EQ(std::memcmp(frame.depth_u16.pixels.data(), expected.captured.images[0].pixels, 16 * 12 * 2),
                  0);
        EXPECT_EQ(std::memcmp(frame.colour.pixels.data(), expected.captured.images[1].pixels, 17 * 12 * 3),
                  0);
        EXPECT_EQ(frame.colour_t_ns, expected.captured.images[1].t_ns);
        EXPECT_EQ(frame.depth_camera.fx, expected.captured.images[0].camera.fx);
        EXPECT_EQ(frame.T_colour_depth.t.x, info.streams[1].T_stream_depth.t.x);
        EXPECT_EQ(frame.depth_unit_m, 0.00125);
        EXPECT_EQ(frame.confidence.empty(), expected.pixels[4].empty());
        EXPECT_EQ(frame.confidence.pixels, expected.pixels[4]);
        EXPECT_EQ(frame.has_pose, n % 2 == 0);
        EXPECT_EQ(frame.imu.size(), expected.imu.size());
        EXPECT_EQ(frame.T_camera_imu.t.z, 0.03);
    }
    EXPECT_EQ((*dataset)->load(8, &frame).code(), Code::invalid_argument);
    EXPECT_EQ((*dataset)->notes(), "1 depth images were lost by the sensor\n");
}

TEST(Recording, RowsMayBeStrided) {
    const TempFolder folder;
    const DeviceInfo info = rig_device();
    RecordingWriter writer;
    ASSERT_TRUE(writer.open(folder.path("r").c_str(), "", info, rig_options()).ok());
    RigFrame frame(info, 0);
    const StreamInfo& s = info.streams[0];
    std::vector<std::uint8_t> wide((s.row_bytes + 10) * static_cast<std::size_t>(s.height), 0xee);
    for (std::size_t y = 0; y < static_cast<std::size_t>(s.height); ++y)
        std::memcpy(wide.data() + y * (s.row_bytes + 10), frame.pixels[0].data() + y * s.row_bytes,
                    s.row_bytes);
    frame.captured.images[0].pixels = wide.data();
    frame.captured.images[0].stride_bytes = s.row_bytes + 10;
    ASSERT_TRUE(writer.add(frame.captured, &frame.T_world_camera).ok());
    ASSERT_TRUE(writer.close().ok());
    expect_whole(folder.path("r"), 1);
}

TEST(Recording, TakesTheLinesOfTheLog) {
    const TempFolder folder;
    const DeviceInfo info = rig_device();
    RecordingWriter writer;
    ASSERT_TRUE(writer.open(folder.path("r").c_str(), "", info, rig_options()).ok());
    writer.log(LogLevel::warning, "unplugged");
    ASSERT_TRUE(add_rig_frame(writer, info, 0).ok());
    writer.log(LogLevel::info, std::string(400, 'x').c_str());
    ASSERT_TRUE(writer.close().ok());
    RecordingReader reader;
    ASSERT_TRUE(reader.open(folder.path("r").c_str()).ok());
    std::uint64_t at = 0;
    LogLevel level;
    char line[257];
    ASSERT_TRUE(reader.next_line(&at, &level, line));
    EXPECT_STREQ(line, "unplugged");
    EXPECT_EQ(level, LogLevel::warning);
    ASSERT_TRUE(reader.next_line(&at, &level, line));
    EXPECT_EQ(std::string(line), std::string(255, 'x'));
    EXPECT_FALSE(reader.next_line(&at, &level, line));
}

TEST(Recording, ASlowDiskCostsFramesAndNoTime) {
    MemoryRecording file;
    const DeviceInfo info = rig_device();
    RecordingOptions options = rig_options();
    options.lossless = false;
    options.queue_frames = 4;
    RecordingWriter writer;
    ASSERT_TRUE(writer.open(&file, "it", "", info, options).ok());
    file.held = true;
    const auto began = std::chrono::steady_clock::now();
    for (int n = 0; n < 20; ++n) ASSERT_TRUE(add_rig_frame(writer, info, n).ok());
    EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(2));
    const RecordingStatistics s = writer.statistics();
    EXPECT_EQ(s.dropped, 16u);
    EXPECT_EQ(s.queue_high_water, 4);
    file.held = false;
    while (writer.statistics().frames < 4) std::this_thread::yield();
    ASSERT_TRUE(add_rig_frame(writer, info, 20).ok());
    ASSERT_TRUE(writer.close().ok());

    const TempFolder folder;
    const std::string path = folder.text(kRecordingName, file.bytes);
    RecordingReader reader;
    ASSERT_TRUE(reader.open(path.c_str()).ok());
    ASSERT_EQ(reader.frame_count(), 5);
    EXPECT_EQ(reader.findings().dropped_frames, 16u);
    EXPECT_EQ(reader.frame(4).t_ns, kRigStart_ns + 20 * kRigPeriod_ns);
    // The readings of the frames between are the next frame's: the stretch since frame 3 has no hole.
    int count = 0;
    const ImuSample* imu = reader.imu(reader.frame(4).recorded, &count);
    ASSERT_EQ(count, 5 * 17 + 1);
    EXPECT_EQ(imu[0].t_ns, rig_imu_ns(15));
    EXPECT_EQ(imu[count - 1].t_ns, rig_imu_ns(100));
}

TEST(Recording, LosslessItWaitsForTheDisk) {
    MemoryRecording file;
    const DeviceInfo info = rig_device();
    RecordingOptions options = rig_options();
    options.queue_frames = 2;
    RecordingWriter writer;
    ASSERT_TRUE(writer.open(&file, "it", "", info, options).ok());
    file.held = true;
    std::atomic<int> added{0};
    std::thread producer([&] {
        for (int n = 0; n < 12; ++n) {
            (void)add_rig_frame(writer, info, n);
            ++added;
        }
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_EQ(added, 2);
    file.held = false;
    producer.join();
    ASSERT_TRUE(writer.close().ok());
    EXPECT_EQ(writer.statistics().dropped, 0u);
    const TempFolder folder;
    expect_whole(folder.text(kRecordingName, file.bytes), 12);
}

// The disk fills up at any byte, and writes come in any pieces.
TEST(Recording, ADiskThatIsFullEndsItAtAWholeRecord) {
    const DeviceInfo info = rig_device();
    MemoryRecording whole;
    {
        RecordingWriter writer;
        ASSERT_TRUE(writer.open(&whole, "it", "", info, rig_options()).ok());
        for (int n = 0; n < 6; ++n) ASSERT_TRUE(add_rig_frame(writer, info, n).ok());
        ASSERT_TRUE(writer.close().ok());
    }
    const std::size_t header = record_bytes(sizeof(RecordedHeader));
    Rng rng(1);
    const TempFolder folder;
    int most_frames = 0;
    std::vector<std::size_t> rooms = {whole.bytes.size() - 1};
    for (std::size_t room = header; room < rooms[0]; room += 1 + static_cast<std::size_t>(rng.below(97)))
        rooms.push_back(room);
    for (const std::size_t room : rooms) {
        MemoryRecording file;
        file.room = room;
        file.most = 1 + static_cast<std::size_t>(rng.below(500));
        RecordingWriter writer;
        ASSERT_TRUE(writer.open(&file, "it", "", info, rig_options()).ok());
        std::string line;
        for (int n = 0; n < 6; ++n)
            if (const Status added = add_rig_frame(writer, info, n); !added.ok()) {
                EXPECT_EQ(added.code(), Code::io);
                line = added.text();
            }
        const Status closed = writer.close();
        ASSERT_EQ(closed.code(), Code::io);
        EXPECT_NE(std::string(closed.text()).find("it: the disk is full"), std::string::npos)
            << closed.text();
        if (!line.empty()) {
            EXPECT_EQ(line, closed.text());
        }
        const RecordingStatistics s = writer.statistics();
        EXPECT_EQ(s.frames + s.dropped, 6u);
        EXPECT_EQ(s.file_bytes, file.bytes.size()) << "cut to its last whole record";
        const std::string path = folder.text(kRecordingName, file.bytes);
        RecordingReader reader;
        ASSERT_TRUE(reader.open(path.c_str()).ok());
        ASSERT_EQ(reader.frame_count(), static_cast<int>(s.frames));
        EXPECT_EQ(reader.findings().torn_bytes, 0u);
        ASSERT_NO_FATAL_FAILURE(expect_whole(path, reader.frame_count()));
        most_frames = std::max(most_frames, reader.frame_count());
    }
    EXPECT_EQ(most_frames, 6);
    MemoryRecording none;
    none.room = header / 2;
    RecordingWriter writer;
    EXPECT_EQ(writer.open(&none, "it", "", info, rig_options()).code(), Code::io);
}

TEST(Recording, AFullDiskIsAStateWhileItStreams) {
    const DeviceInfo info = rig_device();
    MemoryRecording file;
    file.room = 8000;
    RecordingWriter writer;
    ASSERT_TRUE(writer.open(&file, "it", "", info, rig_options()).ok());
    int n = 0;
    while (add_rig_frame(writer, info, n).ok()) ASSERT_LT(++n, 1000);
    EXPECT_EQ(writer.statistics().state, RecordingState::full);
    EXPECT_STREQ(state_name(RecordingState::full), "full");
    for (; n < 1000; ++n) ASSERT_EQ(add_rig_frame(writer, info, n).code(), Code::io) << "it never waits";
    EXPECT_EQ(writer.close().code(), Code::io);
    EXPECT_EQ(writer.statistics().state, RecordingState::full) << "why it ended is still known";
    MemoryRecording large;
    ASSERT_TRUE(writer.open(&large, "it", "", info, rig_options()).ok());
    EXPECT_EQ(writer.statistics().state, RecordingState::recording);
    EXPECT_TRUE(writer.close().ok());
    EXPECT_EQ(writer.statistics().state, RecordingState::closed);
}

TEST(Recording, TheDiskIsAskedToHoldItAsOftenAsStated) {
    const DeviceInfo info = rig_device();
    for (const std::int64_t every_ns : {std::int64_t{0}, std::int64_t{20'000'000}}) {
        MemoryRecording file;
        RecordingOptions options = rig_options();
        options.sync_ns = every_ns;
        RecordingWriter writer;
        ASSERT_TRUE(writer.open(&file, "it", "", info, options).ok());
        for (int n = 0; n < 20; ++n) {
            ASSERT_TRUE(add_rig_frame(writer, info, n).ok());
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        const int before = file.syncs;
        if (every_ns == 0) {
            EXPECT_EQ(before, 0);
        } else {
            EXPECT_GT(before, 3);
        }
        ASSERT_TRUE(writer.close().ok());
        EXPECT_GT(file.syncs, before);
    }
    MemoryRecording file;
    RecordingOptions options = rig_options();
    options.sync_ns = 1;
    RecordingWriter writer;
    ASSERT_TRUE(writer.open(&file, "it", "", info, options).ok());
    file.sync_fails = true;
    for (int n = 0; n < 10 && writer.statistics().state == RecordingState::recording; ++n) {
        (void)add_rig_frame(writer, info, n);
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    EXPECT_EQ(writer.statistics().state, RecordingState::failed);
    EXPECT_EQ(writer.close().code(), Code::io);
}

TEST(Recording, OneThatIsThereStays) {
    const TempFolder folder;
    ASSERT_NO_FATAL_FAILURE(record_rig(folder.path("r"), 2));
    const std::string before = read_all(folder.path("r/recording.burinrec"));
    RecordingWriter writer;
    const Status again = writer.open(folder.path("r").c_str(), "", rig_device(), rig_options());
    EXPECT_EQ(again.code(), Code::io);
    EXPECT_NE(std::string(again.text()).find("recording.burinrec: is there already"), std::string::npos);
    EXPECT_EQ(read_all(folder.path("r/recording.burinrec")), before);
    EXPECT_EQ(writer.open(folder.path("none/r").c_str(), "", rig_device(), rig_options()).code(), Code::io);
    RigFrame frame(rig_device(), 0);
    EXPECT_EQ(writer.add(frame.captured).code(), Code::state);
    RecordingOptions options;
    options.queue_frames = 0;
    EXPECT_EQ(writer.open(folder.path("s").c_str(), "", rig_device(), options).code(),
              Code::invalid_argument);
    EXPECT_FALSE(std::filesystem::exists(folder.path("s/recording.burinrec"))) << "nothing is left behind";
}

// A flipped bit anywhere costs the frames it lies in, or the header; all others are as they were.
TEST(Recording, DamageInTheMiddleCostsItsFrames) {
    const TempFolder folder;
    constexpr int kFrames = 6;
    ASSERT_NO_FATAL_FAILURE(record_rig(folder.path("r"), kFrames));
    const std::string whole = read_all(folder.path("r/recording.burinrec"));
    std::filesystem::create_directories(folder.path("d"));
    int opened = 0, worst = 0;
    for (std::size_t at = 0; at < whole.size(); at += at < 2000 ? 101 : 13) {
        std::string bytes = whole;
        bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
        const std::string path = folder.text(std::string("d/") + kRecordingName, bytes);
        RecordingReader reader;
        const Status status = reader.open(path.c_str());
        if (at < record_bytes(sizeof(RecordedHeader))) {
            ASSERT_FALSE(status.ok()) << at;
            continue;
        }
        ASSERT_TRUE(status.ok()) << at << ": " << status.text();
        ++opened;
        RecordedImages images;
        ASSERT_TRUE(images.reserve(reader).ok());
        int good = 0;
        for (int i = 0; i < reader.frame_count(); ++i) {
            const int n = static_cast<int>((reader.frame(i).t_ns - kRigStart_ns) / kRigPeriod_ns);
            bool whole_frame = true;
            for (int k = 0; k < kStreamKinds; ++k) {
                const std::uint64_t offset = reader.frame(i).recorded.images[k];
                std::vector<std::uint8_t> pixels(4096);
                RecordHead head;
                Camera camera;
                if (offset == 0) continue;
                const Status got =
                    images.read(reader, offset, static_cast<StreamKind>(k), &head, &camera, pixels.data());
                whole_frame = whole_frame && got.ok();
                if (!got.ok()) {
                    EXPECT_EQ(got.code(), Code::format);
                }
            }
            int imu = 0;
            reader.imu(reader.frame(i).recorded, &imu);
            if (!whole_frame || imu == 0) continue;
            ASSERT_NO_FATAL_FAILURE(expect_rig_frame(reader, images, i, n)) << at;
            ++good;
        }
        worst = std::max(worst, kFrames - good);
    }
    EXPECT_GT(opened, 200);
    EXPECT_LE(worst, 2) << "a colour image belongs to two frames";
}

// What a power cut leaves: heads whose payloads never reached the disk. They come after the last mark.
TEST(Recording, PayloadsThatNeverReachedTheDiskAreFoundAtOpening) {
    const TempFolder folder;
    RecordingOptions options = rig_options();
    options.sync_ns = 0;
    ASSERT_NO_FATAL_FAILURE(record_rig(folder.path("r"), 6, options));
    std::string bytes = read_all(folder.path("r/recording.burinrec"));
    bytes.resize(bytes.size() - 64);  // without the end record
    std::uint64_t image = 0;
    {
        RecordingReader reader;
        ASSERT_TRUE(reader.open(folder.path("r").c_str()).ok());
        image = reader.frame(4).recorded.images[0];
    }
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(image + 64), 32, '\0');
    const std::string path = folder.text("cut", bytes);
    RecordingReader reader;
    ASSERT_TRUE(reader.open(path.c_str()).ok());
    EXPECT_EQ(reader.frame_count(), 4);
    EXPECT_EQ(reader.findings().incomplete_frames, 2u);
    EXPECT_FALSE(reader.findings().closed);
}

// The same frames behind an image of nearly 4 GiB, which is a hole in the file.
TEST(Recording, OffsetsBeyond4GiB) {
    const TempFolder folder;
    ASSERT_NO_FATAL_FAILURE(record_rig(folder.path("r"), 5));
    std::string bytes = read_all(folder.path("r/recording.burinrec"));
    const std::size_t header = record_bytes(sizeof(RecordedHeader));
    RecordHead hole;
    hole.kind = RecordKind::image;
    hole.payload_bytes = 0xfffffff0;
    seal_head(&hole);
    const std::uint64_t moved = record_bytes(hole.payload_bytes);
    for (std::size_t at = header; at < bytes.size();) {
        RecordHead head;
        std::memcpy(&head, bytes.data() + at, sizeof head);
        if (head.kind == RecordKind::frame) {
            RecordedFrame frame;
            std::memcpy(&frame, bytes.data() + at + sizeof head, sizeof frame);
            for (std::uint64_t& offset : frame.images)
                if (offset != 0) offset += moved;
            head.payload_crc = crc32(&frame, sizeof frame);
            seal_head(&head);
            std::memcpy(bytes.data() + at, &head, sizeof head);
            std::memcpy(bytes.data() + at + sizeof head, &frame, sizeof frame);
        }
        at += record_bytes(head.payload_bytes);
    }
    const std::string path = folder.path("far");
    std::ofstream out(path, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(header));
    out.write(reinterpret_cast<const char*>(&hole), sizeof hole);
    out.seekp(static_cast<std::streamoff>(header + moved));
    out.write(bytes.data() + header, static_cast<std::streamsize>(bytes.size() - header));
    out.close();
    ASSERT_GT(std::filesystem::file_size(path), std::uintmax_t{1} << 32);
    RecordingReader reader;
    ASSERT_TRUE(reader.open(path.c_str()).ok());
    ASSERT_EQ(reader.frame_count(), 5);
    EXPECT_GT(reader.frame(4).recorded.images[0], std::uint64_t{1} << 32);
}

TEST(Recording, WhatIsNoneIsToldInOneLine) {
    const TempFolder folder;
    RecordingReader reader;
    EXPECT_EQ(reader.open(folder.path("none").c_str()).code(), Code::io);
    EXPECT_EQ(reader.open(folder.path().c_str()).code(), Code::io);
    EXPECT_EQ(reader.open("/dev/null").code(), Code::io);
    EXPECT_EQ(reader.open(folder.text("empty", "").c_str()).code(), Code::format);
    EXPECT_EQ(reader.open(folder.text("text", std::string(5000, 'x')).c_str()).code(), Code::format);
    ASSERT_NO_FATAL_FAILURE(record_rig(folder.path("r"), 1));
    std::string bytes = read_all(folder.path("r/recording.burinrec"));
    const auto with_header = [&](auto change) {
        RecordHead head;
        RecordedHeader header;
        std::memcpy(&head, bytes.data(), sizeof head);
        std::memcpy(&header, bytes.data() + sizeof head, sizeof header);
        change(header);
        head.payload_crc = crc32(&header, sizeof header);
        seal_head(&head);
        std::string changed = bytes;
        std::memcpy(changed.data(), &head, sizeof head);
        std::memcpy(changed.data() + sizeof head, &header, sizeof header);
        const Status status = reader.open(folder.text("changed", changed).c_str());
        EXPECT_EQ(std::string(status.text()).find('\n'), std::string::npos);
        return status.code();
    };
    EXPECT_EQ(with_header([](RecordedHeader&) {}), Code::ok);
    EXPECT_EQ(with_header([](RecordedHeader& h) { h.version = 2; }), Code::unsupported);
    EXPECT_EQ(with_header([](RecordedHeader& h) { std::memset(h.name, 'x', sizeof h.name); }), Code::format);
    EXPECT_EQ(with_header([](RecordedHeader& h) { h.streams[0].width = 20000; }), Code::format);
    EXPECT_EQ(with_header([](RecordedHeader& h) { h.streams[1].height = 0; }), Code::format);
    EXPECT_EQ(with_header([](RecordedHeader& h) { h.streams[0].pixels = 0; }), Code::format);
    EXPECT_EQ(with_header([](RecordedHeader& h) { h.streams[0].unit_m = -1; }), Code::format);
    EXPECT_EQ(with_header([](RecordedHeader& h) { h.streams[1].camera.fx = 0; }), Code::format);
    EXPECT_EQ(with_header([](RecordedHeader& h) { h.T_camera_imu.R[0] = 2; }), Code::format);
    EXPECT_EQ(with_header([](RecordedHeader& h) {
                  for (RecordedStream& s : h.streams) s.width = s.height = 0;
              }),
              Code::format);
}

}  // namespace
}  // namespace burin
