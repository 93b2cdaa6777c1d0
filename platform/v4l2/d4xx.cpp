// SPDX-License-Identifier: MIT
#include "platform/v4l2/d4xx.h"

#include <linux/usb/video.h>
#include <linux/uvcvideo.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "platform/v4l2/d4xx_tables.h"
#include "platform/v4l2/v4l2_node.h"

namespace burin {
namespace {

// Unit 3 with the GUID C9606CCB-594C-4D25-AF47-CCC496435995; the kernel finds units by number. Selectors:
// librealsense, src/ds/ds-private.h.
constexpr std::uint8_t kUnit = 3, kMonitor = 1;

int query(int fd, std::uint8_t request, std::uint8_t selector, std::uint8_t* data, std::uint16_t size) {
    uvc_xu_control_query q = {kUnit, selector, request, size, data};
    return v4l2_call(fd, UVCIOC_CTRL_QUERY, &q);
}

// Writes a command and reads what it brings.
Status ask(int fd, const std::uint8_t command[24], std::uint8_t* answer, const std::uint8_t** data,
           std::size_t* bytes) {
    std::memset(answer, 0, kD4xxMonitorBytes);
    std::memcpy(answer, command, 24);
    if (query(fd, UVC_SET_CUR, kMonitor, answer, kD4xxMonitorBytes) < 0)
        return v4l2_error("D4xx", "the hardware monitor", errno);
    if (query(fd, UVC_GET_CUR, kMonitor, answer, kD4xxMonitorBytes) < 0)
        return v4l2_error("D4xx", "the hardware monitor", errno);
    return d4xx_answer(command, answer, kD4xxMonitorBytes, data, bytes);
}

Status read_serial(int fd, DeviceInfo* info) {
    std::uint8_t command[24], answer[kD4xxMonitorBytes];
    const std::uint8_t* data = nullptr;
    std::size_t bytes = 0;
    char serial[16];
    d4xx_details_command(command);
    BURIN_TRY(ask(fd, command, answer, &data, &bytes));
    BURIN_TRY(d4xx_serial(data, bytes, serial));
    std::snprintf(info->serial, sizeof info->serial, "%s", serial);
    return {};
}

Status read_depth(int fd, DeviceInfo* info) {
    std::uint8_t command[24], answer[kD4xxMonitorBytes];
    const std::uint8_t* data = nullptr;
    std::size_t bytes = 0;
    d4xx_table_command(D4xxTable::depth, command);
    BURIN_TRY(ask(fd, command, answer, &data, &bytes));
    for (const StreamKind kind : {StreamKind::depth, StreamKind::infrared, StreamKind::infrared_right}) {
        if (!info->has(kind)) continue;
        StreamInfo& s = info->at(kind);
        Camera camera;
        double baseline_m = 0;
        BURIN_TRY(d4xx_depth_camera(data, bytes, s.width, s.height, &camera, &baseline_m));
        s.camera = camera;
        s.calibrated = true;
        if (kind == StreamKind::infrared_right) s.T_stream_depth.t = {-baseline_m, 0, 0};
    }
    return {};
}

Status read_colour(int fd, DeviceInfo* info) {
    if (!info->has(StreamKind::colour)) return {};
    std::uint8_t command[24], answer[kD4xxMonitorBytes];
    const std::uint8_t* data = nullptr;
    std::size_t bytes = 0;
    d4xx_table_command(D4xxTable::colour, command);
    BURIN_TRY(ask(fd, command, answer, &data, &bytes));
    StreamInfo& s = info->at(StreamKind::colour);
    Camera camera;
    Se3 T_colour_depth;
    BURIN_TRY(d4xx_colour_camera(data, bytes, s.width, s.height, &camera, &T_colour_depth));
    s.camera = camera;
    s.T_stream_depth = T_colour_depth;
    s.calibrated = true;
    return {};
}

struct Selector {
    SourceControl control;
    std::uint8_t selector, bytes;
};
constexpr Selector kSelectors[] = {
    {SourceControl::emitter, 2, 1},
    {SourceControl::depth_exposure_us, 3, 4},
    {SourceControl::laser_power_mw, 4, 2},
    {SourceControl::depth_auto_exposure, 11, 1},
};

const Selector* selector_of(SourceControl control) {
    for (const Selector& s : kSelectors)
        if (s.control == control) return &s;
    return nullptr;
}

Status read_value(int fd, std::uint8_t request, const Selector& s, double* value) {
    std::uint8_t raw[4] = {};
    if (query(fd, request, s.selector, raw, s.bytes) < 0)
        return v4l2_error("D4xx", "a control cannot be read", errno);
    *value = static_cast<double>(
        static_cast<std::uint32_t>(raw[0]) | static_cast<std::uint32_t>(raw[1]) << 8 |
        static_cast<std::uint32_t>(raw[2]) << 16 | static_cast<std::uint32_t>(raw[3]) << 24);
    return {};
}

}  // namespace

bool has_d4xx_unit(int fd) {
    std::uint8_t length[2] = {};
    return query(fd, UVC_GET_LEN, kMonitor, length, 2) == 0 &&
           (length[0] | length[1] << 8) == kD4xxMonitorBytes;
}

Status read_d4xx(int fd, DeviceInfo* info) {
    Status worst;
    for (Status (*read)(int, DeviceInfo*) : {read_serial, read_depth, read_colour})
        if (const Status status = read(fd, info); !status.ok()) worst = status;
    return worst;
}

Status get_d4xx_control(int fd, SourceControl control, ControlRange* range) {
    const Selector* s = selector_of(control);
    if (!s) return Status::error(Code::unsupported, "v4l2: the camera has no such control");
    BURIN_TRY(read_value(fd, UVC_GET_CUR, *s, &range->value));
    BURIN_TRY(read_value(fd, UVC_GET_MIN, *s, &range->least));
    BURIN_TRY(read_value(fd, UVC_GET_MAX, *s, &range->most));
    BURIN_TRY(read_value(fd, UVC_GET_RES, *s, &range->step));
    return read_value(fd, UVC_GET_DEF, *s, &range->normal);
}

Status set_d4xx_control(int fd, SourceControl control, double value) {
    ControlRange range;
    BURIN_TRY(get_d4xx_control(fd, control, &range));
    if (!(value >= range.least && value <= range.most))
        return Status::error(Code::invalid_argument, "v4l2: %g, expected %g..%g", value, range.least,
                             range.most);
    const Selector& s = *selector_of(control);
    const auto whole = static_cast<std::uint32_t>(value);
    std::uint8_t raw[4];
    for (int i = 0; i < 4; ++i) raw[i] = static_cast<std::uint8_t>(whole >> 8 * i);
    if (query(fd, UVC_SET_CUR, s.selector, raw, s.bytes) < 0)
        return v4l2_error("D4xx", "a control is refused", errno);
    return {};
}

}  // namespace burin
