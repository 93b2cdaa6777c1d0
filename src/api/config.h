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

// Fewer chunks than one frame of anything touches: a budget below this was given in the wrong unit.
inline constexpr std::uint32_t kLeastCapacity = 64;

// Bytes of a whole map with this many chunks: the handle's state and the session's layout.
std::uint64_t map_bytes(const FusionOptions& options, std::uint32_t capacity);

// Checks, derives the capacity from the budget, and tells the exact bytes.
Status plan_map(const burin_config& config, FusionOptions* options, std::uint64_t* bytes);

}  // namespace burin
