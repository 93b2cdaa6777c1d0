// SPDX-License-Identifier: MIT
// Where the recorded sequences are: $BURIN_DATA, or ../shared/data beside the checkout.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

inline std::string data_dir() {
    if (const char* dir = std::getenv("BURIN_DATA"); dir && *dir) return dir;
    return std::string(BURIN_SOURCE_DIR) + "/../shared/data";
}

// Skips the calling test, loudly, when the sequence is not there.
#define BURIN_NEED_DATA(name)                                                                              \
    const std::string name##_path = data_dir() + "/" #name;                                                \
    if (!std::filesystem::exists(name##_path))                                                             \
    GTEST_SKIP() << "SKIPPED FOR WANT OF DATA: " << name##_path << " is not there; set BURIN_DATA to the " \
                 << "folder of recorded sequences"
