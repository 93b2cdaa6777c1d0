// SPDX-License-Identifier: MIT
// Streams, formats and descriptors of the emulated UVC camera.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "../pattern.h"

namespace rig {

struct UvcFormat {
    const char* fourcc;  // by which V4L2 knows it
    std::uint8_t guid[16];
    int bits;  // a pixel, as the descriptor says
    Layout layout;
    int sample_bits;
    int samples;  // a pixel and plane
    int planes;
    bool jpeg;
    int d4xx;  // image format code in the metadata
};

struct UvcSize {
    int width, height;
};

struct UvcStreamKind {
    const char* name;
    int control_interface, interface, endpoint;  // endpoint without the direction bit
    std::vector<UvcFormat> formats;
    std::vector<UvcSize> sizes;
};

// Depth and infrared hang on one control interface, with the extension unit (unit 3); colour has its own, as
// in a D435.
const std::vector<UvcStreamKind>& uvc_streams();
inline constexpr int kUvcExtensionUnit = 3;
inline constexpr int kUvcSecondControl = 3;

Format uvc_pixels(const UvcFormat& format, UvcSize size);              // layout of a frame (not of JPEG)
std::uint32_t uvc_frame_bytes(const UvcFormat& format, UvcSize size);  // of JPEG: at most

struct UvcConfig {
    bool bulk = true;
    unsigned vendor = 0x8086, product = 0x0b03;
    int fps = 30;
    std::string absurd;  // zero-size, huge-size, zero-interval, no-formats, cut, no-endpoint
};

inline constexpr std::uint32_t kUvcClockHz = 1000000;  // so that PTS is in microseconds

std::vector<std::uint8_t> uvc_device_descriptor(const UvcConfig& config);
std::vector<std::uint8_t> uvc_configuration(const UvcConfig& config);

}  // namespace rig
