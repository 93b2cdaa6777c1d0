// SPDX-License-Identifier: MIT
// Which of Highway's targets are built. Included before anything of Highway.
#pragma once

// SSSE3 without SSE4 was last sold in 2008; the specification serves those machines. On aarch64
// SVE2, and both once more for vectors of a known size, are 100 KiB of code that do what SVE does.
#if defined(__aarch64__)
#define HWY_DISABLED_TARGETS (HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#else
#define HWY_DISABLED_TARGETS (HWY_SSSE3)
#endif
