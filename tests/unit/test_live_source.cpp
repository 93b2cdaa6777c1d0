// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <unistd.h>

#include <string>
#include <vector>

#include "capture/live_source.h"
#include "capture/monotonic.h"
#include "platform/null/null_backend.h"
#include "unit/scripted_backend.h"

namespace burin {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

class LiveSourceTest : public testing::Test {
  protected:
    void SetUp() override { script = &script_; }
    void TearDown() override {
        source.close();
        EXPECT_EQ(script_.opens, script_.closes);
        EXPECT_EQ(script_.lent, script_.given_back) << "every lent image comes back, once";
        EXPECT_TRUE(script_.out.empty());
    }
    void open(unsigned streams = stream_bit(StreamKind::depth) | stream_bit(StreamKind::colour)) {
        options.device.streams = streams;
        options.log = [](void* user, LogLevel, const char* line) {
            auto* self = static_cast<LiveSourceTest*>(user);
            const std::lock_guard lock(self->log_mutex);
            self->lines.emplace_back(line);
        };
        options.log_user = this;
        const Status opened = source.open(kScriptedBackend, "it", options);
        ASSERT_TRUE(opened.ok()) << opened.text();
        const Status started = source.start();
        ASSERT_TRUE(started.ok()) << started.text();
    }
    // The sequence number that the depth image carries in its first pixel.
    static std::uint16_t first_pixel(const CapturedFrame& frame) {
        std::uint16_t first;
        std::memcpy(&first, frame.at(StreamKind::depth).pixels, 2);
        return first;
    }
    bool logged(const std::string& text) {
        const std::lock_guard lock(log_mutex);
        for (const std::string& line : lines)
            if (line.find(text) != std::string::npos) return true;
        return false;
    }

