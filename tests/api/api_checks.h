// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "burin/burin.h"

namespace burin {

constexpr burin_map kNull{0, 0};

// One line that holds `part`.
inline void expect_text(burin_map map, const std::string& part) {
    const std::string text = burin_last_error(map);
    EXPECT_NE(text.find(part), std::string::npos) << "'" << text << "' does not name '" << part << "'";
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
}

}  // namespace burin
