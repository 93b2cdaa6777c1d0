// SPDX-License-Identifier: MIT
// Which formats, sizes and rates a sensor has, and which one a caller's wishes mean.
#pragma once

#include <cstdint>

#include "capture/source.h"
#include "platform/usb/sensor_models.h"

namespace burin {

// As the bytes of a frame are on the wire. The names are those of StreamInfo::format.
enum class WireFormat : std::uint8_t {
    shift16,   // depth: little-endian 16-bit shifts
    ps_depth,  // depth: PrimeSense's nibble differences
    packed10,  // depth and infrared: most significant bit first, no gaps
    packed11,
    packed12,
    bayer,     // colour: a byte a pixel, G R over B G
    uyvy,      // colour
    yuyv,      // colour
    ps_yuv,    // colour: UYVY as nibble differences
    ps_bayer,  // colour: a mosaic as nibble differences
};
const char* wire_name(WireFormat format);
// Bytes of that many pixels; of a compressed format the most there can be.
int wire_bytes(WireFormat format, int pixels);
bool wire_compressed(WireFormat format);

struct SensorMode {
    WireFormat format = WireFormat::packed11;
    std::uint8_t code = 0;        // the device's number of the format
    std::uint8_t resolution = 0;  // the device's number: 0 QVGA, 1 VGA, 2 SXGA, 3 UXGA, 4 QQVGA
    std::uint8_t fps = 0;
    std::int16_t width = 0, height = 0;
};

inline constexpr int kMaxModes = 64;
struct ModeList {
    SensorMode modes[kMaxModes];
    int count = 0;
    void add(WireFormat format, int code, int resolution, int fps);
};

// In the order of preference.
ModeList kinect_modes(StreamKind kind);
// Those that OpenNI2 knows for firmware 5.x; of colour those that the device may have when it does not tell.
ModeList primesense_modes(StreamKind kind, bool isochronous);
// The reply to Opcode::cmos_presets, triples of format, resolution and rate; those that no driver knows are
// left out. Uncompressed ones first, of those 640 x 480.
ModeList parse_colour_presets(const std::uint8_t* data, int bytes);

// The first mode that fits; a width, rate or format of 0 or "" fits all. Error: unsupported, its text lists
// what there is. `name` begins it.
Status choose_mode(const ModeList& list, StreamKind kind, int width, int height, double fps,
                   const char* format, const char* name, SensorMode* chosen);
// "packed11 640x480@30, ..." as far as it fits.
void list_modes(const ModeList& list, char* text, int size);

}  // namespace burin
