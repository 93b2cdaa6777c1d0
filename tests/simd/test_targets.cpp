// SPDX-License-Identifier: MIT
// Which kernels run: selection by name and by the environment.
#include "simd/targets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

namespace burin {
namespace {

using simd::target_names;

bool holds(const std::string& name) {
    const auto names = target_names();
    return std::find(names.begin(), names.end(), name) != names.end();
}

TEST(Targets, AreNamedBestFirstAndScalarLast) {
    const auto names = target_names();
    ASSERT_FALSE(names.empty());
    EXPECT_EQ(names.back(), "scalar");
    std::string all;
    for (const std::string& name : names) {
        EXPECT_EQ(std::count(names.begin(), names.end(), name), 1) << name;
        all += name + " ";
    }
    std::printf("targets: %s\n", all.c_str());
}

TEST(Targets, AreSelectedByTheirName) {
    for (const std::string& name : target_names()) {
        EXPECT_TRUE(simd::select_target(name));
        EXPECT_EQ(simd::target_name(), name);
        EXPECT_EQ(simd::scalar_selected(), name == "scalar");
    }
    const std::string before = simd::target_name();
    for (const char* unknown : {"avx9", "AVX2", "?", "unknown", " ", "emu128"}) {
        EXPECT_FALSE(simd::select_target(unknown)) << unknown;
        EXPECT_EQ(simd::target_name(), before) << "a refused name changes nothing";
    }
    EXPECT_TRUE(simd::select_target(""));
    EXPECT_EQ(simd::target_name(), target_names().front());
}

// A process of its own: the environment is read once. Under emulation the kernel cannot start this program
// anew; a fork does where nothing has read the environment yet, and death tests come first.
#if defined(BURIN_EMULATED)
constexpr const char* kDeathTestStyle = "fast";
#else
constexpr const char* kDeathTestStyle = "threadsafe";
#endif
void expect_under(const char* value, const std::string& expected) {
    EXPECT_EXIT(
        {
            ::setenv("BURIN_SIMD", value, 1);
            std::fprintf(stderr, "runs %s\n", simd::target_name());
            std::exit(expected == simd::target_name() ? 0 : 1);
        },
        testing::ExitedWithCode(0), "runs")
        << "BURIN_SIMD=" << value << ", expected " << expected;
}

TEST(TargetsDeathTest, TheEnvironmentSetsALimit) {
    GTEST_FLAG_SET(death_test_style, kDeathTestStyle);
    expect_under("", target_names().front());
    for (const std::string& name : target_names()) {
        expect_under(name.c_str(), name);
        std::string upper = name;
        for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
        expect_under(upper.c_str(), name);
    }
    for (const char* unknown : {"avx9", "?", "none", "-"}) expect_under(unknown, target_names().front());
}

TEST(TargetsDeathTest, ALimitAboveTheMachineIsNone) {
    GTEST_FLAG_SET(death_test_style, kDeathTestStyle);
    // ssse3 is never built: what is below it on this architecture, if anything is usable, or no limit.
    if (holds("sse4")) expect_under("ssse3", holds("sse2") ? "sse2" : target_names().front());
    if (holds("avx2") && !holds("avx3_zen4")) expect_under("avx3_dl", target_names().front());
}

}  // namespace
}  // namespace burin
