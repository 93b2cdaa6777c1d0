// SPDX-License-Identifier: MIT
// Which of Highway's targets are built. Included before anything of Highway.
#pragma once

// SSSE3 without SSE4 was last sold in 2008; the specification serves those machines. On aarch64 NEON alone:
// with SVE and SVE2, under emulation with vectors of 512 bits, two of 2692 chunks of a recorded sequence
// missed a carve of one voxel (docs/volume.md), and the same map everywhere comes first. It also saves 160
// KiB of code.
#if defined(__aarch64__)
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#else
#define HWY_DISABLED_TARGETS (HWY_SSSE3)
#endif
