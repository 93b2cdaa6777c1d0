// SPDX-License-Identifier: MIT
#include "simd/plane_fit.h"

#include "kernel_test.h"

namespace burin {
namespace {

class PlaneFit : public KernelTest {};

struct Chunk {
    alignas(64) std::int16_t sdf[512];
    alignas(64) std::uint16_t weight[512];
};

// Noise, a tilted plane with noise, or extremes.
Chunk random_chunk(Rng& rng, int round) {
    Chunk c;
    const std::int16_t extremes[] = {0, -1, 1, 32767, -32767, -32768, 30000, -30000, 30001, -30001};
    const std::uint16_t weights[] = {0, 1, 63, 64, 65, 32767, 32768, 65535};
    const int a[3] = {rng.below(3000) - 1500, rng.below(3000) - 1500, rng.below(3000) - 1500};
    for (int i = 0; i < 512; ++i) {
        const int plane = a[0] * (2 * (i & 7) - 7) + a[1] * (2 * (i >> 3 & 7) - 7) +
                          a[2] * (2 * (i >> 6) - 7) + rng.below(2000) - 1000;
        c.sdf[i] = round % 3 == 0   ? static_cast<std::int16_t>(rng.next())
                   : round % 3 == 1 ? static_cast<std::int16_t>(std::clamp(plane, -32768, 32767))
                                    : extremes[rng.below(10)];
        c.weight[i] = round % 2 ? weights[rng.below(8)] : static_cast<std::uint16_t>(rng.next());
    }
    return c;
}

simd::PlaneModel random_model(Rng& rng) {
    const auto value = [&rng](int most) { return static_cast<float>(rng.below(2 * most) - most) + 0.37f; };
    return {{value(3000), value(3000), value(3000)}, value(40000)};
}

TEST_P(PlaneFit, VoxelsAndSums) {
    Rng rng(71);
    for (int round = 0; round < 300; ++round) {
        const Chunk c = random_chunk(rng, round);
        const auto least = static_cast<std::uint16_t>(1 + rng.below(200));
        const auto band = static_cast<std::int16_t>(rng.below(32768));
        std::uint8_t got[512], expected[512];
        EXPECT_EQ(simd::choose_voxels(c.sdf, c.weight, least, band, got),
                  simd::scalar::choose_voxels(c.sdf, c.weight, least, band, expected));
        ASSERT_EQ(std::memcmp(got, expected, sizeof got), 0) << round;
        for (std::uint8_t& w : got) w = static_cast<std::uint8_t>(rng.below(simd::kFullWeight + 1));
        simd::PlaneSums sums[8], same[8];
        simd::sum_octants(c.sdf, got, sums);
        simd::scalar::sum_octants(c.sdf, got, same);
        ASSERT_EQ(std::memcmp(sums, same, sizeof sums), 0) << round;
    }
}

TEST_P(PlaneFit, ResidualsAndWeights) {
    Rng rng(72);
    for (int round = 0; round < 300; ++round) {
        const Chunk c = random_chunk(rng, round);
        const simd::PlaneModel model = random_model(rng);
        std::uint16_t got[512], expected[512];
        simd::plane_residuals(c.sdf, model, got);
        simd::scalar::plane_residuals(c.sdf, model, expected);
        ASSERT_EQ(std::memcmp(got, expected, sizeof got), 0) << round;
        std::uint8_t chosen[512], weights[512], same[512];
        for (std::uint8_t& w : chosen) w = rng.below(3) == 0 ? 0 : simd::kFullWeight;
        const float cut = static_cast<float>(1 + rng.below(70000)) * 0.5f;
        EXPECT_EQ(simd::tukey_weights(got, chosen, cut, weights),
                  simd::scalar::tukey_weights(got, chosen, cut, same));
        ASSERT_EQ(std::memcmp(weights, same, sizeof weights), 0) << round;
    }
}

TEST_P(PlaneFit, Pulls) {
    Rng rng(73);
    for (int round = 0; round < 300; ++round) {
        const Chunk c = random_chunk(rng, round);
        simd::Pull pulls[4];
        for (simd::Pull& p : pulls)
            p = {random_model(rng), static_cast<float>(rng.below(400000)),
                 static_cast<float>(1 + rng.below(20000))};
        const int count = 1 + rng.below(4);
        std::int16_t got[512], expected[512];
        simd::pull_to_planes(c.sdf, c.weight, pulls, count, got);
        simd::scalar::pull_to_planes(c.sdf, c.weight, pulls, count, expected);
        ASSERT_EQ(std::memcmp(got, expected, sizeof got), 0) << round;
    }
}

// The sums are those of least squares: on an exact plane they give it back.
TEST_P(PlaneFit, APlaneIsFound) {
    Chunk c;
    for (int i = 0; i < 512; ++i) {
        c.sdf[i] = static_cast<std::int16_t>(300 * (2 * (i & 7) - 7) - 500 * (2 * (i >> 3 & 7) - 7) +
                                             700 * (2 * (i >> 6) - 7) + 123);
        c.weight[i] = 64;
    }
    std::uint8_t weights[512];
    EXPECT_EQ(simd::choose_voxels(c.sdf, c.weight, 64, 32767, weights), 512);
    simd::PlaneSums sums[8], all;
    simd::sum_octants(c.sdf, weights, sums);
    for (const simd::PlaneSums& s : sums) all += s;
    EXPECT_EQ(all.w, 512 * simd::kFullWeight);
    EXPECT_EQ(all.f, 123 * 512 * simd::kFullWeight);
    EXPECT_EQ(all.uu[0], 21 * 512 * simd::kFullWeight);  // the mean of 1, 9, 25, 49
    EXPECT_EQ(all.fu[1], -500 * all.uu[3]);
    std::uint16_t residuals[512];
    simd::plane_residuals(c.sdf, {{300, -500, 700}, 123}, residuals);
    for (const std::uint16_t r : residuals) EXPECT_EQ(r, 0);
}

BURIN_EVERY_TARGET(PlaneFit);

}  // namespace
}  // namespace burin
