// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <chrono>
#include <mutex>

#include "capture/live_source.h"
#include "platform/replay/replay_backend.h"
#include "unit/recording_rig.h"

namespace burin {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
using Clock = std::chrono::steady_clock;

class Replay : public testing::Test {
  protected:
    Replay() { live_.lossless = live_.keep_damaged = true; }
    // Of the recording in folder_, with these options behind it.
    Status open(const std::string& options) {
        live_.device.streams = (1u << kStreamKinds) - 1;
        live_.log = [](void* user, LogLevel, const char* line) {
            auto* self = static_cast<Replay*>(user);
            const std::lock_guard lock(self->mutex_);
            self->log_ += std::string(line) + "\n";
        };
        live_.log_user = this;
        BURIN_TRY(source_.open(kReplayBackend, (folder_.path("r") + options).c_str(), live_));
        return source_.start();
    }
    // The images of the frame are those of the rig's frame n.
    void expect_frame(int n) {
        const RigFrame expected(rig_device(), n);
        for (int k = 0; k < kStreamKinds; ++k) {
            const CapturedImage &got = frame_.images[k], &was = expected.captured.images[k];
            if (!was.pixels) continue;  // of confidence, that not every frame has, a near one is paired
            ASSERT_NE(got.pixels, nullptr) << k << " of frame " << n;
            if (k == 1 && n % 2 == 1) continue;  // between two colour images
            ASSERT_EQ(got.stamp.sequence, was.stamp.sequence);
            ASSERT_EQ(got.camera.fx, was.camera.fx);
            for (int y = 0; y < rig_device().streams[k].height; ++y)
                ASSERT_EQ(std::memcmp(got.pixels + static_cast<std::size_t>(y) * got.stride_bytes,
                                      was.pixels + static_cast<std::size_t>(y) * was.stride_bytes,
                                      rig_device().streams[k].row_bytes),
                          0)
                    << stream_name(static_cast<StreamKind>(k)) << " of frame " << n;
        }
    }

