// SPDX-License-Identifier: MIT
#include "simd/classify.h"

#include "kernel_test.h"

namespace burin {
namespace {

class Classify : public KernelTest {};

TEST_P(Classify, RowsOfVoxels) {
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
        const std::uint16_t least = weights[1 + rng.below(7)];
        const int step = round % 2 ? 1 : 8, count = 1 + rng.below(step == 1 ? 64 : 8);
        const int first = rng.below(64 - (count - 1) * step);
        std::vector<std::uint8_t> known(65, 9), inside(65, 9), known_spec = known, inside_spec = inside;
        simd::classify_rows(sdf, weight, first, step, count, least, known.data(), inside.data());
        simd::scalar::classify_rows(sdf, weight, first, step, count, least, known_spec.data(),
                                    inside_spec.data());
        ASSERT_TRUE(same_bytes(known, known_spec)) << first << ' ' << step << ' ' << count;
        ASSERT_TRUE(same_bytes(inside, inside_spec)) << first << ' ' << step << ' ' << count;
    }
}

BURIN_EVERY_TARGET(Classify);

}  // namespace
}  // namespace burin
