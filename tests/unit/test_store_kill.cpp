// SPDX-License-Identifier: MIT
// A writer of the store that dies: of SIGKILL at 200 random moments, and at 200 random bytes. The file opens
// at its last commit.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <string>

#include "dataset_files.h"
#include "emulated.h"
#include "unit/store_rig.h"

namespace burin {
namespace {

namespace fs = std::filesystem;

// The machine dies at 200 random bytes of the history, with writes cut short.
TEST(StoreKill, DeadAtAnyByteItOpensAtTheLastCommit) {
    MemoryIo whole;
    std::vector<std::uint64_t> hashes;
    {
        Rig rig(true);
        ASSERT_TRUE(rig.attach(whole, true).ok());
        hashes = write_history(rig, 6, 7);
        rig.store.close();
    }
    Rng rng(8);
    for (int round = 0; round < sized(200, 40); ++round) {
        MemoryIo io;
        Rig rig(true);
        ASSERT_TRUE(rig.attach(io, true).ok());
        io.most = 1 + static_cast<std::size_t>(rng.below(9000));
        io.life = rng.next() % (whole.bytes.size() - 2 * kStorePage);
        // What the process itself still reads comes from a page cache that has everything; only the copy
        // dies.
        struct Both final : StoreIo {
            MemoryIo alive;
            MemoryIo* dying = nullptr;
            std::int64_t read(std::uint64_t at, void* to, std::size_t n) override {
                return alive.read(at, to, n);
            }
            std::int64_t write(std::uint64_t at, const void* from, std::size_t n) override {
                const std::int64_t put = dying->write(at, from, n);
                alive.write(at, from, static_cast<std::size_t>(put));
                return put;
            }
            int sync() override { return 0; }
            std::int64_t size() override { return alive.size(); }
            int truncate(std::uint64_t n) override { return alive.truncate(n); }
        } both;
        both.alive.bytes = io.bytes;
        both.dying = &io;
        rig.store.close();
        ASSERT_TRUE(rig.attach(both, false).ok());
        ASSERT_EQ(write_history(rig, 6, 7), hashes);
        rig.store.close();
        Rig after(true);
        std::uint64_t frames = 99;
        const Status status = after.attach(io, false, &frames);
        ASSERT_TRUE(status.ok()) << status.text();
        ASSERT_LT(frames, hashes.size());
        ASSERT_EQ(after.hash(), hashes[frames]);
        ASSERT_TRUE(after.readable());
    }
}

using Clock = std::chrono::steady_clock;

// A life of the writer is steps of three kinds: one of opening, then over and over kPuts of filling and one
// of committing. Their times are a thousand times apart, so that moments by the clock alone would nearly all
// fall into one kind, on a loaded machine into opening.
enum Kind { opening, filling, committing, kKinds };
constexpr std::uint64_t kPuts = 50, kCommits = 3;  // nearly every life ends within so many commits
constexpr std::uint64_t kSteps = 1 + kCommits * (kPuts + 1);
Kind kind_of(std::uint64_t step) {
    return step == 0 ? opening : step % (kPuts + 1) == 0 ? committing : filling;
}

// What the writer is told and tells, in memory that outlives it.
struct Shared {
    std::uint64_t last_step = 0;             // it dies
    double wait_us = 0;                      // so long after this step began
    std::atomic<std::uint64_t> step;         // under way
    std::atomic<std::uint64_t> begun, done;  // commits
    std::atomic<double> took_us[kKinds];     // the last step of a kind that ended
    std::uint64_t hashes[1024];              // of the map at commit % 1024
};

// SIGKILL from the kernel, in the middle of whatever runs then.
bool die_after(double us) {
    sigevent event{};
    event.sigev_notify = SIGEV_SIGNAL;
    event.sigev_signo = SIGKILL;
    timer_t timer;
    const auto ns = static_cast<long>(1e3 * us) + 1;  // 0 would be never
    const itimerspec when = {{0, 0}, {ns / 1000000000, ns % 1000000000}};
    return timer_create(CLOCK_MONOTONIC, &event, &timer) == 0 && timer_settime(timer, 0, &when, nullptr) == 0;
}

[[noreturn]] void write_until_killed(const std::string& path, std::uint64_t seed, Shared& shared) {
    Rig rig(true);
    Rng rng(seed);
    std::uint64_t step = 0, frames = 0;
    const auto take = [&](auto&& work) {
        shared.step.store(step);
        if (step == shared.last_step && !die_after(shared.wait_us)) _exit(10);
        const auto begin = Clock::now();
        if (!work()) _exit(1 + kind_of(step));
        shared.took_us[kind_of(step)].store(
            std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
        ++step;
    };
    take([&] { return rig.store.resume(path.c_str(), &frames).ok(); });
    for (std::uint64_t commit = frames + 1;; ++commit) {
        for (std::uint64_t i = 0; i < kPuts; ++i)
            take([&] { return rig.put(rng.below(150), rng.below(100)); });
        shared.hashes[commit % 1024] = rig.hash();
        shared.begun.store(commit);
        take([&] { return rig.store.commit(rig.volume, commit).ok(); });
        shared.done.store(commit);
    }
}

// A step of the life drawn at random, of each kind as often as another, and then a moment drawn at random
// within the time that such a step took last (half as much again, since it may take longer).
TEST(StoreKill, KilledAtRandomMomentsItOpensAtTheLastCommit) {
    const TempFolder folder;
    const std::string path = folder.path("store");
    void* const memory =
        mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    ASSERT_NE(memory, MAP_FAILED);
    Shared& shared = *new (memory) Shared{};
    const auto begin_anew = [&] {
        fs::remove(path);
        Rig rig(true);
        ASSERT_TRUE(rig.store.create(path.c_str(), {}).ok());
        shared.hashes[0] = rig.hash();
    };
    begin_anew();
    Rng rng(9);
    constexpr int kRounds = sized(200, 40);
    int died[kKinds] = {}, cut_off = 0, commit_landed = 0, commit_lost = 0;
    std::uint64_t last = 0, all = 0;  // commits
    for (int round = 0; round < kRounds; ++round) {
        const Kind kind = static_cast<Kind>(rng.below(kKinds));
        do {
            shared.last_step = rng.next() % kSteps;
        } while (kind_of(shared.last_step) != kind);
        shared.wait_us = rng.uniform(0, 1.5) * shared.took_us[kind].load();
        shared.step = 0;
        shared.begun = shared.done = last;
        const pid_t child = fork();
        ASSERT_GE(child, 0);
        if (child == 0) write_until_killed(path, static_cast<std::uint64_t>(round), shared);
        int result = 0;
        ASSERT_EQ(waitpid(child, &result, 0), child);
        ASSERT_TRUE(WIFSIGNALED(result) && WTERMSIG(result) == SIGKILL)
            << "round " << round << ": the writer ended with " << WEXITSTATUS(result);
        const std::uint64_t step = shared.step, begun = shared.begun, done = shared.done;

        Rig after(true);
        std::uint64_t frames = 0;
        const std::uintmax_t left = fs::file_size(path);
        const Status status = after.store.resume(path.c_str(), &frames);
        ASSERT_TRUE(status.ok()) << "round " << round << ": " << status.text();
        ASSERT_GE(frames, done) << "a commit that returned is gone";
        ASSERT_LE(frames, begun);
        ASSERT_EQ(after.hash(), shared.hashes[frames % 1024]) << "round " << round;
        ASSERT_TRUE(after.readable());
        ++died[kind_of(step)];
        cut_off += fs::file_size(path) < left;
        if (begun > done) ++(frames == begun ? commit_landed : commit_lost);
        all += frames - last;
        last = frames;
        if (fs::file_size(path) < (16u << 20)) continue;
        after.store.close();  // a new one, so that opening stays short
        begin_anew();
        last = 0;
    }
    std::printf(
        "%d lives, %llu commits: %d killed while opening, %d while filling, %d while committing (%d of those "
        "commits "
        "landed, %d did not); %d left bytes after the last commit\n",
        kRounds, static_cast<unsigned long long>(all), died[opening], died[filling], died[committing],
        commit_landed, commit_lost, cut_off);
    // Drawn are a third of each; a step that took less time than expected hands its kill to the next.
    for (const int count : died) EXPECT_GE(count, kRounds / 20) << "moments of one kind are missing";
    EXPECT_GT(cut_off, kRounds / 10) << "hardly a kill found a write under way";
    EXPECT_GT(commit_lost, 0) << "no kill came before the mark";
    EXPECT_GT(all, static_cast<std::uint64_t>(kRounds / 2)) << "hardly a commit was made";
    munmap(memory, sizeof(Shared));
}

}  // namespace
}  // namespace burin
