// SPDX-License-Identifier: MIT
#include "platform/usb/sensor_models.h"

namespace burin {
namespace {

constexpr SensorFamily kKinect = SensorFamily::kinect, kPrimeSense = SensorFamily::primesense;

// Ids: libfreenect src/usb_libusb10.c; OpenNI2 XnDeviceEnumeration.cpp; Astra: OrbbecSDK's and
// openni2_camera's udev rules (2bc5:04xx). docs/usb.md says which of them anybody has run.
constexpr SensorModel kModels[] = {
    {0x045e, 0x02ae, "Kinect v1 (Xbox NUI Camera)", kKinect, 0, 0x02b0, true, false, false},
    {0x045e, 0x02bf, "Kinect v1 for Windows", kKinect, 1, 0, true, false, true},
    {0x1d27, 0x0500, "PrimeSense PS1080", kPrimeSense, -1, 0, true, false, false},
    {0x1d27, 0x0600, "PrimeSense PS1080 (Xtion)", kPrimeSense, -1, 0, true, false, false},
    {0x1d27, 0x0601, "PrimeSense PS1080 (Xtion Pro Live, Carmine)", kPrimeSense, -1, 0, true, false, false},
    {0x1d27, 0x0609, "PrimeSense PS1080 (Carmine 1.09)", kPrimeSense, -1, 0, true, false, false},
    {0x2bc5, 0x0401, "Orbbec Astra", kPrimeSense, -1, 0, true, true, false},
    {0x2bc5, 0x0402, "Orbbec Astra S", kPrimeSense, -1, 0, true, true, false},
    {0x2bc5, 0x0403, "Orbbec Astra Pro", kPrimeSense, -1, 0, false, true, false},
    {0x2bc5, 0x0404, "Orbbec Astra Mini", kPrimeSense, -1, 0, true, true, false},
    {0x2bc5, 0x0407, "Orbbec Astra Mini S", kPrimeSense, -1, 0, true, true, false},
};

}  // namespace

const SensorModel* find_sensor_model(std::uint16_t vendor, std::uint16_t product) {
    for (const SensorModel& m : kModels)
        if (m.vendor == vendor && m.product == product) return &m;
    return nullptr;
}

int sensor_model_count() { return static_cast<int>(sizeof kModels / sizeof *kModels); }
const SensorModel& sensor_model(int index) { return kModels[index]; }

}  // namespace burin
