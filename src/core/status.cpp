// SPDX-License-Identifier: MIT
#include "core/status.h"

#include <cstdio>

namespace burin {

Status Status::error(Code code, const char* format, ...) {
    Status status;
    status.code_ = code;
    va_list args;
    va_start(args, format);
    std::vsnprintf(status.text_, sizeof status.text_, format, args);
    va_end(args);
    return status;
}

}  // namespace burin
