// SPDX-License-Identifier: MIT
// Once a recording is open neither it nor its reader allocates: malloc and its kin are counted on all
// threads. JPEG is the exception (libjpeg takes working memory for each image), and must give it all back.
#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>

#include "unit/recording_rig.h"

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define BURIN_COUNT_ALLOCATIONS 1
namespace {
std::atomic<long> allocations{0};
}
// Visible to the shared libraries too: operator new calls malloc from within one.
#pragma GCC visibility push(default)
extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* malloc(size_t bytes) {
    ++allocations;
    return __libc_malloc(bytes);
}
void* calloc(size_t count, size_t bytes) {
    ++allocations;
    return __libc_calloc(count, bytes);
}
void* realloc(void* p, size_t bytes) {
    ++allocations;
    return __libc_realloc(p, bytes);
}
}
#pragma GCC visibility pop
#endif

namespace burin {
namespace {

#ifdef BURIN_COUNT_ALLOCATIONS

// Frames whose sizes once coded differ as much as they can: what a coder might want more or less memory for.
void write_frames(RecordingWriter& writer, std::vector<RigFrame*>& frames, const DeviceInfo& info,
                  int count) {
    for (int n = 0; n < count; ++n) {
        RigFrame& frame = *frames[static_cast<std::size_t>(n) % frames.size()];
        CapturedFrame captured = frame.captured;
        captured.t_ns += n * kRigPeriod_ns;
        captured.imu_count = 0;
        for (CapturedImage& image : captured.images) image.stamp.sequence = static_cast<std::uint64_t>(n);
        ASSERT_TRUE(writer.add(captured).ok());
    }
    ASSERT_EQ(info.streams[0].kind, StreamKind::depth);
}

TEST(RecordingMemory, NothingIsAllocatedWhileFramesStream) {
    const DeviceInfo info = rig_device(160, 120);
    std::vector<std::unique_ptr<RigFrame>> owned;
    std::vector<RigFrame*> frames;
    for (int n = 0; n < 6; ++n) {
        owned.push_back(std::make_unique<RigFrame>(info, n));
        frames.push_back(owned.back().get());
    }
    std::fill(owned[1]->pixels[0].begin(), owned[1]->pixels[0].end(), std::uint8_t{0});
    Rng rng(1);
    for (std::uint8_t& b : owned[2]->pixels[0]) b = static_cast<std::uint8_t>(rng.next());
    const TempFolder folder;
    for (const RecordedColour colour : {RecordedColour::lossless, RecordedColour::raw}) {
        RecordingOptions options = rig_options();
        options.colour = colour;
        options.sync_ns = 20'000'000;
        const std::string path = folder.path(std::to_string(static_cast<int>(colour)));
        RecordingWriter writer;
        allocations = 0;
        ASSERT_TRUE(writer.open(path.c_str(), "", info, options).ok());
        EXPECT_GT(allocations, 0) << "the counter counts";
        allocations = 0;
        write_frames(writer, frames, info, 600);
        writer.log(LogLevel::info, "a line");
        while (writer.statistics().frames < 600) std::this_thread::yield();
        EXPECT_EQ(allocations, 0);
        ASSERT_TRUE(writer.close().ok());

        RecordingReader reader;
        ASSERT_TRUE(reader.open(path.c_str()).ok());
        RecordedImages images;
        ASSERT_TRUE(images.reserve(reader).ok());
        std::vector<std::uint8_t> pixels(1 << 20);
        int failed = 0;
        const auto read_all = [&] {
            for (int i = 0; i < reader.frame_count(); ++i)
                for (int k = 0; k < kStreamKinds; ++k) {
                    RecordHead head;
                    Camera camera;
                    const std::uint64_t offset = reader.frame(i).recorded.images[k];
                    failed += offset != 0 && !images
                                                  .read(reader, offset, static_cast<StreamKind>(k), &head,
                                                        &camera, pixels.data())
                                                  .ok();
                }
        };
        allocations = 0;
        read_all();
        EXPECT_EQ(allocations, 0);
        EXPECT_EQ(failed, 0);
    }
}

#else

TEST(RecordingMemory, NothingIsAllocatedWhileFramesStream) {
    GTEST_SKIP() << "allocations are counted with glibc and without sanitizers only";
}

#endif

}  // namespace
}  // namespace burin