    TempFolder folder_;
    LiveOptions live_;
    LiveSource source_;
    CapturedFrame frame_;
    std::mutex mutex_;
    std::string log_;
};

TEST_F(Replay, AsFastAsCanBeGivesWhatWasRecorded) {
    record_rig(folder_.path("r"), 60);
    ASSERT_TRUE(open("?pace=fast").ok());
    EXPECT_STREQ(source_.info().name, "a rig");
    EXPECT_TRUE(source_.info().has_imu);
    std::int64_t first_ns = 0, last_imu_ns = 0;
    int readings = 0;
    for (int n = 0; n < 60; ++n) {
        const Status got = source_.next(kSecond, &frame_);
        ASSERT_TRUE(got.ok()) << n << ": " << got.text();
        if (n == 0) first_ns = frame_.t_ns;
        ASSERT_EQ(frame_.t_ns - first_ns, n * kRigPeriod_ns) << "stamps keep their distances";
        ASSERT_NO_FATAL_FAILURE(expect_frame(n));
        if (n == 0) continue;
        ASSERT_EQ(frame_.imu_count, 6) << n;
        for (int i = 0; i < 6; ++i) {
            const RigFrame expected(rig_device(), n);
            const ImuSample &got_imu = frame_.imu[i], &was = expected.imu[static_cast<std::size_t>(i)];
            ASSERT_EQ(got_imu.t_ns - frame_.t_ns, was.t_ns - expected.captured.t_ns);
            ASSERT_EQ(got_imu.accel_m_s2.z, was.accel_m_s2.z);
            readings += got_imu.t_ns > last_imu_ns;
            last_imu_ns = std::max(last_imu_ns, got_imu.t_ns);
        }
    }
    EXPECT_EQ(readings, 59 * 5 + 1);
    EXPECT_EQ(source_.next(kSecond, &frame_).code(), Code::ended);
    EXPECT_EQ(source_.state(), SourceState::ended);
    const SourceStatistics s = source_.statistics();
    EXPECT_EQ(s.streams[0].delivered, 60u);
    EXPECT_EQ(s.streams[0].dropped, 0u);
    EXPECT_EQ(s.streams[0].lost, 8u) << "gaps in the sequence are gaps again";
    EXPECT_EQ(s.streams[2].damaged, 15u);
}

TEST_F(Replay, AtItsPace) {
    record_rig(folder_.path("r"), 41);
    ASSERT_TRUE(open("").ok());
    const auto began = Clock::now();
    std::int64_t before_ns = 0;
    int on_time = 0;
    for (int n = 0; n < 41; ++n) {
        ASSERT_TRUE(source_.next(kSecond, &frame_).ok());
        ASSERT_NO_FATAL_FAILURE(expect_frame(n));
        const std::int64_t host_ns = frame_.at(StreamKind::depth).stamp.host_ns;
        on_time += std::llabs(host_ns - before_ns - kRigPeriod_ns) < 5'000'000;
        before_ns = host_ns;
    }
    const double took_s = std::chrono::duration<double>(Clock::now() - began).count();
    EXPECT_GT(took_s, 0.39);
    EXPECT_LT(took_s, 2.0);
    EXPECT_GT(on_time, 20);
}

TEST_F(Replay, PausesAreCutShortOfASilentDevice) {
    const DeviceInfo info = rig_device();
    RecordingWriter writer;
    ASSERT_TRUE(writer.open(folder_.path("r").c_str(), "", info, rig_options()).ok());
    for (const int n : {0, 1, 2, 802, 803}) ASSERT_TRUE(add_rig_frame(writer, info, n).ok());  // 8 s
    ASSERT_TRUE(writer.close().ok());
    ASSERT_TRUE(open("").ok());
    const auto began = Clock::now();
    for (const int n : {0, 1, 2, 802, 803}) {
        ASSERT_TRUE(source_.next(2 * kSecond, &frame_).ok());
        ASSERT_NO_FATAL_FAILURE(expect_frame(n));
    }
    EXPECT_LT(Clock::now() - began, std::chrono::seconds(3));
    EXPECT_EQ(source_.statistics().restarts, 0u);
}

TEST_F(Replay, AgainAndAgain) {
    record_rig(folder_.path("r"), 8);
    ASSERT_TRUE(open("?pace=fast&loop=1").ok());
    std::int64_t before_ns = 0;
    for (int n = 0; n < 100; ++n) {
        ASSERT_TRUE(source_.next(kSecond, &frame_).ok());
        if (n > 0) {
            ASSERT_EQ(frame_.t_ns - before_ns, kRigPeriod_ns) << n;
        }
        before_ns = frame_.t_ns;
        ASSERT_TRUE(frame_.has(StreamKind::colour)) << n;
    }
}

TEST_F(Replay, ADamagedImageIsCountedAndTheNextComes) {
    record_rig(folder_.path("r"), 6);
    std::uint64_t at = 0;
    {
        RecordingReader reader;
        ASSERT_TRUE(reader.open(folder_.path("r").c_str()).ok());
        at = reader.frame(2).recorded.images[0] + sizeof(RecordHead) + 5;
    }
    std::fstream file(folder_.path("r/recording.burinrec"), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(at)).put('\x55');
    file.close();
    live_.device.streams = stream_bit(StreamKind::depth);
    ASSERT_TRUE(open("?pace=fast").ok());
    for (const int n : {0, 1, 3, 4, 5}) {
        ASSERT_TRUE(source_.next(kSecond, &frame_).ok());
        ASSERT_EQ(frame_.at(StreamKind::depth).stamp.sequence, static_cast<std::uint64_t>(n));
    }
    EXPECT_EQ(source_.next(kSecond, &frame_).code(), Code::ended);
    EXPECT_EQ(source_.statistics().streams[0].damaged, 1u);
    const std::lock_guard lock(mutex_);
    EXPECT_NE(log_.find("is damaged: its checksum is another"), std::string::npos) << log_;
}

TEST_F(Replay, JpegOfAnyFormatComesAsRgb) {
    DeviceInfo info = rig_device(32, 16);
    StreamInfo& s = info.at(StreamKind::colour);
    s.width = 32;
    s.camera.width = 32;
    s.colour_format = PixelFormat::yuyv;
    set_image_bytes(&s);
    RecordingWriter writer;
    RecordingOptions options = rig_options();
    options.colour = RecordedColour::jpeg;
    ASSERT_TRUE(writer.open(folder_.path("r").c_str(), "", info, options).ok());
    for (int n = 0; n < 4; ++n) ASSERT_TRUE(add_rig_frame(writer, info, n).ok());
    ASSERT_TRUE(writer.close().ok());
    ASSERT_TRUE(open("?pace=fast").ok());
    EXPECT_EQ(source_.info().at(StreamKind::colour).colour_format, PixelFormat::rgb8);
    EXPECT_EQ(source_.info().at(StreamKind::colour).image_bytes, 32u * 16 * 3);
    ASSERT_TRUE(source_.next(kSecond, &frame_).ok());
    EXPECT_EQ(frame_.at(StreamKind::colour).stride_bytes, 96u);
}

TEST_F(Replay, WhatCannotBeIsToldAtOpening) {
    record_rig(folder_.path("r"), 3);
    EXPECT_EQ(open("?pace=slow").code(), Code::invalid_argument);
    EXPECT_EQ(source_.open(kReplayBackend, folder_.path("none").c_str(), live_).code(), Code::io);
    live_.device.depth_width = 640;
    live_.device.depth_height = 480;
    const Status size = open("");
    EXPECT_EQ(size.code(), Code::unsupported);
    EXPECT_NE(std::string(size.text()).find("16x12 only"), std::string::npos) << size.text();
    live_.device.depth_width = live_.device.depth_height = 0;
    std::ofstream(folder_.path("r/recording.burinrec")) << "x";
    EXPECT_EQ(open("").code(), Code::format);
}

}  // namespace
}  // namespace burin
