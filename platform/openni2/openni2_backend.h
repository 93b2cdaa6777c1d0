// SPDX-License-Identifier: MIT
// Devices and .oni files through OpenNI2 (libOpenNI2.so.0, loaded when first asked for). Addresses: a
// device's URI as OpenNI2 gives it, or the path of a recording: "openni2:1d27/0601@1/3", "openni2:take.oni".
// A recording plays at its own pace, or with "?pace=fast" behind its path as fast as frames are taken.
#pragma once

#include "capture/source.h"

namespace burin {

extern const SourceBackend kOpenni2Backend;

}  // namespace burin
