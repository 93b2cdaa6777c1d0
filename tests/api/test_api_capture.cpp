// SPDX-License-Identifier: MIT
// capture.h as an application uses it, on the made-up sensor.
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "api/allocation_counter.h"
#include "burin/capture.h"
#include "capture/live_source.h"
#include "platform/null/null_backend.h"

namespace burin {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

struct OpenSource {
    burin_source source = {0, 0};
    ~OpenSource() { burin_source_close(&source); }
    burin_status open(const char* address, const burin_source_options* options = nullptr) {
        return burin_source_open(address, options, &source);
    }
};

burin_captured_frame empty_frame() {
    burin_captured_frame frame = {};
    frame.struct_size = sizeof frame;
    return frame;
}

TEST(Capture, NumbersAreThoseOfTheCore) {
    EXPECT_EQ(static_cast<int>(StreamKind::confidence), BURIN_STREAM_CONFIDENCE);
    EXPECT_EQ(kStreamKinds, BURIN_STREAMS);
    EXPECT_EQ(static_cast<int>(SourceControl::close_range), BURIN_CONTROL_CLOSE_RANGE);
    EXPECT_EQ(static_cast<int>(DeviceAccess::unsupported), BURIN_DEVICE_UNSUPPORTED);
    EXPECT_EQ(static_cast<int>(LogLevel::info), BURIN_LOG_INFO);
    EXPECT_EQ(static_cast<int>(SourceState::failed), BURIN_SOURCE_FAILED);
}

TEST(Capture, BackEndsAndDevicesAreListed) {
    ASSERT_GE(burin_backend_count(), 1u);
    std::vector<std::string> names;
    for (std::uint32_t i = 0; i < burin_backend_count(); ++i) {
        char name[16], about[8], problem[512];
        ASSERT_EQ(burin_backend(i, name, sizeof name, about, sizeof about, problem, sizeof problem),
                  BURIN_OK);
        EXPECT_LT(std::strlen(about), sizeof about) << "cut, and ended by a zero";
        names.emplace_back(name);
    }
    EXPECT_EQ(names.back(), "null");
    EXPECT_EQ(burin_backend(burin_backend_count(), nullptr, 0, nullptr, 0, nullptr, 0),
              BURIN_INVALID_ARGUMENT);

    std::uint64_t count = 0;
    EXPECT_EQ(burin_devices(nullptr, 0, &count), BURIN_INSUFFICIENT_MEMORY);
    ASSERT_GE(count, 1u);
    std::vector<burin_device> devices(count + 8);
    ASSERT_EQ(burin_devices(devices.data(), devices.size(), &count), BURIN_OK);
    EXPECT_STREQ(devices[count - 1].address, "null:");
    EXPECT_EQ(devices[count - 1].access, static_cast<std::uint32_t>(BURIN_DEVICE_READY));
    EXPECT_EQ(burin_devices(nullptr, 0, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_devices(nullptr, 1, &count), BURIN_INVALID_ARGUMENT);
}

// Of libcamera this is what the tests see: no camera that it has a handler for can be emulated here.
TEST(Capture, CamerasThatAreNotThereAreSaidToBe) {
    for (std::uint32_t i = 0; i < burin_backend_count(); ++i) {
        char name[16];
        ASSERT_EQ(burin_backend(i, name, sizeof name, nullptr, 0, nullptr, 0), BURIN_OK);
        if (std::strcmp(name, "libcamera") != 0) continue;
        OpenSource s;
        EXPECT_EQ(s.open("libcamera:/no/such/camera"), BURIN_DISCONNECTED) << burin_source_error({0, 0});
        EXPECT_NE(std::strstr(burin_source_error({0, 0}), "/no/such/camera"), nullptr);
    }
}

TEST(Capture, OptionsHaveTheirRanges) {
    struct Bad {
        const char* says;
        void (*spoil)(burin_source_options& o);
    };
    const Bad cases[] = {
        {"size", [](burin_source_options& o) { o.struct_size += 8; }},
        {"streams", [](burin_source_options& o) { o.streams = 0; }},
        {"streams", [](burin_source_options& o) { o.streams = 32; }},
        {"both", [](burin_source_options& o) { o.depth_width = 640; }},
        {"side", [](burin_source_options& o) { o.colour_width = o.colour_height = 100000; }},
        {"fps", [](burin_source_options& o) { o.fps = -1; }},
        {"fps", [](burin_source_options& o) { o.fps = 1e30; }},
        {"flag", [](burin_source_options& o) { o.lossless = 2; }},
        {"waiting_frames", [](burin_source_options& o) { o.waiting_frames = 0; }},
        {"waiting_frames", [](burin_source_options& o) { o.waiting_frames = 33; }},
        {"reserved", [](burin_source_options& o) { o.reserved[7] = 1; }},
        {"depth_format",
         [](burin_source_options& o) { o.depth_format = "a name much longer than any format's"; }},
    };
    for (const Bad& bad : cases) {
        burin_source_options o = burin_source_options_default();
        bad.spoil(o);
        OpenSource s;
        EXPECT_EQ(s.open("null:", &o), BURIN_INVALID_ARGUMENT) << bad.says;
        EXPECT_NE(std::strstr(burin_source_error({0, 0}), bad.says), nullptr) << burin_source_error({0, 0});
    }
    OpenSource s;
    EXPECT_EQ(s.open("nothing:here"), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(s.open("no colon"), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(s.open(nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_source_open("null:", nullptr, nullptr), BURIN_INVALID_ARGUMENT);
}

TEST(Capture, HandlesThatAreStaleAreRecognised) {
    burin_captured_frame frame = empty_frame();
    const burin_source null = {0, 0}, never = {3, 7}, beyond = {1000, 1};
    for (const burin_source s : {null, never, beyond}) {
        EXPECT_EQ(burin_source_start(s), BURIN_STATE);
        EXPECT_EQ(burin_source_next(s, 0, &frame), BURIN_STATE);
    }
    OpenSource s;
    ASSERT_EQ(s.open("null:"), BURIN_OK);
    burin_source old = s.source;
    EXPECT_EQ(burin_source_next(old, 0, &frame), BURIN_STATE) << "not started";
    EXPECT_EQ(burin_source_close(&s.source), BURIN_OK);
    EXPECT_EQ(s.source.index, 0u);
    EXPECT_EQ(burin_source_start(old), BURIN_STATE);
    EXPECT_EQ(burin_source_close(&old), BURIN_STATE);
    // Sixteen places, and a clear word when they are taken.
    std::vector<burin_source> many(16);
    for (burin_source& one : many) ASSERT_EQ(burin_source_open("null:8x8@30", nullptr, &one), BURIN_OK);
    burin_source more;
    EXPECT_EQ(burin_source_open("null:8x8@30", nullptr, &more), BURIN_STATE);
    for (burin_source& one : many) EXPECT_EQ(burin_source_close(&one), BURIN_OK);
}

TEST(Capture, FramesGoToTheMapWithoutACopy) {
    OpenSource s;
    burin_source_options o = burin_source_options_default();
    o.lossless = 1;
    ASSERT_EQ(s.open("null:64x48@200", &o), BURIN_OK);
    burin_stream_info info;
    ASSERT_EQ(burin_source_stream(s.source, BURIN_STREAM_DEPTH, &info), BURIN_OK);
    EXPECT_EQ(info.width, 64u);
    EXPECT_EQ(info.bytes_per_sample, 2u);
    ASSERT_EQ(burin_source_stream(s.source, BURIN_STREAM_INFRARED, &info), BURIN_OK);
    EXPECT_EQ(info.width, 0u) << "not delivered";
    ASSERT_EQ(burin_source_start(s.source), BURIN_OK);

    burin_config config = burin_config_default();
    config.max_width = 64;
    config.max_height = 48;
    config.voxel_m = 0.05f;
    config.budget_bytes = 16u << 20;
    std::uint64_t bytes = 0;
    ASSERT_EQ(burin_bytes(&config, &bytes), BURIN_OK);
    void* memory = std::aligned_alloc(4096, (bytes + 4095) / 4096 * 4096);
    burin_map map;
    ASSERT_EQ(burin_create(&config, memory, bytes, &map), BURIN_OK);
    burin_captured_frame captured = empty_frame();
    for (std::uint64_t n = 0; n < 5; ++n) {
        ASSERT_EQ(burin_source_next(s.source, kSecond, &captured), BURIN_OK) << burin_source_error(s.source);
        burin_frame frame;
        ASSERT_EQ(burin_frame_of_capture(s.source, &captured, &frame), BURIN_OK);
        EXPECT_EQ(frame.depth, captured.images[BURIN_STREAM_DEPTH].data);
        EXPECT_EQ(frame.colour, captured.images[BURIN_STREAM_COLOUR].data);
        EXPECT_EQ(static_cast<const std::uint16_t*>(frame.depth)[5], null_depth_mm(5, 0, n));
        burin_frame_result result;
        ASSERT_EQ(burin_integrate(map, &frame, &result), BURIN_OK) << burin_last_error(map);
        EXPECT_GT(result.chunks_fused, 0u);
    }
    burin_source_statistics statistics = {};
    EXPECT_EQ(burin_source_stats(s.source, &statistics), BURIN_INVALID_ARGUMENT) << "size";
    statistics.struct_size = sizeof statistics;
    ASSERT_EQ(burin_source_stats(s.source, &statistics), BURIN_OK);
    EXPECT_EQ(statistics.frames, 5u);
    EXPECT_EQ(statistics.state, static_cast<std::uint32_t>(BURIN_SOURCE_STREAMING));
    EXPECT_EQ(burin_source_next(s.source, -1, &captured), BURIN_INVALID_ARGUMENT);
    captured.struct_size = 4;
    EXPECT_EQ(burin_source_next(s.source, 0, &captured), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_source_set(s.source, BURIN_CONTROL_EMITTER, 1), BURIN_UNSUPPORTED);
    EXPECT_EQ(burin_source_set(s.source, 99, 1), BURIN_INVALID_ARGUMENT);
    burin_destroy(&map);
    std::free(memory);
}

TEST(Capture, SecondThreadIsRefused) {
    OpenSource s;
    burin_source_options o = burin_source_options_default();
    ASSERT_EQ(s.open("null:8x8@1", &o), BURIN_OK);
    ASSERT_EQ(burin_source_start(s.source), BURIN_OK);
    std::atomic<bool> waiting{false};
    std::thread other([&] {
        burin_captured_frame frame = empty_frame();
        waiting = true;
        EXPECT_EQ(burin_source_next(s.source, kSecond / 2, &frame), BURIN_TIMEOUT);
    });
    while (!waiting) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    burin_captured_frame frame = empty_frame();
    EXPECT_EQ(burin_source_next(s.source, 0, &frame), BURIN_STATE);
    other.join();
}

TEST(Capture, RecordingIsPlayedBackPixelForPixel) {
    char folder[] = "/tmp/burin_recorder_XXXXXX";
    ASSERT_NE(::mkdtemp(folder), nullptr);
    const std::string recording = std::string(folder) + "/take";
    burin_recorder recorder = {0, 0};
    {
        OpenSource s;
        burin_source_options o = burin_source_options_default();
        o.lossless = 1;
        ASSERT_EQ(s.open("null:64x48@200", &o), BURIN_OK);
        burin_recorder_options r = burin_recorder_options_default();
        r.queue_frames = 0;
        EXPECT_EQ(burin_recorder_open(s.source, recording.c_str(), &r, &recorder), BURIN_INVALID_ARGUMENT);
        r = burin_recorder_options_default();
        r.lossless = 1;
        r.colour = BURIN_RECORDED_LOSSLESS;
        EXPECT_EQ(burin_recorder_open({0, 0}, recording.c_str(), &r, &recorder), BURIN_STATE);
        ASSERT_EQ(burin_recorder_open(s.source, recording.c_str(), &r, &recorder), BURIN_OK)
            << burin_recorder_error({0, 0});
        ASSERT_EQ(burin_source_start(s.source), BURIN_OK);
        burin_captured_frame captured = empty_frame();
        for (int i = 0; i < 10; ++i) {
            ASSERT_EQ(burin_source_next(s.source, kSecond, &captured), BURIN_OK);
            ASSERT_EQ(burin_recorder_add(recorder, &captured), BURIN_OK) << burin_recorder_error(recorder);
        }
        captured.images[BURIN_STREAM_DEPTH].camera.width = 4096;
        EXPECT_EQ(burin_recorder_add(recorder, &captured), BURIN_INVALID_ARGUMENT) << "not of this source";
    }
    ASSERT_EQ(burin_recorder_finish(recorder), BURIN_OK);
    burin_captured_frame none = empty_frame();
    EXPECT_EQ(burin_recorder_add(recorder, &none), BURIN_STATE);
    burin_recorder_statistics statistics = {};
    statistics.struct_size = sizeof statistics;
    ASSERT_EQ(burin_recorder_stats(recorder, &statistics), BURIN_OK);
    EXPECT_EQ(statistics.frames, 10u);
    EXPECT_EQ(burin_recorder_close(&recorder), BURIN_OK);
    EXPECT_EQ(burin_recorder_close(&recorder), BURIN_STATE);

    OpenSource replay;
    burin_source_options o = burin_source_options_default();
    o.lossless = 1;
    ASSERT_EQ(replay.open(("replay:" + recording + "?pace=fast").c_str(), &o), BURIN_OK)
        << burin_source_error({0, 0});
    ASSERT_EQ(burin_source_start(replay.source), BURIN_OK);
    burin_captured_frame captured = empty_frame();
    for (std::uint64_t n = 0; n < 10; ++n) {
        ASSERT_EQ(burin_source_next(replay.source, kSecond, &captured), BURIN_OK)
            << burin_source_error(replay.source);
        const burin_image& depth = captured.images[BURIN_STREAM_DEPTH];
        for (int y = 0; y < 48; ++y)
            for (int x = 0; x < 64; ++x) {
                std::uint16_t mm;
                std::memcpy(&mm,
                            static_cast<const char*>(depth.data) +
                                static_cast<std::uint64_t>(y) * depth.stride_bytes + 2 * x,
                            2);
                ASSERT_EQ(mm, null_depth_mm(x, y, n));
            }
        EXPECT_NE(captured.images[BURIN_STREAM_COLOUR].data, nullptr);
    }
    EXPECT_EQ(burin_source_next(replay.source, kSecond, &captured), BURIN_ENDED);
    std::filesystem::remove_all(folder);
}

#ifdef BURIN_COUNT_ALLOCATIONS
TEST(Capture, NothingIsAllocatedWhileFramesStream) {
    if (under_valgrind()) GTEST_SKIP() << "valgrind has the allocations";
    for (const std::uint32_t lossless : {0u, 1u}) {
        OpenSource s;
        burin_source_options o = burin_source_options_default();
        o.lossless = lossless;
        ASSERT_EQ(s.open("null:64x48@1000", &o), BURIN_OK);
        ASSERT_EQ(burin_source_start(s.source), BURIN_OK);
        burin_captured_frame captured = empty_frame();
        ASSERT_EQ(burin_source_next(s.source, kSecond, &captured), BURIN_OK);
        const long probed = allocations;
        {
            void* volatile probe = std::malloc(8);  // the counter counts
            std::free(probe);
        }
        ASSERT_GT(allocations.load(), probed);
        const long before = allocations;
        for (int i = 0; i < 500; ++i) {
            burin_frame frame;
            if (burin_source_next(s.source, kSecond, &captured) != BURIN_OK ||
                burin_frame_of_capture(s.source, &captured, &frame) != BURIN_OK)
                break;
        }
        EXPECT_EQ(allocations - before, 0);
    }
}
#endif

}  // namespace
}  // namespace burin
