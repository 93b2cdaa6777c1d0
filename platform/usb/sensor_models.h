// SPDX-License-Identifier: MIT
// The devices this driver knows.
#pragma once

#include <cstdint>

namespace burin {

enum class SensorFamily : std::uint8_t { kinect, primesense };

struct SensorModel {
    std::uint16_t vendor, product;
    const char* name;
    SensorFamily family;
    int alternate;              // of interface 0 that has the data endpoints; -1: by firmware version
    std::uint16_t motor;        // product of the device beside it that has the accelerometer; 0: none
    bool colour;                // false: colour is a UVC device of its own
    bool formats_as_they_come;  // the firmware may send another depth format than it was told
    bool close_range;           // Kinect: knows it
};

// nullptr: none of ours.
const SensorModel* find_sensor_model(std::uint16_t vendor, std::uint16_t product);
int sensor_model_count();
const SensorModel& sensor_model(int index);

}  // namespace burin
