// SPDX-License-Identifier: MIT
#include "platform/v4l2/uvc_metadata.h"

namespace burin {
namespace {

std::uint32_t le32(const std::uint8_t* p) {
    return static_cast<std::uint32_t>(p[0]) | static_cast<std::uint32_t>(p[1]) << 8 |
           static_cast<std::uint32_t>(p[2]) << 16 | static_cast<std::uint32_t>(p[3]) << 24;
}

// struct uvc_meta_buf: u64 host ns, u16 bus frame number, then the header, whose first byte is its length.
constexpr std::size_t kKernelHead = 10;
// Bits of a payload header's second byte (UVC 1.5, table 2-6).
constexpr std::uint8_t kHasPts = 0x04, kHasScr = 0x08, kError = 0x40;
// Blocks of D4XX metadata: u32 id, u32 size (with these eight bytes), then their fields.
constexpr std::uint32_t kDepthControl = 0x80000000u, kCaptureTiming = 0x80000001u;

void parse_d4xx(const std::uint8_t* p, std::size_t bytes, UvcFrameMetadata* m) {
    while (bytes >= 16) {
        const std::uint32_t id = le32(p), size = le32(p + 4);
        if (size < 16 || size > bytes) return;
        // Both: u32 version, u32 flags of the fields that hold; a bit a field in their order.
        const std::uint32_t flags = le32(p + 12);
        if (id == kCaptureTiming && size >= 20 && (flags & 1)) {
            m->has_counter = true;
            m->counter = le32(p + 16);
        }
        if (id == kDepthControl && size >= 28) {  // gain, exposure, laser power
            m->has_depth_control = (flags & 6) != 0;
            m->exposure_us = le32(p + 20);
            m->laser_power_mw = le32(p + 24);
        }
        p += size;
        bytes -= size;
    }
}

}  // namespace

UvcFrameMetadata parse_uvc_metadata(const std::uint8_t* data, std::size_t bytes, bool d4xx) {
    UvcFrameMetadata m;
    while (bytes >= kKernelHead + 2) {
        const std::uint8_t* header = data + kKernelHead;
        const std::size_t length = header[0];
        if (length < 2 || kKernelHead + length > bytes) break;
        const std::uint8_t flags = header[1];
        m.any = true;
        m.error = m.error || (flags & kError) != 0;
        if ((flags & kHasPts) && length >= 6 && !m.has_pts) {
            m.has_pts = true;
            m.pts = le32(header + 2);
        }
        std::size_t standard = 2;
        if (flags & kHasPts) standard += 4;
        if (flags & kHasScr) standard += 6;
        if (d4xx && length > standard) parse_d4xx(header + standard, length - standard, &m);
        data += kKernelHead + length;
        bytes -= kKernelHead + length;
    }
    return m;
}

std::uint32_t uvc_clock_hz(const std::uint8_t* d, std::size_t bytes, int interface_number) {
    constexpr std::uint8_t kInterface = 4, kClassInterface = 0x24, kVcHeader = 1, kVideo = 14, kControl = 1;
    bool in_control = false;
    int control = -1;
    while (bytes >= 2 && d[0] >= 2 && d[0] <= bytes) {
        if (d[1] == kInterface && d[0] >= 9) {
            in_control = d[5] == kVideo && d[6] == kControl;
            control = in_control ? d[2] : -1;
        } else if (d[1] == kClassInterface && d[0] >= 12 && in_control && d[2] == kVcHeader) {
            bool belongs = control == interface_number;
            for (std::size_t i = 0; i < d[11] && 12 + i < d[0]; ++i)
                belongs = belongs || d[12 + i] == interface_number;
            if (belongs) return le32(d + 7);
        }
        bytes -= d[0];
        d += d[0];
    }
    return 0;
}

}  // namespace burin
