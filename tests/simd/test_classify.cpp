// SPDX-License-Identifier: MIT
#include "simd/classify.h"

#include "kernel_test.h"

namespace burin {
namespace {

class Classify : public KernelTest {};

TEST_P(Classify, PlanesOfVoxels) {
    Rng rng(120);
    alignas(64) std::int16_t sdf[512];
    alignas(64) std::uint16_t weight[512];
    const std::int16_t distances[] = {0, -1, 1, 32767, -32767, -32768};
    const std::uint16_t weights[] = {0, 1, 63, 64, 65, 32767, 32768, 65535};
    for (int round = 0; round < 400; ++round) {
        for (int i = 0; i < 512; ++i) {
            sdf[i] = round % 2 ? distances[rng.below(6)] : static_cast<std::int16_t>(rng.next());
            weight[i] = round % 3 ? weights[rng.below(8)] : static_cast<std::uint16_t>(rng.next());
        }
        const simd::CellLimits limits{weights[1 + rng.below(7)],
                                      round % 4 ? static_cast<std::int16_t>(-rng.below(32769)) : distances[5],
                                      round % 5 ? static_cast<std::int16_t>(rng.below(32768)) : distances[1]};
        const int planes = 1 + rng.below(8);
        simd::ChunkBits got, expected;
        std::memset(&got, 0x5a, sizeof got);
        std::memset(&expected, 0x5a, sizeof expected);
        simd::classify_chunk(sdf, weight, planes, limits, &got);
        simd::scalar::classify_chunk(sdf, weight, planes, limits, &expected);
        ASSERT_EQ(std::memcmp(&got, &expected, sizeof got), 0) << round << ": " << planes << " planes";
    }
}

BURIN_EVERY_TARGET(Classify);

}  // namespace
}  // namespace burin
