// SPDX-License-Identifier: MIT
// The back end of OpenNI2 against Debian's OpenNI2 itself: a driver of ours for a device, OpenNI2's own
// recorder and player for .oni files.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "capture/live_source.h"
#include "capture/monotonic.h"
#include "openni2/ramp.h"
#include "platform/openni2/openni2_backend.h"
#include "platform/openni2/openni2_library.h"

namespace burin {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
const std::string kUnplug = BURIN_OPENNI2_FOLDER "/unplugged";

class Openni2Test : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        std::filesystem::remove(kUnplug);
        ::setenv("BURIN_RAMP_UNPLUG", kUnplug.c_str(), 1);
        // A copy of the library beside a folder of drivers with ours; the back end then finds this one by its
        // name.
        handle = ::dlopen(BURIN_OPENNI2_FOLDER "/libOpenNI2.so.0", RTLD_NOW | RTLD_LOCAL);
        ASSERT_NE(handle, nullptr) << ::dlerror();
    }
    Status open(const char* address, bool lossless = true, bool lend = true) {
        LiveOptions o;
        o.lossless = lossless;
        o.device.lend = lend;
        BURIN_TRY(source.open(kOpenni2Backend, address, o));
        return source.start();
    }
    template <class F>
    static F* symbol(const char* name) {
        return reinterpret_cast<F*>(::dlsym(handle, name));
    }
    // Every pixel of depth and, where it came, of colour.
    void expect_ramp() {
        const CapturedImage &depth = frame.at(StreamKind::depth), &colour = frame.at(StreamKind::colour);
        const auto n = static_cast<int>(depth.stamp.sequence);
        long wrong = 0;
        for (int y = 0; y < kRampHeight; ++y)
            for (int x = 0; x < kRampWidth; ++x) {
                std::uint16_t mm;
                std::memcpy(&mm, depth.pixels + static_cast<std::size_t>(y) * depth.stride_bytes + 2 * x, 2);
                wrong += mm != ramp_depth_mm(x, y, n);
                if (!colour.pixels) continue;
                for (int c = 0; c < 3; ++c)
                    wrong += colour.pixels[static_cast<std::size_t>(y) * colour.stride_bytes + 3 * x + c] !=
                             ramp_colour(x, y, c, static_cast<int>(colour.stamp.sequence));
            }
        EXPECT_EQ(wrong, 0) << "frame " << n;
        EXPECT_EQ(depth.stamp.device_ns, static_cast<std::int64_t>(n) * 1000000 / kRampFps * 1000);
    }

    static inline void* handle = nullptr;
    LiveSource source;
    CapturedFrame frame;
};

TEST_F(Openni2Test, DeviceIsListedAndStreamsDepthWithItsColour) {
    bool found = false;
    ASSERT_TRUE(kOpenni2Backend
                    .list(
                        [](void* user, const DeviceEntry& e) {
                            *static_cast<bool*>(user) |= std::strcmp(e.address, "ramp:device") == 0;
                        },
                        &found)
                    .ok());
    EXPECT_TRUE(found);
    for (const bool lend : {true, false}) {
        const Status opened = open("ramp:device", true, lend);
        ASSERT_TRUE(opened.ok()) << opened.text();
        EXPECT_NEAR(source.info().at(StreamKind::depth).camera.fx, kRampWidth / (2 * std::tan(1.0145 / 2)),
                    0.01);
        int with_colour = 0;
        for (int i = 0; i < 40; ++i) {
            const Status got = source.next(kSecond, &frame);
            ASSERT_TRUE(got.ok()) << got.text();
            expect_ramp();
            if (!frame.has(StreamKind::colour)) continue;
            ++with_colour;
            EXPECT_EQ(frame.at(StreamKind::colour).stamp.sequence,
                      frame.at(StreamKind::depth).stamp.sequence);
        }
        EXPECT_GE(with_colour, 38);
        source.close();
    }
}

