// SPDX-License-Identifier: MIT
#include "platform/usb/sensor_modes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "platform/usb/bytes.h"

namespace burin {
namespace {

constexpr struct {
    std::int16_t width, height;
} kResolutions[] = {{320, 240}, {640, 480}, {1280, 1024}, {1600, 1200}, {160, 120}};
constexpr int kResolutionCount = 5;

}  // namespace

const char* wire_name(WireFormat format) {
    constexpr const char* kNames[] = {"shift16", "ps-depth", "packed10", "packed11", "packed12",
                                      "GRBG",    "UYVY",     "YUYV",     "ps-yuv",   "ps-GRBG"};
    return kNames[static_cast<int>(format)];
}

bool wire_compressed(WireFormat format) {
    return format >= WireFormat::ps_yuv || format == WireFormat::ps_depth;
}

int wire_bytes(WireFormat format, int pixels) {
    switch (format) {
        case WireFormat::packed10:
            return (pixels * 10 + 7) / 8;
        case WireFormat::packed11:
            return (pixels * 11 + 7) / 8;
        case WireFormat::packed12:
            return (pixels * 12 + 7) / 8;
        case WireFormat::bayer:
            return pixels;
        case WireFormat::ps_depth:  // five nibbles a pixel, and one for the evenness
            return (pixels * 5 + 1) / 2 + 1;
        case WireFormat::ps_yuv:  // three nibbles a byte
            return pixels * 3 + 1;
        case WireFormat::ps_bayer:
            return pixels * 3 / 2 + 1;
        default:
            return pixels * 2;
    }
}

void ModeList::add(WireFormat format, int code, int resolution, int fps) {
    if (count == kMaxModes || resolution < 0 || resolution >= kResolutionCount || fps < 1 || fps > 255)
        return;
    SensorMode& m = modes[count++];
    m.format = format;
    m.code = static_cast<std::uint8_t>(code);
    m.resolution = static_cast<std::uint8_t>(resolution);
    m.fps = static_cast<std::uint8_t>(fps);
    m.width = kResolutions[resolution].width;
    m.height = kResolutions[resolution].height;
}

ModeList kinect_modes(StreamKind kind) {
    ModeList list;
    if (kind == StreamKind::depth) {
        list.add(WireFormat::packed11, 3, 1, 30);
        list.add(WireFormat::packed10, 2, 1, 30);
    } else if (kind == StreamKind::colour) {
        list.add(WireFormat::bayer, 0, 1, 30);
        list.add(WireFormat::bayer, 0, 2, 15);  // told 15, sends 10
        list.add(WireFormat::uyvy, 5, 1, 15);
    } else if (kind == StreamKind::infrared) {
        list.add(WireFormat::packed10, 0, 1, 30);
        list.add(WireFormat::packed10, 0, 2, 15);
    }
    return list;
}

ModeList primesense_modes(StreamKind kind, bool isochronous) {
    ModeList list;
    constexpr int kQvga = 0, kVga = 1, kSxga = 2, kQqvga = 4;
    if (kind == StreamKind::depth) {
        constexpr struct {
            WireFormat format;
            int code;
        } kFormats[] = {{WireFormat::packed11, 3},
                        {WireFormat::packed12, 4},
                        {WireFormat::shift16, 0},
                        {WireFormat::ps_depth, 1},
                        {WireFormat::packed10, 2}};
        for (const auto& f : kFormats) {
            list.add(f.format, f.code, kVga, 30);
            list.add(f.format, f.code, kQvga, 60);
            list.add(f.format, f.code, kQvga, 30);
            list.add(f.format, f.code, kQqvga, 30);
        }
    } else if (kind == StreamKind::colour) {
        const auto both = [&](WireFormat format, int code) {
            list.add(format, code, kVga, 30);
            list.add(format, code, kQvga, 60);
            list.add(format, code, kQvga, 30);
        };
        if (isochronous) both(WireFormat::uyvy, 5);
        both(WireFormat::ps_yuv, 1);
        list.add(WireFormat::ps_bayer, 0, kSxga, 30);
    } else if (kind == StreamKind::infrared) {
        list.add(WireFormat::packed10, 0, kVga, 30);
        list.add(WireFormat::packed10, 0, kQvga, 60);
        list.add(WireFormat::packed10, 0, kQvga, 30);
        list.add(WireFormat::packed10, 0, kSxga, 30);
    }
    return list;
}

ModeList parse_colour_presets(const std::uint8_t* data, int bytes) {
    // OpenNI2, XnStreamFormats.h. 2 is JPEG, which this driver leaves out.
    constexpr struct {
        int code;
        WireFormat format;
    } kFormats[] = {{5, WireFormat::uyvy},
                    {7, WireFormat::yuyv},
                    {6, WireFormat::bayer},
                    {1, WireFormat::ps_yuv},
                    {0, WireFormat::ps_bayer}};
    ModeList list;
    for (const auto& f : kFormats)
        for (const bool vga : {true, false})
            for (int at = 0; at + 6 <= bytes; at += 6)
                if (le16(data + at) == f.code && (le16(data + at + 2) == 1) == vga)
                    list.add(f.format, f.code, le16(data + at + 2), le16(data + at + 4));
    return list;
}

void list_modes(const ModeList& list, char* text, int size) {
    int used = 0;
    text[0] = 0;
    for (int i = 0; i < list.count; ++i) {
        const SensorMode& m = list.modes[i];
        char one[48];
        const int n = std::snprintf(one, sizeof one, "%s%s %dx%d@%d", i ? ", " : "", wire_name(m.format),
                                    m.width, m.height, m.fps);
        if (used + n >= size) return;
        std::memcpy(text + used, one, static_cast<std::size_t>(n) + 1);
        used += n;
    }
}

Status choose_mode(const ModeList& list, StreamKind kind, int width, int height, double fps,
                   const char* format, const char* name, SensorMode* chosen) {
    for (int i = 0; i < list.count; ++i) {
        const SensorMode& m = list.modes[i];
        if (width > 0 && (m.width != width || m.height != height)) continue;
        if (fps > 0 && std::fabs(m.fps - fps) > 0.5) continue;
        if (format[0] && std::strcmp(format, wire_name(m.format)) != 0) continue;
        *chosen = m;
        return {};
    }
    char modes[300];
    list_modes(list, modes, sizeof modes);
    char size[32] = "any size";
    if (width > 0) std::snprintf(size, sizeof size, "%dx%d", width, height);
    char rate[32] = "any rate";
    if (fps > 0) std::snprintf(rate, sizeof rate, "%g a second", fps);
    return Status::error(Code::unsupported, "%s has no %s %s of %s at %s, expected one of: %s", name,
                         format[0] ? format : "any", stream_name(kind), size, rate, modes);
}

}  // namespace burin
