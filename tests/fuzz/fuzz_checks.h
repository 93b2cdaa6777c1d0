// SPDX-License-Identifier: MIT
// What must hold for any input. A violation traps, which both libFuzzer and the replay report.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "core/se3.h"
#include "core/status.h"

namespace burin::fuzz {

inline const std::string kName = "input";

inline void check(bool holds) {
    if (!holds) __builtin_trap();
}

// One line that names the file.
inline void check_error(const Status& status) {
    check(!status.ok() && std::strchr(status.text(), '\n') == nullptr);
    check(std::strncmp(status.text(), kName.c_str(), kName.size()) == 0);
    for (const char* c = status.text(); *c; ++c) check(*c >= 0x20 && *c < 0x7f);
}

inline void check_rigid(const Se3& T) {
    check(std::isfinite(T.t.x) && std::isfinite(T.t.y) && std::isfinite(T.t.z));
    check(std::fabs(T.R.determinant() - 1) < 1e-9);
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) check(std::fabs(dot(T.R.column(a), T.R.column(b)) - (a == b)) < 1e-9);
}

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
    return {reinterpret_cast<const char*>(data), size};
}

}  // namespace burin::fuzz
