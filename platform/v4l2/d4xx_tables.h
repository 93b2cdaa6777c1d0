// SPDX-License-Identifier: MIT
// What a RealSense D4xx tells of itself through its hardware monitor: calibration tables and details.
// Layouts: librealsense, src/ds/d400/d400-private.h and src/hw-monitor.h (facts; the code is ours). All of it
// is untrusted.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/camera.h"
#include "core/se3.h"
#include "core/status.h"

namespace burin {

inline constexpr int kD4xxMonitorBytes = 1024;
enum class D4xxTable : std::uint32_t { depth = 25, colour = 32 };

// A command of 24 bytes for the monitor: details of the camera, or a table.
void d4xx_details_command(std::uint8_t command[24]);
void d4xx_table_command(D4xxTable table, std::uint8_t command[24]);

// The data of an answer (`bytes` of it are read at most): *data points into it. format: not the answer to
// that command, an error of the device (the text tells its number), sizes that cannot be.
Status d4xx_answer(const std::uint8_t command[24], const std::uint8_t* answer, std::size_t bytes,
                   const std::uint8_t** data, std::size_t* data_bytes);

// The serial number of the camera's optical module, twelve digits. format: too short.
Status d4xx_serial(const std::uint8_t* details, std::size_t bytes, char serial[16]);

// Rectified depth images have the left imager's camera. format: a table of another kind, a check sum that is
// wrong, or numbers no camera has; unsupported: a size that the table does not know.
Status d4xx_depth_camera(const std::uint8_t* table, std::size_t bytes, int width, int height, Camera* camera,
                         double* baseline_m);
Status d4xx_colour_camera(const std::uint8_t* table, std::size_t bytes, int width, int height, Camera* camera,
                          Se3* T_colour_depth);

}  // namespace burin
