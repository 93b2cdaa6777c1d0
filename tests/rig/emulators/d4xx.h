// SPDX-License-Identifier: MIT
// What a RealSense D4xx says of itself beside its pictures: the depth extension unit with the hardware
// monitor behind it (calibration tables, details of the camera) and the metadata in payload headers. Layouts:
// librealsense's src/ds/d400/d400-private.h, src/ds/ds-private.h and src/hw-monitor.h;
// Documentation/userspace-api/media/v4l/metafmt-d4xx.rst.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "faults.h"

namespace rig {

// What the tables say; rig_client checks that they arrive. Rectified 640x480.
struct D4xxTruth {
    float fx = 385.5f, fy = 386.25f, cx = 321.75f, cy = 238.5f;
    float baseline_mm = 49.875f;
    float colour_fx = 615.0f, colour_fy = 616.5f, colour_cx = 318.25f, colour_cy = 241.5f;  // of 640x480
    float colour_t_mm[3] = {-14.75f, 0.25f, 0.5f};  // translation_rect of the colour table
};

class D4xx {
  public:
    // calibration: good, none (an error code), zero, nan, huge, crc, short, type
    D4xx(Faults& faults, std::string calibration) : faults_(faults), calibration_(std::move(calibration)) {
        reset();
    }
    void reset();

    D4xxTruth truth;

    // A request to the depth extension unit. Returns bytes or kStall.
    int extension(int request, int selector, std::uint8_t* data, int length);

    // The metadata blocks after the standard payload header: 140 bytes.
    std::vector<std::uint8_t> metadata(std::uint32_t frame, int format, int width, int height, int fps) const;

    int laser_power() const { return static_cast<int>(controls_[4]); }
    bool emitter() const { return controls_[2] != 0; }

  private:
    std::vector<std::uint8_t> table(int id) const;
    void monitor(const std::uint8_t* command);

    Faults& faults_;
    std::string calibration_;
    std::uint32_t controls_[32] = {};
    std::vector<std::uint8_t> answer_;
};

}  // namespace rig
