// SPDX-License-Identifier: MIT
#include "platform/libcamera/libcamera_backend.h"

#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <new>

#include "platform/libcamera/libcamera_device.h"

namespace burin {
namespace {

// A process may have one manager. It is started when first asked for and kept: its threads notice what is
// plugged in.
Status manager(libcamera::CameraManager** out) {
    static std::mutex starting;
    static libcamera::CameraManager* started = nullptr;
    const std::lock_guard lock(starting);
    if (!started) {
        // A library does not write to its user's terminal; whoever wants to read it asks for it.
        if (!std::getenv("LIBCAMERA_LOG_LEVELS")) libcamera::logSetTarget(libcamera::LoggingTargetNone);
        auto* made = new (std::nothrow) libcamera::CameraManager;
        if (!made) return Status::error(Code::insufficient_memory, "libcamera: no memory for its manager");
        if (const int error = made->start(); error != 0) {
            delete made;
            return Status::error(Code::io, "libcamera does not start (%d)", error);
        }
        started = made;
    }
    *out = started;
    return {};
}

Status list(DeviceVisit visit, void* user) {
    libcamera::CameraManager* cameras = nullptr;
    BURIN_TRY(manager(&cameras));
    for (const std::shared_ptr<libcamera::Camera>& camera : cameras->cameras()) {
        DeviceEntry e;
        std::snprintf(e.address, sizeof e.address, "%.159s", camera->id().c_str());
        std::snprintf(e.location, sizeof e.location, "%.63s", camera->id().c_str());
        const auto model = camera->properties().get(libcamera::properties::Model);
        std::snprintf(e.name, sizeof e.name, "%.90s", model ? model->c_str() : "camera");
        std::snprintf(e.formats, sizeof e.formats, "colour");
        visit(user, e);
    }
    return {};
}

Status open(const char* address, const SourceOptions& options, void** device, DeviceInfo* info) {
    if (!(options.streams & stream_bit(StreamKind::colour)))
        return Status::error(Code::unsupported, "libcamera: delivers colour alone, which was not asked for");
    libcamera::CameraManager* cameras = nullptr;
    BURIN_TRY(manager(&cameras));
    const std::shared_ptr<libcamera::Camera> camera = cameras->get(address);
    if (!camera) return Status::error(Code::disconnected, "libcamera: there is no camera '%.200s'", address);
    auto* d = new (std::nothrow) LibcameraDevice;
    if (!d) return Status::error(Code::insufficient_memory, "libcamera: no memory for the device");
    if (const Status opened = d->open(camera, options); !opened.ok()) {
        delete d;
        return opened;
    }
    *info = d->info();
    *device = d;
    return {};
}

LibcameraDevice& self(void* device) { return *static_cast<LibcameraDevice*>(device); }
Status start(void* device, SourceSink* sink) { return self(device).start(sink); }
Status pump(void* device, std::int64_t deadline_ns) { return self(device).pump(deadline_ns); }
Status stop(void* device) { return self(device).stop(); }
void close(void* device) { delete &self(device); }
void give_back(void* device, std::uint64_t token) { self(device).give_back(token); }

}  // namespace

const SourceBackend kLibcameraBackend = {"libcamera", "colour cameras of ARM boards through libcamera",
                                         list,        open,
                                         start,       pump,
                                         stop,        close,
                                         give_back,   nullptr,
                                         nullptr};

}  // namespace burin
