// SPDX-License-Identifier: MIT
// Which of Highway's targets are built. Included before anything of Highway.
#pragma once

// SSSE3 without SSE4 was last sold in 2008; the specification serves those machines.
#define HWY_DISABLED_TARGETS (HWY_SSSE3)
