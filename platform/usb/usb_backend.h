// SPDX-License-Identifier: MIT
// Kinect v1, PrimeSense PS1080 (Xtion, Carmine, Structure Sensor) and Astra-style sensors straight over
// libusb. Protocol, devices and what no hardware has confirmed: docs/usb.md.
//
// Addresses: "VENDOR:PRODUCT@PLACE" as list() has them ("1d27:0601@1-2.3"), or only a part: "045e:02ae",
// "@1-2.3"; "" is the first there is. Then words behind commas:
//   iso            PrimeSense: isochronous transfers rather than bulk
//   registered     depth as the colour camera sees it, by the device's own table (640 x 480)
//   accelerometer  Kinect: its readings as ImuSample whose gyro_rad_s is zero, since there is no gyroscope.
//   Off
//                  otherwise: a tracker would take the zeros for "does not turn".
#pragma once

#include "capture/source.h"
#include "platform/usb/sensor_models.h"
#include "platform/usb/usb_sensor.h"

namespace burin {

extern const SourceBackend kUsbBackend;

struct UsbAddress {
    int vendor = -1, product = -1;  // -1: any
    char place[48] = "";            // "": any
    SensorWishes wishes;
};

// Error: invalid_argument, with what was expected.
Status parse_usb_address(const char* text, UsbAddress* address);

}  // namespace burin
