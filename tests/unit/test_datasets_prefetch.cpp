// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <set>
#include <thread>

#include "datasets/prefetch.h"

namespace burin {
namespace {

using namespace std::chrono_literals;

// Frame i holds i in its stamp and its first pixel; some fail, some are slow.
class Counting final : public Dataset {
  public:
    explicit Counting(int count) : count_(count) {}
    const char* format() const override { return "counting"; }
    int frame_count() const override { return count_; }
    Status load(int index, Frame* out) const override {
        const int now = ++running_;
        int most = most_running_.load();
        while (now > most && !most_running_.compare_exchange_weak(most, now)) {
        }
        if (delay_every > 0 && index % delay_every == 0) std::this_thread::sleep_for(3ms);
        ++loads;
        if (out->depth_u16.pixels.empty()) {
            ++fresh;
            out->depth_u16 = Image<std::uint16_t>(4, 4);
        }
        out->t_ns = index;
        out->depth_u16.pixels[0] = static_cast<std::uint16_t>(index);
        --running_;
        if (fail_every > 0 && index % fail_every == 1)
            return Status::error(Code::format, "frame %d is bad", index);
        return {};
    }
    int fail_every = 0, delay_every = 0;
    mutable std::atomic<int> loads{0}, fresh{0}, running_{0}, most_running_{0};

  private:
    int count_;
};

TEST(Prefetch, EveryFrameOnceInOrder) {
    for (int threads : {1, 2, 4}) {
        Counting data(200);
        data.delay_every = 7;
        FramePrefetcher prefetcher(data, 5, 150, 8, threads);
        EXPECT_EQ(prefetcher.index(), 4);
        Frame frame;
        for (int i = 5; i < 150; ++i) {
            const Result<bool> got = prefetcher.next(&frame);
            ASSERT_TRUE(got.ok() && *got);
            ASSERT_EQ(frame.t_ns, i);
            ASSERT_EQ(frame.depth_u16.pixels[0], i);
            ASSERT_EQ(prefetcher.index(), i);
        }
        for (int i = 0; i < 3; ++i) {  // the end stays the end
            const Result<bool> got = prefetcher.next(&frame);
            EXPECT_TRUE(got.ok() && !*got);
        }
        EXPECT_EQ(data.loads, 145);
        EXPECT_LE(data.most_running_, threads);
    }
}

TEST(Prefetch, ErrorsComeAtTheirPlace) {
    Counting data(50);
    data.fail_every = 5;
    data.delay_every = 3;
    FramePrefetcher prefetcher(data, 0, 50, 6, 3);
    Frame frame;
    for (int i = 0; i < 50; ++i) {
        const Result<bool> got = prefetcher.next(&frame);
        if (i % 5 == 1) {
            ASSERT_FALSE(got.ok());
            EXPECT_STREQ(got.status().text(), ("frame " + std::to_string(i) + " is bad").c_str());
            EXPECT_EQ(frame.t_ns, i - 1);  // untouched
        } else {
            ASSERT_TRUE(got.ok() && *got);
            EXPECT_EQ(frame.t_ns, i);
        }
    }
    EXPECT_FALSE(*prefetcher.next(&frame));
}

TEST(Prefetch, BuffersGoRound) {
    Counting data(1000);
    FramePrefetcher prefetcher(data, 0, 1000, 4, 2);
    Frame frame;
    while (*prefetcher.next(&frame)) {
    }
    EXPECT_EQ(data.loads, 1000);
    EXPECT_LE(data.fresh, 5);  // four slots and the caller's frame
}

TEST(Prefetch, DecodesAheadButNotFurther) {
    Counting data(100);
    FramePrefetcher prefetcher(data, 0, 100, 5);
    const auto deadline = std::chrono::steady_clock::now() + 10s;
    while (data.loads < 5 && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(1ms);
    ASSERT_EQ(data.loads, 5);
    std::this_thread::sleep_for(50ms);
    EXPECT_EQ(data.loads, 5);
    Frame frame;
    ASSERT_TRUE(*prefetcher.next(&frame));
    while (data.loads < 6 && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(1ms);
    std::this_thread::sleep_for(50ms);
    EXPECT_EQ(data.loads, 6);
}

TEST(Prefetch, EarlyEndAndOddRanges) {
    Counting data(100);
    data.delay_every = 1;
    for (int taken = 0; taken < 4; ++taken) {
        FramePrefetcher prefetcher(data, 0, 100, 8, 3);
        Frame frame;
        for (int i = 0; i < taken; ++i) ASSERT_TRUE(*prefetcher.next(&frame));
    }
    Frame frame;
    FramePrefetcher empty(data, 10, 10, 4), backwards(data, 20, 10, 4), beyond(data, -5, 1000, 0, 0);
    EXPECT_FALSE(*empty.next(&frame));
    EXPECT_FALSE(*backwards.next(&frame));
    int count = 0;
    while (*beyond.next(&frame)) ++count;
    EXPECT_EQ(count, 100);
}

}  // namespace
}  // namespace burin
