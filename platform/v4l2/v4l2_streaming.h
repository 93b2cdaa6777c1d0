// SPDX-License-Identifier: MIT
#pragma once

#include "platform/v4l2/v4l2_device.h"

namespace burin {

// As the functions of SourceBackend of these names.
Status start_v4l2(V4l2Device* d, SourceSink* sink);
Status pump_v4l2(V4l2Device* d, std::int64_t deadline_ns);
Status stop_v4l2(V4l2Device* d);

}  // namespace burin