TEST_F(Openni2Test, RecordingOfItsOwnRecorderPlaysBackEveryPixel) {
    const std::string path = BURIN_OPENNI2_FOLDER "/take.oni";
    std::filesystem::remove(path);
    const Openni2* oni = nullptr;
    ASSERT_TRUE(load_openni2(&oni).ok());
    OniDeviceHandle device = nullptr;
    OniStreamHandle stream = nullptr;
    OniRecorderHandle recorder = nullptr;
    ASSERT_EQ(oni->device_open("ramp:device", &device), ONI_STATUS_OK) << openni2_error(*oni);
    ASSERT_EQ(oni->create_stream(device, ONI_SENSOR_DEPTH, &stream), ONI_STATUS_OK);
    ASSERT_EQ(symbol<decltype(oniCreateRecorder)>("oniCreateRecorder")(path.c_str(), &recorder),
              ONI_STATUS_OK);
    ASSERT_EQ(symbol<decltype(oniRecorderAttachStream)>("oniRecorderAttachStream")(recorder, stream, FALSE),
              ONI_STATUS_OK);
    ASSERT_EQ(symbol<decltype(oniRecorderStart)>("oniRecorderStart")(recorder), ONI_STATUS_OK);
    ASSERT_EQ(oni->start_stream(stream), ONI_STATUS_OK);
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    symbol<decltype(oniRecorderStop)>("oniRecorderStop")(recorder);
    symbol<decltype(oniRecorderDestroy)>("oniRecorderDestroy")(&recorder);
    oni->stop_stream(stream);
    oni->destroy_stream(stream);
    oni->device_close(device);

    int at_pace = 0;
    for (const char* pace : {"?pace=fast", ""}) {
        const std::int64_t began_ns = monotonic_ns();
        const Status opened = open((path + pace).c_str());
        ASSERT_TRUE(opened.ok()) << opened.text();
        int frames = 0;
        Status got;
        while ((got = source.next(2 * kSecond, &frame)).ok()) {
            ++frames;
            long wrong = 0;
            const CapturedImage& depth = frame.at(StreamKind::depth);
            std::uint16_t first;
            std::memcpy(&first, depth.pixels, 2);
            for (int y = 0; y < kRampHeight; ++y)
                for (int x = 0; x < kRampWidth; ++x) {
                    std::uint16_t mm;
                    std::memcpy(&mm, depth.pixels + static_cast<std::size_t>(y) * depth.stride_bytes + 2 * x,
                                2);
                    wrong += mm != ramp_depth_mm(x, y, first - 500);
                }
            EXPECT_EQ(wrong, 0);
        }
        EXPECT_EQ(got.code(), Code::ended) << got.text();
        EXPECT_GE(frames, 25) << pace;
        if (*pace == 0) {
            at_pace = frames;
            EXPECT_GT(monotonic_ns() - began_ns, (frames - 2) * kSecond / kRampFps) << "at its own pace";
        }
        source.close();
    }
    EXPECT_GT(at_pace, 0);
}

TEST_F(Openni2Test, UnpluggedDeviceComesBack) {
    ASSERT_TRUE(open("ramp:device", false).ok());
    ASSERT_TRUE(source.next(kSecond, &frame).ok());
    std::ofstream(kUnplug) << "x";
    Status got;
    for (int i = 0; i < 100 && got.code() != Code::disconnected; ++i) got = source.next(30'000'000, &frame);
    EXPECT_EQ(got.code(), Code::disconnected) << got.text();
    std::filesystem::remove(kUnplug);
    const std::int64_t back_ns = monotonic_ns();
    do got = source.next(100'000'000, &frame);
    while (!got.ok() && monotonic_ns() - back_ns < 5 * kSecond);
    ASSERT_TRUE(got.ok()) << got.text();
    EXPECT_LT(monotonic_ns() - back_ns, 2 * kSecond);
    expect_ramp();
}

TEST_F(Openni2Test, ControlsAreStreamProperties) {
    ASSERT_TRUE(open("ramp:device").ok());
    ControlRange range;
    ASSERT_TRUE(source.set(SourceControl::mirror, 1).ok());
    ASSERT_TRUE(source.get(SourceControl::mirror, &range).ok());
    EXPECT_EQ(range.value, 1);
    EXPECT_EQ(source.set(SourceControl::mirror, 2).code(), Code::invalid_argument);
    EXPECT_EQ(source.set(SourceControl::laser_power_mw, 2).code(), Code::unsupported);
}

TEST_F(Openni2Test, WhatCannotBeOpenedIsSaid) {
    EXPECT_EQ(open("ramp:other").code(), Code::disconnected);
    const std::string path = BURIN_OPENNI2_FOLDER "/garbage.oni";
    std::ofstream(path) << "this is no recording";
    const Status opened = open(path.c_str());
    EXPECT_EQ(opened.code(), Code::format) << opened.text();
    EXPECT_EQ(open("x.oni?pace=slow").code(), Code::invalid_argument);
    LiveOptions o;
    o.device.depth_width = 1000;
    o.device.depth_height = 3;
    const Status none = source.open(kOpenni2Backend, "ramp:device", o);
    EXPECT_EQ(none.code(), Code::unsupported);
    EXPECT_NE(std::strstr(none.text(), "DEPTH_1_MM 320x240@60"), nullptr) << none.text();
}

}  // namespace
}  // namespace burin
