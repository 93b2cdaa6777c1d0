// SPDX-License-Identifier: MIT
// The log callback of the process.
#pragma once

#include "burin/burin.h"

namespace burin {

// One line; nothing when there is no callback. What a callback itself causes is not logged.
void log_line(burin_log_level level, const char* line);

}  // namespace burin
