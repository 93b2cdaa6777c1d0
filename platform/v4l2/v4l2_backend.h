// SPDX-License-Identifier: MIT
// Cameras and depth sensors that the kernel has a driver for. Addresses: a node ("/dev/video0") or
// "serial:NUMBER"; the other nodes of the same sensor are found by themselves. docs/v4l2.md.
#pragma once

#include "capture/source.h"

namespace burin {

extern const SourceBackend kV4l2Backend;

}  // namespace burin
