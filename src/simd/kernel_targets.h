// SPDX-License-Identifier: MIT
// Which of Highway's targets are built. Included before anything of Highway.
#pragma once

// SSSE3 without SSE4 was last sold in 2008; the specification serves those machines. SVE and SVE2 once more
// for vectors of a known size are 66 KiB of code on aarch64 that do what the general forms do.
#if defined(__aarch64__)
#define HWY_DISABLED_TARGETS (HWY_SVE_256 | HWY_SVE2_128)
#else
#define HWY_DISABLED_TARGETS (HWY_SSSE3)
#endif
