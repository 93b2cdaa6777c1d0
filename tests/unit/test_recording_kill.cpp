// SPDX-License-Identifier: MIT
// A writer of recordings that dies: its file cut at every byte, and SIGKILL at 200 random moments. The file
// opens to its last whole record.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "datasets/open.h"
#include "emulated.h"
#include "unit/recording_rig.h"

namespace burin {
namespace {

namespace fs = std::filesystem;

TEST(RecordingKill, CutAtAnyByteItOpensToItsLastWholeRecord) {
    const TempFolder folder;
    ASSERT_NO_FATAL_FAILURE(record_rig(folder.path("r"), 5));
    std::ifstream in(folder.path("r/recording.burinrec"), std::ios::binary);
    const std::string whole{std::istreambuf_iterator<char>(in), {}};
    // Where each frame record ends, its padding not needed.
    std::vector<std::size_t> ends;
    const std::size_t header = sizeof(RecordHead) + sizeof(RecordedHeader);
    for (std::size_t at = 0; at < whole.size();) {
        RecordHead head;
        std::memcpy(&head, whole.data() + at, sizeof head);
        if (head.kind == RecordKind::frame) ends.push_back(at + sizeof head + head.payload_bytes);
        at += record_bytes(head.payload_bytes);
    }
    ASSERT_EQ(ends.size(), 5u);
    const std::string path = folder.text("cut", whole);
    for (std::size_t size = whole.size(); size-- > 0;) {
        fs::resize_file(path, size);
        RecordingReader reader;
        const Status status = reader.open(path.c_str());
        if (size < header) {
            ASSERT_EQ(status.code(), Code::format) << size;
            if (kEmulated && size < header - 100) break;
            continue;
        }
        ASSERT_TRUE(status.ok()) << size << ": " << status.text();
        const auto frames =
            std::count_if(ends.begin(), ends.end(), [&](std::size_t end) { return end <= size; });
        ASSERT_EQ(reader.frame_count(), frames) << size;
        ASSERT_FALSE(reader.findings().closed);
        if (size % 16 != 0) continue;
        RecordedImages images;
        ASSERT_TRUE(images.reserve(reader).ok());
        for (int n = 0; n < frames; ++n) ASSERT_NO_FATAL_FAILURE(expect_rig_frame(reader, images, n, n));
    }
}

struct Shared {
    std::atomic<std::uint64_t> written;  // frames, as the writer's statistics told
};

// The kernel hardly ever leaves a small write half done. This one is always in pieces, and takes its time.
struct PiecesFile final : RecordingFile {
    DiskFile disk;
    std::int64_t write(std::uint64_t at, const void* from, std::size_t n) override {
        std::this_thread::sleep_for(std::chrono::microseconds(20));
        return disk.write(at, from, std::min<std::size_t>(n, 61));
    }
    int sync() override { return disk.sync(); }
    int truncate(std::uint64_t n) override { return disk.truncate(n); }
    void flush_soon(std::uint64_t end) override { disk.flush_soon(end); }
};

[[noreturn]] void record_until_killed(const std::string& folder, bool pieces, Shared& shared) {
    const DeviceInfo info = rig_device();
    RecordingOptions options = rig_options();
    options.sync_ns = 5'000'000;
    options.queue_frames = 3;
    PiecesFile file;
    RecordingWriter writer;
    if (pieces && !file.disk.create(folder.c_str(), kRecordingName).ok()) _exit(12);
    const Status opened =
        pieces ? writer.open(&file, "it", "", info, options) : writer.open(folder.c_str(), "", info, options);
    if (!opened.ok()) _exit(10);
    for (int n = 0;; ++n) {
        if (!add_rig_frame(writer, info, n).ok()) _exit(11);
        shared.written.store(writer.statistics().frames);
    }
}

TEST(RecordingKill, KilledAtRandomMomentsItOpensToItsLastWholeRecord) {
    const TempFolder folder;
    void* const memory =
        mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    ASSERT_NE(memory, MAP_FAILED);
    Shared& shared = *new (memory) Shared{};
    Rng rng(1);
    constexpr int kRounds = sized(200, 20);
    std::uint64_t all = 0;
    int torn = 0, without_frames = 0;
    for (int round = 0; round < kRounds; ++round) {
        const std::string path = folder.path(std::to_string(round));
        shared.written = 0;
        const pid_t child = fork();
        ASSERT_GE(child, 0);
        if (child == 0) record_until_killed(path, round % 2 == 1, shared);
        // From before the header is there to some hundred frames.
        const auto until = std::chrono::steady_clock::now() + std::chrono::microseconds(rng.below(30'000));
        const auto wanted = static_cast<std::uint64_t>(round % 4 == 0 ? 0 : rng.below(round % 2 ? 15 : 60));
        while (std::chrono::steady_clock::now() < until || shared.written < wanted) {
            int ended = 0;
            ASSERT_EQ(waitpid(child, &ended, WNOHANG), 0) << "the writer ended with " << WEXITSTATUS(ended);
            std::this_thread::yield();
        }
        std::this_thread::sleep_for(std::chrono::microseconds(rng.below(3000)));
        kill(child, SIGKILL);
        int result = 0;
        ASSERT_EQ(waitpid(child, &result, 0), child);
        ASSERT_TRUE(WIFSIGNALED(result) && WTERMSIG(result) == SIGKILL);
        RecordingReader reader;
        const Status status = reader.open(path.c_str());
        if (!status.ok()) {  // not even the header
            ASSERT_EQ(shared.written, 0u) << status.text();
            ++without_frames;
            continue;
        }
        ASSERT_GE(static_cast<std::uint64_t>(reader.frame_count()), shared.written)
            << "a frame told written is gone";
        RecordedImages images;
        ASSERT_TRUE(images.reserve(reader).ok());
        for (int n = 0; n < reader.frame_count(); ++n)
            ASSERT_NO_FATAL_FAILURE(expect_rig_frame(reader, images, n, n)) << "round " << round;
        without_frames += reader.frame_count() == 0;
        torn += reader.findings().torn_bytes > 0;
        all += static_cast<std::uint64_t>(reader.frame_count());
        if (reader.frame_count() > 0) {
            const auto dataset = open_dataset(path, "");
            ASSERT_TRUE(dataset.ok()) << dataset.status().text();
            EXPECT_NE((*dataset)->notes().find("was not closed"), std::string::npos);
        }
        fs::remove_all(path);
    }
    std::printf("%d lives, %llu frames; %d ended inside a record, %d before their first frame\n", kRounds,
                static_cast<unsigned long long>(all), torn, without_frames);
    EXPECT_GT(all, static_cast<std::uint64_t>(kRounds));
    EXPECT_GT(torn, kRounds / 20) << "hardly a kill found a write under way";
    munmap(memory, sizeof(Shared));
}

}  // namespace
}  // namespace burin