    Script script_;
    LiveOptions options;
    LiveSource source;
    CapturedFrame frame;
    std::mutex log_mutex;
    std::vector<std::string> lines;
};

TEST_F(LiveSourceTest, DepthComesWithTheColourOfItsTime) {
    open();
    for (int i = 0; i < 50; ++i) {
        ASSERT_TRUE(source.next(kSecond, &frame).ok());
        ASSERT_TRUE(frame.has(StreamKind::depth) && frame.has(StreamKind::colour));
        EXPECT_EQ(first_pixel(frame), frame.at(StreamKind::depth).stamp.sequence);
        EXPECT_EQ(frame.at(StreamKind::colour).stamp.sequence, frame.at(StreamKind::depth).stamp.sequence);
        EXPECT_EQ(frame.at(StreamKind::colour).pixels[5], frame.at(StreamKind::depth).stamp.sequence & 255);
    }
    const SourceStatistics s = source.statistics();
    EXPECT_EQ(s.frames, 50u);
    EXPECT_EQ(s.streams[0].lost, 0u);
    EXPECT_EQ(s.streams[0].damaged, 0u);
    EXPECT_LT(s.wait_p50_ms, 3) << "paired at once, not after the next colour image";
}

TEST_F(LiveSourceTest, SlowerColourIsSharedByTheDepthImagesAroundIt) {
    script_.colour_every = 3;
    open();
    int with_colour = 0;
    for (int i = 0; i < 60; ++i) {
        ASSERT_TRUE(source.next(kSecond, &frame).ok());
        if (!frame.has(StreamKind::colour)) continue;
        ++with_colour;
        const auto depth = static_cast<std::int64_t>(frame.at(StreamKind::depth).stamp.sequence);
        EXPECT_LE(std::abs(static_cast<std::int64_t>(frame.at(StreamKind::colour).stamp.sequence) - depth),
                  1);
    }
    EXPECT_GE(with_colour, 18) << "at least its own depth image";
}

TEST_F(LiveSourceTest, WithoutColourThereIsDepthAlone) {
    script_.colour_every = 0;
    open();
    for (int i = 0; i < 20; ++i) {
        ASSERT_TRUE(source.next(kSecond, &frame).ok());
        EXPECT_FALSE(frame.has(StreamKind::colour));
    }
}

TEST_F(LiveSourceTest, NewestFramesWinAgainstASlowConsumer) {
    for (const bool lend : {false, true}) {
        script_.lend = lend;
        open(stream_bit(StreamKind::depth));
        std::uint16_t last = 0;
        for (int i = 0; i < 5; ++i) {
            ::usleep(100'000);  // twenty images
            ASSERT_TRUE(source.next(kSecond, &frame).ok());
            if (i > 0) {
                EXPECT_GT(first_pixel(frame), last + 10);
            }
            last = first_pixel(frame);
        }
        const SourceStatistics s = source.statistics();
        EXPECT_GT(s.streams[0].dropped, 60u);
        EXPECT_EQ(s.streams[0].lost, 0u) << "the driver lost none";
        EXPECT_LE(s.streams[0].captured - s.streams[0].dropped - s.streams[0].delivered, 3u) << "what waits";
        source.close();
    }
}

TEST_F(LiveSourceTest, LosslessHandsOutEveryImage) {
    options.lossless = true;
    script_.period_ns = 500'000;
    open();
    for (int i = 0; i < 200; ++i) {
        if (i % 50 == 0) ::usleep(50'000);
        ASSERT_TRUE(source.next(kSecond, &frame).ok());
        ASSERT_EQ(first_pixel(frame), i);
        ASSERT_TRUE(frame.has(StreamKind::colour));
    }
    const SourceStatistics s = source.statistics();
    EXPECT_EQ(s.streams[0].dropped + s.streams[1].dropped, 0u);
}

TEST_F(LiveSourceTest, ConsumerThatIsSlowForSecondsIsNoSilenceOfTheDevice) {
    options.lossless = true;
    open();
    ASSERT_TRUE(source.next(kSecond, &frame).ok());
    ::usleep(1'500'000);
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(source.next(kSecond, &frame).ok());
    EXPECT_EQ(source.statistics().restarts, 0u);
}

TEST_F(LiveSourceTest, GapsAreLossesBeforeTheImageThatTellsThem) {
    open(stream_bit(StreamKind::depth));
    ASSERT_TRUE(source.next(kSecond, &frame).ok());
    script_.skip = 7;
    std::uint64_t lost = 0;
    for (int i = 0; i < 20; ++i) {
        ASSERT_TRUE(source.next(kSecond, &frame).ok());
        lost += frame.at(StreamKind::depth).lost;
    }
    EXPECT_EQ(lost, 7u);
    EXPECT_EQ(source.statistics().streams[0].lost, 7u);
}

TEST_F(LiveSourceTest, DamagedImagesAreCountedAndDeliveredOnlyWhenAskedFor) {
    open(stream_bit(StreamKind::depth));
    ASSERT_TRUE(source.next(kSecond, &frame).ok());
    script_.damaged = true;
    ::usleep(50'000);
    while (source.next(0, &frame).ok()) EXPECT_FALSE(frame.at(StreamKind::depth).stamp.damaged);
    EXPECT_EQ(source.next(30'000'000, &frame).code(), Code::timeout);
    EXPECT_GT(source.statistics().streams[0].damaged, 5u);
    source.close();
    options.keep_damaged = true;
    open(stream_bit(StreamKind::depth));
    ASSERT_TRUE(source.next(kSecond, &frame).ok());
    EXPECT_TRUE(frame.at(StreamKind::depth).stamp.damaged);
}

TEST_F(LiveSourceTest, UnpluggedIsAStateAndReplugResumesWithinTwoSeconds) {
    for (const bool lend : {false, true}) {
        script_.lend = lend;
        open();
        ASSERT_TRUE(source.next(kSecond, &frame).ok());
        script_.plugged = false;
        Status status;
        for (int i = 0; i < 100 && status.code() != Code::disconnected; ++i)
            status = source.next(20'000'000, &frame);
        EXPECT_EQ(status.code(), Code::disconnected) << status.text();
        EXPECT_EQ(source.state(), SourceState::unplugged);
        EXPECT_TRUE(logged("pulled out"));
        script_.plugged = true;
        const std::int64_t back_ns = monotonic_ns();
        do status = source.next(100'000'000, &frame);
        while (status.code() == Code::disconnected && monotonic_ns() - back_ns < 5 * kSecond);
        EXPECT_TRUE(status.ok()) << status.text();
        EXPECT_LT(monotonic_ns() - back_ns, 2 * kSecond);
        EXPECT_EQ(source.statistics().reconnects, 1u);
        EXPECT_TRUE(logged("is back"));
        source.close();
    }
}

TEST_F(LiveSourceTest, WithoutReconnectUnpluggedEndsIt) {
    options.reconnect = false;
    open();
    ASSERT_TRUE(source.next(kSecond, &frame).ok());
    script_.plugged = false;
    ::usleep(50'000);
    while (source.next(0, &frame).ok()) {
    }
    EXPECT_EQ(source.next(10 * kSecond, &frame).code(), Code::disconnected)
        << "at once, not after ten seconds";
    EXPECT_TRUE(source.stop().ok());
}

TEST_F(LiveSourceTest, DeviceThatFallsSilentIsStartedAgain) {
    open();
    ASSERT_TRUE(source.next(kSecond, &frame).ok());
    script_.silent = true;
    ::usleep(1'200'000);
    EXPECT_TRUE(logged("has sent nothing")) << "said";
    script_.silent = false;
    Status status;
    do status = source.next(kSecond, &frame);
    while (status.ok() && source.statistics().restarts == 0);
    EXPECT_TRUE(status.ok()) << status.text();
    EXPECT_EQ(source.state(), SourceState::streaming);
}

TEST_F(LiveSourceTest, DeviceThatSendsNonsenseFailsAfterThreeRestarts) {
    open();
    ASSERT_TRUE(source.next(kSecond, &frame).ok());
    script_.fail_pump = true;
    Status status;
    for (int i = 0; i < 200 && (status.ok() || status.code() == Code::timeout); ++i)
        status = source.next(kSecond, &frame);
    EXPECT_EQ(status.code(), Code::format) << status.text();
    EXPECT_EQ(source.state(), SourceState::failed);
    EXPECT_EQ(source.statistics().restarts, 3u);
    // And may be started anew when it has come to its senses.
    script_.fail_pump = false;
    ASSERT_TRUE(source.stop().ok());
    ASSERT_TRUE(source.start().ok());
    EXPECT_TRUE(source.next(kSecond, &frame).ok());
}

TEST_F(LiveSourceTest, EndComesAfterTheLastFrame) {
    options.lossless = true;
    script_.end_after = 12;
    open();
    int frames = 0;
    Status status;
    while ((status = source.next(kSecond, &frame)).ok()) ++frames;
    EXPECT_EQ(status.code(), Code::ended) << status.text();
    EXPECT_EQ(frames, 12);
}

TEST_F(LiveSourceTest, ReadingsOfTheInertialSensorBracketTheFrames) {
    script_.imu = true;
    // The first readings come before the clocks' relation is known. A device whose clock is far ahead must
    // not have them stand in the way of all others.
    for (const std::int64_t clock_ns : {std::int64_t{77}, monotonic_ns() + 3'600'000'000'000}) {
        script_.clock_ns = clock_ns;
        open(stream_bit(StreamKind::depth));
        std::int64_t last_ns = 0;
        int bracketed = 0;
        for (int i = 0; i < 30; ++i) {
            ASSERT_TRUE(source.next(kSecond, &frame).ok());
            for (int s = 0; s + 1 < frame.imu_count; ++s) EXPECT_LT(frame.imu[s].t_ns, frame.imu[s + 1].t_ns);
            if (i > 0 && frame.imu_count > 0) {
                EXPECT_GT(frame.imu[0].t_ns, last_ns - 1'000'000);
            }
            bracketed += frame.imu_count > 0 && frame.imu[0].t_ns <= frame.t_ns;
            EXPECT_GT(frame.t_ns, last_ns);
            last_ns = frame.t_ns;
        }
        EXPECT_GE(bracketed, 28) << clock_ns;
        source.close();
    }
}

// The cameras of the scripted device are the same, so that registered images are what they were.
TEST_F(LiveSourceTest, RegisteredStreamsShareACamera) {
    script_.camera = true;
    for (const RegistrationMode mode :
         {RegistrationMode::depth_to_colour, RegistrationMode::colour_to_depth}) {
        options.registration = mode;
        open();
        ASSERT_TRUE(source.next(kSecond, &frame).ok());
        ASSERT_TRUE(frame.has(StreamKind::depth) && frame.has(StreamKind::colour));
        const bool to_colour = mode == RegistrationMode::depth_to_colour;
        const StreamInfo& changed = source.info().at(to_colour ? StreamKind::depth : StreamKind::colour);
        EXPECT_EQ(changed.width, kScriptWidth);
        const CapturedImage &depth = frame.at(StreamKind::depth), &colour = frame.at(StreamKind::colour);
        std::uint16_t middle;
        std::memcpy(&middle, depth.pixels + 4 * depth.stride_bytes + 2 * 8, 2);
        EXPECT_EQ(middle, kScriptDepth_mm);
        EXPECT_EQ(colour.pixels[4 * colour.stride_bytes + (to_colour ? 8 : 3 * 8)],
                  colour.stamp.sequence & 255);
        source.close();
    }
    options.registration = RegistrationMode::depth_to_colour;
    options.device.streams = stream_bit(StreamKind::depth);
    EXPECT_EQ(source.open(kScriptedBackend, "it", options).code(), Code::unsupported);
}

TEST_F(LiveSourceTest, CallsThatDoNotFitTheStateAreRefused) {
    EXPECT_EQ(source.start().code(), Code::state);
    EXPECT_EQ(source.next(0, &frame).code(), Code::state);
    EXPECT_TRUE(source.stop().ok()) << "nothing to stop";
    open();
    EXPECT_EQ(source.open(kScriptedBackend, "it", options).code(), Code::state);
    EXPECT_EQ(source.start().code(), Code::state);
    EXPECT_EQ(source.set(SourceControl::emitter, 1).code(), Code::unsupported);
}

TEST_F(LiveSourceTest, ManyCyclesOfOpenAndClose) {
    script_.period_ns = 100'000;
    for (int i = 0; i < 300; ++i) {
        open();
        ASSERT_TRUE(source.next(kSecond, &frame).ok());
        source.close();
    }
}

TEST(NullBackend, DeliversItsRampThroughALiveSource) {
    LiveSource source;
    LiveOptions options;
    options.lossless = true;
    ASSERT_TRUE(source.open(kNullBackend, "64x48@500", options).ok());
    ASSERT_TRUE(source.start().ok());
    for (std::uint64_t n = 0; n < 20; ++n) {
        CapturedFrame frame;
        ASSERT_TRUE(source.next(kSecond, &frame).ok());
        const CapturedImage& depth = frame.at(StreamKind::depth);
        ASSERT_EQ(depth.stamp.sequence, n);
        ASSERT_EQ(depth.stride_bytes, 128u);
        for (int y = 0; y < 48; ++y)
            for (int x = 0; x < 64; ++x) {
                std::uint16_t mm;
                std::memcpy(&mm, depth.pixels + y * 128 + 2 * x, 2);
                ASSERT_EQ(mm, null_depth_mm(x, y, n));
            }
        ASSERT_TRUE(frame.has(StreamKind::colour));
    }
    LiveSource other;
    EXPECT_EQ(other.open(kNullBackend, "64x", options).code(), Code::invalid_argument);
    EXPECT_EQ(other.open(kNullBackend, "0x48@30", options).code(), Code::invalid_argument);
}

}  // namespace
}  // namespace burin
