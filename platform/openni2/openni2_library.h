// SPDX-License-Identifier: MIT
// The functions of OpenNI2's C interface (OniCAPI.h, 2.2) that we call, found at run time.
#pragma once

#include <OniCAPI.h>
#include <OniCProperties.h>

#include "core/status.h"

namespace burin {

struct Openni2 {
    decltype(&oniInitialize) initialize;
    decltype(&oniGetExtendedError) last_error;
    decltype(&oniGetDeviceList) device_list;
    decltype(&oniReleaseDeviceList) release_device_list;
    decltype(&oniRegisterDeviceCallbacks) register_device_callbacks;
    decltype(&oniUnregisterDeviceCallbacks) unregister_device_callbacks;
    decltype(&oniWaitForAnyStream) wait_for_any_stream;
    decltype(&oniDeviceOpen) device_open;
    decltype(&oniDeviceClose) device_close;
    decltype(&oniDeviceGetSensorInfo) sensor_info;
    decltype(&oniDeviceGetInfo) device_info;
    decltype(&oniDeviceCreateStream) create_stream;
    decltype(&oniDeviceGetProperty) device_get;
    decltype(&oniDeviceSetProperty) device_set;
    decltype(&oniDeviceIsImageRegistrationModeSupported) can_register;
    decltype(&oniStreamDestroy) destroy_stream;
    decltype(&oniStreamStart) start_stream;
    decltype(&oniStreamStop) stop_stream;
    decltype(&oniStreamReadFrame) read_frame;
    decltype(&oniStreamGetProperty) stream_get;
    decltype(&oniStreamSetProperty) stream_set;
    decltype(&oniStreamIsPropertySupported) stream_has;
    decltype(&oniFrameRelease) release_frame;
};

// Loaded and initialised once, for the rest of the process: its drivers start threads that are better not
// stopped and started. Safe from any thread. unsupported: it is not installed (the text names the package);
// io: it would not start.
Status load_openni2(const Openni2** library);

// OpenNI2's own words about its last error on this thread, or "no details".
const char* openni2_error(const Openni2& library);

}  // namespace burin
