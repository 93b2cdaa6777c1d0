// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>

#include "capture/clock_map.h"
#include "capture/imu_queue.h"
#include "capture/rolling.h"

namespace burin {
namespace {

// A device whose clock runs `ppm` faster than the host's, with delays as of USB: 1 ms at least, 5 ms on
// average.
struct DriftingDevice {
    double ppm;
    std::int64_t epoch_ns;
    std::mt19937 random{7};
    std::exponential_distribution<double> extra_ms{1 / 4.0};

    std::int64_t device_ns(std::int64_t true_ns) const {
        return epoch_ns + true_ns +
               static_cast<std::int64_t>(std::llround(static_cast<double>(true_ns) * ppm * 1e-6));
    }
    std::int64_t arrival_ns(std::int64_t true_ns) {
        return true_ns + 1'000'000 + static_cast<std::int64_t>(extra_ms(random) * 1e6);
    }
};

TEST(ClockMap, FindsOffsetAndDriftUnderDelaysThatJitter) {
    for (const double ppm : {-80.0, 0.0, 45.0}) {
        DriftingDevice device{ppm, 123456789012345};
        ClockMap clock;
        double worst_ms = 0;
        for (int i = 0; i < 30 * 120; ++i) {
            const std::int64_t t = i * 33'333'333ll;
            clock.add(device.device_ns(t), device.arrival_ns(t));
            // The least delay cannot be told from the offset: 1 ms stays.
            if (i > 30 * 40)
                worst_ms = std::max(
                    worst_ms,
                    std::abs(static_cast<double>(clock.host_ns(device.device_ns(t)) - t) * 1e-6 - 1));
        }
        EXPECT_NEAR(clock.drift_ppm(), ppm, 10) << ppm;
        EXPECT_LT(worst_ms, 0.5) << ppm;
    }
}

TEST(ClockMap, BeginsAnewWhenTheDeviceDoes) {
    ClockMap clock;
    for (int i = 0; i < 300; ++i) clock.add(i * 33'000'000ll, 5'000'000'000ll + i * 33'000'000ll);
    clock.add(0, 20'000'000'000ll);
    EXPECT_EQ(clock.host_ns(0), 20'000'000'000ll);
    EXPECT_EQ(clock.windows(), 0);
}

TEST(ClockMap, AnyStampsAreSurvived) {
    std::mt19937_64 random(3);
    ClockMap clock;
    for (int i = 0; i < 100000; ++i) {
        const auto device = static_cast<std::int64_t>(random());
        clock.add(i % 3 ? device : INT64_MIN + i, static_cast<std::int64_t>(random()));
        (void)clock.host_ns(static_cast<std::int64_t>(random()));
    }
    EXPECT_TRUE(std::isfinite(clock.drift_ppm()));
}

TEST(Rolling, QuantilesOfTheLastReadings) {
    Rolling rolling;
    EXPECT_EQ(rolling.quantile(0.5), 0);
    for (int i = 0; i < 1000; ++i) rolling.add(i);
    EXPECT_EQ(rolling.count(), Rolling::kReadings);
    EXPECT_EQ(rolling.quantile(0), 1000 - Rolling::kReadings);
    EXPECT_EQ(rolling.quantile(0.5), 1000 - Rolling::kReadings / 2);
    EXPECT_EQ(rolling.quantile(1), 999);
}

TEST(ImuQueue, EveryStretchBetweenFramesIsBracketed) {
    ImuQueue queue;
    ImuSample out[ImuQueue::kSamples];
    for (int t = 0; t <= 100; t += 10) queue.add({t, {}, {}});
    // The first frame's begin with the last at or before it.
    ASSERT_EQ(queue.take(35, out), 2);
    EXPECT_EQ(out[0].t_ns, 30);
    EXPECT_EQ(out[1].t_ns, 40);
    ASSERT_EQ(queue.take(60, out), 3);
    EXPECT_EQ(out[0].t_ns, 40);
    EXPECT_EQ(out[2].t_ns, 60);
    ASSERT_EQ(queue.take(85, out), 3);
    EXPECT_EQ(out[0].t_ns, 70);
    EXPECT_EQ(out[2].t_ns, 90);
    ASSERT_EQ(queue.take(1000, out), 2) << "what has come, though none lies past the frame";
    EXPECT_EQ(queue.take(2000, out), 0);
}

}  // namespace
}  // namespace burin
