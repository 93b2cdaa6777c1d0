// SPDX-License-Identifier: MIT
#pragma once

#include "burin/burin.h"
#include "core/status.h"
#include "session/fusion_session.h"

namespace burin {

// Every field in its range, else a line that names the field, its value and the range.
Status check_config(const burin_config& config);

// The checked configuration in the terms of the rooms below; the capacity still 0.
FusionOptions options_of(const burin_config& config);

}  // namespace burin
