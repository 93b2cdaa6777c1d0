// SPDX-License-Identifier: MIT
#include "platform/openni2/openni2_library.h"

#include <dlfcn.h>

#include <mutex>

namespace burin {
namespace {

struct Symbol {
    const char* name;
    void** to;
};

Status find_all(void* handle, Openni2* l) {
    const Symbol symbols[] = {
        {"oniInitialize", reinterpret_cast<void**>(&l->initialize)},
        {"oniGetExtendedError", reinterpret_cast<void**>(&l->last_error)},
        {"oniGetDeviceList", reinterpret_cast<void**>(&l->device_list)},
        {"oniReleaseDeviceList", reinterpret_cast<void**>(&l->release_device_list)},
        {"oniRegisterDeviceCallbacks", reinterpret_cast<void**>(&l->register_device_callbacks)},
        {"oniUnregisterDeviceCallbacks", reinterpret_cast<void**>(&l->unregister_device_callbacks)},
        {"oniWaitForAnyStream", reinterpret_cast<void**>(&l->wait_for_any_stream)},
        {"oniDeviceOpen", reinterpret_cast<void**>(&l->device_open)},
        {"oniDeviceClose", reinterpret_cast<void**>(&l->device_close)},
        {"oniDeviceGetSensorInfo", reinterpret_cast<void**>(&l->sensor_info)},
        {"oniDeviceGetInfo", reinterpret_cast<void**>(&l->device_info)},
        {"oniDeviceCreateStream", reinterpret_cast<void**>(&l->create_stream)},
        {"oniDeviceGetProperty", reinterpret_cast<void**>(&l->device_get)},
        {"oniDeviceSetProperty", reinterpret_cast<void**>(&l->device_set)},
        {"oniDeviceIsImageRegistrationModeSupported", reinterpret_cast<void**>(&l->can_register)},
        {"oniStreamDestroy", reinterpret_cast<void**>(&l->destroy_stream)},
        {"oniStreamStart", reinterpret_cast<void**>(&l->start_stream)},
        {"oniStreamStop", reinterpret_cast<void**>(&l->stop_stream)},
        {"oniStreamReadFrame", reinterpret_cast<void**>(&l->read_frame)},
        {"oniStreamGetProperty", reinterpret_cast<void**>(&l->stream_get)},
        {"oniStreamSetProperty", reinterpret_cast<void**>(&l->stream_set)},
        {"oniStreamIsPropertySupported", reinterpret_cast<void**>(&l->stream_has)},
        {"oniFrameRelease", reinterpret_cast<void**>(&l->release_frame)},
    };
    for (const Symbol& s : symbols) {
        *s.to = ::dlsym(handle, s.name);
        if (!*s.to)
            return Status::error(Code::unsupported, "libOpenNI2.so.0 has no %s; expected OpenNI 2.2", s.name);
    }
    return {};
}

Status load(Openni2* l) {
    // Version 2 of the interface, as its headers have it.
    void* handle = ::dlopen("libOpenNI2.so.0", RTLD_NOW | RTLD_LOCAL);
    if (!handle)
        return Status::error(Code::unsupported, "OpenNI2 is not installed (Debian's libopenni2-0): %.200s",
                             ::dlerror());
    BURIN_TRY(find_all(handle, l));
    if (const OniStatus status = l->initialize(ONI_API_VERSION); status != ONI_STATUS_OK)
        return Status::error(Code::io, "OpenNI2 would not start (%d): %.300s", static_cast<int>(status),
                             openni2_error(*l));
    return {};
}

}  // namespace

Status load_openni2(const Openni2** library) {
    static std::mutex loading;
    static Openni2 loaded;
    static bool tried = false;
    static Status outcome;
    const std::lock_guard lock(loading);
    if (!tried) outcome = load(&loaded);
    tried = true;
    *library = &loaded;
    return outcome;
}

const char* openni2_error(const Openni2& library) {
    const char* text = library.last_error();
    return text && *text ? text : "no details";
}

}  // namespace burin
