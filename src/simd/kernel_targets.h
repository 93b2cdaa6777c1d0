// SPDX-License-Identifier: MIT
// Which of Highway's targets are built. Included before anything of Highway.
#pragma once

// SSSE3 without SSE4 was last sold in 2008; the specification serves those machines. On aarch64 NEON alone:
// the kernels take four lanes at a time of vectors without a fixed size (vector-inl.h), so that SVE gains
// nothing and SVE and SVE2 together cost 160 KiB of code. -DBURIN_SVE=ON builds them too, with the same bits
// (./dev cross aarch64-sve).
#if defined(__aarch64__) && defined(BURIN_SVE)
#define HWY_DISABLED_TARGETS (HWY_SVE_256 | HWY_SVE2_128)
#elif defined(__aarch64__)
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#else
#define HWY_DISABLED_TARGETS (HWY_SSSE3)
#endif
