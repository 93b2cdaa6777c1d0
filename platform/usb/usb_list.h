// SPDX-License-Identifier: MIT
// Which of the sensors this driver knows are plugged in.
#pragma once

#include <libusb.h>

#include "capture/source.h"
#include "platform/usb/sensor_models.h"

namespace burin {

// What a sensor is found by. `device` is valid during the call only.
struct UsbFound {
    const SensorModel* model = nullptr;
    libusb_device* device = nullptr;
    char place[48] = "";
};

// Calls visit for each; it returns false to end. A fresh look every time, so it also serves to wait for a
// device that was unplugged. Error: unsupported (no USB here).
Status visit_usb_sensors(bool (*visit)(void* user, const UsbFound& found), void* user);

// All that can be told without claiming it. Opens the device for its serial number.
void describe_usb_sensor(const UsbFound& found, DeviceEntry* entry);

// A serial number of zeros is none (Kinect 1473 and for Windows).
void usb_serial(libusb_device_handle* handle, libusb_device* device, char* serial, int size);

// The device beside it on the same hub, as the accelerometer beside Kinect's camera. False: there is none.
bool usb_companion(const char* place, std::uint16_t vendor, std::uint16_t product, char* companion, int size);

}  // namespace burin
