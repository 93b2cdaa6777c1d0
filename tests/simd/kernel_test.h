// SPDX-License-Identifier: MIT
// What the tests of kernels share: each test runs once a target, and compares bytes with the specification.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "scene_helpers.h"
#include "simd/targets.h"

namespace burin {

class KernelTest : public testing::TestWithParam<std::string> {
  protected:
    void SetUp() override { ASSERT_TRUE(simd::select_target(GetParam())); }
    void TearDown() override { ASSERT_TRUE(simd::select_target("")); }
};

#define BURIN_EVERY_TARGET(SUITE)                                                     \
    INSTANTIATE_TEST_SUITE_P(Targets, SUITE, testing::ValuesIn(simd::target_names()), \
                             [](const auto& target) { return std::string(target.param); })

// Bytes, so that NaN equals itself and -0 is not 0.
template <class T>
testing::AssertionResult same_bytes(const std::vector<T>& got, const std::vector<T>& expected) {
    if (got.size() != expected.size()) return testing::AssertionFailure() << "sizes differ";
    for (std::size_t i = 0; i < got.size(); ++i)
        if (std::memcmp(&got[i], &expected[i], sizeof(T)) != 0)
            return testing::AssertionFailure() << "element " << i << " is " << testing::PrintToString(got[i])
                                               << ", expected " << testing::PrintToString(expected[i]);
    return testing::AssertionSuccess();
}

// A vector whose last element ends where its allocation ends, for AddressSanitizer.
template <class T>
std::vector<T> tight(std::size_t count, T fill) {
    std::vector<T> v(count, fill);
    v.shrink_to_fit();
    return v;
}

inline const std::vector<float>& awkward_floats() {
    static const std::vector<float> values = {
        0.0f,
        -0.0f,
        1e-45f,
        -1e-45f,
        1e-38f,
        std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity(),
        std::numeric_limits<float>::quiet_NaN(),
        -std::numeric_limits<float>::quiet_NaN(),
        std::numeric_limits<float>::max(),
        -std::numeric_limits<float>::max(),
        -1.0f,
        65534.0f,
        65535.0f,
        65536.0f,
        2147483648.0f,
        -2147483648.0f,
    };
    return values;
}

}  // namespace burin
