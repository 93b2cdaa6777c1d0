// SPDX-License-Identifier: MIT
// Colour from cameras behind libcamera, as on the Raspberry Pi. Addresses are libcamera's ids:
// "libcamera:/base/soc/...". Compiled and enumerated in the tests, streamed in none: see docs/libcamera.md.
#pragma once

#include "capture/source.h"

namespace burin {

extern const SourceBackend kLibcameraBackend;

}  // namespace burin
