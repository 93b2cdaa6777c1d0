// SPDX-License-Identifier: MIT
#include "api/capture_backends.h"

#include <cstring>

#ifdef BURIN_HAVE_V4L2
#include "platform/v4l2/v4l2_backend.h"
#endif
#ifdef BURIN_HAVE_USB
#include "platform/usb/usb_backend.h"
#endif
#ifdef BURIN_HAVE_OPENNI2
#include "platform/openni2/openni2_backend.h"
#endif
#ifdef BURIN_HAVE_LIBCAMERA
#include "platform/libcamera/libcamera_backend.h"
#endif
#include "platform/null/null_backend.h"
#include "platform/replay/replay_backend.h"

namespace burin {
namespace {

// In the order in which `burin devices` lists them.
constexpr const SourceBackend* kBackends[] = {
#ifdef BURIN_HAVE_V4L2
    &kV4l2Backend,
#endif
#ifdef BURIN_HAVE_USB
    &kUsbBackend,
#endif
#ifdef BURIN_HAVE_OPENNI2
    &kOpenni2Backend,
#endif
#ifdef BURIN_HAVE_LIBCAMERA
    &kLibcameraBackend,
#endif
    &kReplayBackend,    &kNullBackend,
};

}  // namespace

int capture_backend_count() { return static_cast<int>(sizeof kBackends / sizeof kBackends[0]); }
const SourceBackend& capture_backend(int index) { return *kBackends[index]; }

const SourceBackend* find_capture_backend(const char* uri, const char** address) {
    const char* colon = std::strchr(uri, ':');
    if (!colon) return nullptr;
    *address = colon + 1;
    const auto length = static_cast<std::size_t>(colon - uri);
    for (const SourceBackend* b : kBackends)
        if (std::strlen(b->name) == length && std::memcmp(b->name, uri, length) == 0) return b;
    return nullptr;
}

}  // namespace burin
