// SPDX-License-Identifier: MIT
// The back ends of this build. A new one gets its entry in capture_backends.cpp (platform/PORTING.md).
#pragma once

#include "capture/source.h"

namespace burin {

int capture_backend_count();
const SourceBackend& capture_backend(int index);

// "v4l2:/dev/video0" is split at the first colon: the back end of that name, or null, and the address behind
// it.
const SourceBackend* find_capture_backend(const char* uri, const char** address);

}  // namespace burin
