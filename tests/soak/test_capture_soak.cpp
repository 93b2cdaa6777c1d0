// SPDX-License-Identifier: MIT
// A sensor for a very long time, and opened and closed very often: resident memory and open files must be
// flat.
//     BURIN_SOAK_FRAMES=100000 build/release/tests/soak/test_capture_soak
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "burin/capture.h"

namespace burin {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr long kAllowedBytes =
    65536;  // the kernel maps 16 pages of a library at a time; a byte a frame is found

long resident_bytes() {
    long all = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> all >> resident;
    return resident * sysconf(_SC_PAGESIZE);
}

long wanted_frames() {
    const char* wanted = std::getenv("BURIN_SOAK_FRAMES");
    return wanted ? std::atol(wanted) : 0;
}

TEST(CaptureSoak, ResidentMemoryIsFlatOverFrames) {
    const long frames = wanted_frames();
    if (frames == 0) GTEST_SKIP() << "SKIPPED: set BURIN_SOAK_FRAMES, 100000 for the real run";
    burin_source source = {0, 0};
    burin_source_options o = burin_source_options_default();
    o.lossless = 1;
    ASSERT_EQ(burin_source_open("null:320x240@1000", &o, &source), BURIN_OK);
    ASSERT_EQ(burin_source_start(source), BURIN_OK);
    long settled = 0;
    for (long i = 0; i < frames; ++i) {
        burin_captured_frame frame = {};
        frame.struct_size = sizeof frame;
        ASSERT_EQ(burin_source_next(source, kSecond, &frame), BURIN_OK) << burin_source_error(source);
        ASSERT_EQ(frame.images[BURIN_STREAM_DEPTH].lost, 0u);
        if (i == frames / 10) settled = resident_bytes();
    }
    const long grown = resident_bytes() - settled;
    std::printf("%ld frames, %ld KiB resident, %+ld KiB since the first tenth\n", frames,
                resident_bytes() / 1024, grown / 1024);
    EXPECT_LE(grown, kAllowedBytes);
    burin_source_close(&source);
}

TEST(CaptureSoak, TenThousandCyclesLeakNothing) {
    if (wanted_frames() == 0) GTEST_SKIP() << "SKIPPED: set BURIN_SOAK_FRAMES";
    long settled = 0;
    const int first_file = ::dup(0);
    ::close(first_file);
    for (int i = 0; i < 10000; ++i) {
        burin_source source = {0, 0};
        burin_captured_frame frame = {};
        frame.struct_size = sizeof frame;
        ASSERT_EQ(burin_source_open("null:64x48@1000", nullptr, &source), BURIN_OK);
        ASSERT_EQ(burin_source_start(source), BURIN_OK);
        ASSERT_EQ(burin_source_next(source, kSecond, &frame), BURIN_OK);
        ASSERT_EQ(burin_source_close(&source), BURIN_OK);
        if (i == 1000) settled = resident_bytes();
    }
    const int last_file = ::dup(0);
    ::close(last_file);
    std::printf("10000 cycles, %+ld KiB since the first thousand\n", (resident_bytes() - settled) / 1024);
    EXPECT_LE(resident_bytes() - settled, kAllowedBytes);
    EXPECT_EQ(first_file, last_file);
}

}  // namespace
}  // namespace burin
