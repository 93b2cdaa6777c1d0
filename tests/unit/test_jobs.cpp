// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <thread>
#include <vector>

#include "core/jobs.h"

namespace burin {
namespace {

TEST(Jobs, EveryItemOnceWhateverTheThreads) {
    for (const int threads : {1, 2, 5, 64}) {
        Jobs jobs(threads);
        EXPECT_EQ(jobs.threads(), threads);
        for (const int count : {0, 1, 2, 63, 64, 65, 5000}) {
            std::vector<std::atomic<int>> done(static_cast<std::size_t>(count));
            jobs.run(count, [&](int item, int worker) {
                EXPECT_GE(worker, 0);
                EXPECT_LT(worker, threads);
                ++done[static_cast<std::size_t>(item)];
            });
            for (const auto& n : done) ASSERT_EQ(n.load(), 1);
        }
    }
}

TEST(Jobs, WorkersAreDistinctWhileRunning) {
    Jobs jobs(4);
    std::atomic<int> inside[4] = {};
    std::atomic<int> clashes{0};
    for (int round = 0; round < 200; ++round)
        jobs.run(64, [&](int, int worker) {
            if (inside[worker].fetch_add(1) != 0) ++clashes;
            for (int spin = 0; spin < 50; ++spin) std::atomic_signal_fence(std::memory_order_seq_cst);
            inside[worker].fetch_sub(1);
        });
    EXPECT_EQ(clashes.load(), 0);
}

TEST(Jobs, ResultsAreVisibleToTheCallerAndTheNextRun) {
    Jobs jobs(3);
    std::vector<int> values(1000, 0);  // plain ints: the run itself must order the accesses
    for (int round = 0; round < 300; ++round) {
        jobs.run(1000, [&](int item, int) { ++values[static_cast<std::size_t>((item + round) % 1000)]; });
        ASSERT_EQ(values[static_cast<std::size_t>(round % 1000)], round + 1);
    }
}

TEST(Jobs, BehindRunsOnceBesideRunsThatDoNotWait) {
    for (const int threads : {1, 2, 4}) {
        Jobs jobs(threads);
        for (int round = 0; round < 300; ++round) {
            int behind = 0;  // plain: finish_behind orders the accesses
            auto body = [&] { ++behind; };
            jobs.start_behind(body);
            std::atomic<int> sum{0};
            for (int run = 0; run < 4; ++run) jobs.run(20, [&](int item, int) { sum += item; });
            EXPECT_EQ(sum.load(), 4 * 190);
            jobs.finish_behind();
            ASSERT_EQ(behind, 1);
        }
    }
    // The worker is at it until the runs are over: they must end without it.
    Jobs jobs(2);
    std::atomic<bool> begun{false}, over{false};
    auto body = [&] {
        begun = true;
        while (!over) std::this_thread::yield();
    };
    jobs.start_behind(body);
    while (!begun) std::this_thread::yield();
    int items = 0;
    for (int run = 0; run < 3; ++run) jobs.run(50, [&](int, int worker) { items += worker == 0; });
    EXPECT_EQ(items, 150);
    over = true;
    jobs.finish_behind();
}

TEST(Jobs, ManyPoolsComeAndGo) {
    for (int i = 0; i < 300; ++i) {
        Jobs jobs(1 + i % 7);
        std::atomic<int> sum{0};
        if (i % 2) jobs.run(10, [&](int item, int) { sum += item; });
        EXPECT_EQ(sum.load(), i % 2 ? 45 : 0);
    }
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && !defined(BURIN_EMULATED)
[[noreturn]] void run_where_threads_are_few() {
    long pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    rlimit limit{};
    // Room for three more stacks of the default 8 MiB, not for 63.
    limit.rlim_cur = limit.rlim_max =
        static_cast<rlim_t>(pages) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + (rlim_t{32} << 20);
    setrlimit(RLIMIT_AS, &limit);
    Jobs jobs(64);
    std::atomic<int> sum{0};
    jobs.run(1000, [&](int item, int) { sum += item; });
    std::fprintf(stderr, "%d threads\n", jobs.threads());
    std::_Exit(sum.load() == 499500 && jobs.threads() < 64 ? 0 : 1);
}

// The pool must not take the process down where the system refuses a thread.
TEST(Jobs, MakesDoWithTheThreadsThereAre) {
    EXPECT_EXIT(run_where_threads_are_few(), testing::ExitedWithCode(0), "threads");
}
#endif

}  // namespace
}  // namespace burin
