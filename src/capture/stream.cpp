// SPDX-License-Identifier: MIT
#include "capture/stream.h"

namespace burin {

const char* stream_name(StreamKind kind) {
    constexpr const char* kNames[kStreamKinds] = {"depth", "colour", "infrared", "infrared_right",
                                                  "confidence"};
    const auto index = static_cast<unsigned>(kind);
    return index < kStreamKinds ? kNames[index] : "unknown";
}

}  // namespace burin
