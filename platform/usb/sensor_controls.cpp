// SPDX-License-Identifier: MIT
#include <cmath>

#include "capture/monotonic.h"
#include "platform/usb/usb_sensor.h"

namespace burin {
namespace {

// OpenNI2, XnParams.h; Kinect has the same numbers for mirrors (libfreenect, flags.c).
constexpr std::uint16_t kDepthMirror = 23, kImageMirror = 71, kInfraredMirror = 72;
constexpr std::uint16_t kAutoExposure = 80, kCloseRange = 84;

// Kinect (libfreenect, flags.c, libfreenect.h): registers of the colour sensor through Opcode::kinect_cmos.
constexpr std::uint16_t kCmosShutter = 9, kCmosAuto = 0x106, kAutoExposureBit = 1 << 14;
constexpr double kShutterBayer_us = 54.21, kShutterUyvy_us = 63.25;  // of one line
// Kinect for Windows, near mode: gain of the infrared camera and a register without a name.
constexpr std::uint16_t kInfraredGain = 0x15, kNearRegister = 0x2ef;
constexpr std::uint16_t kNearGain = 7, kFarGain = 30, kNear = 0, kFar = 0x190;
constexpr std::int64_t kNearPause_ns = 100'000'000;

}  // namespace

Status UsbSensor::get(SourceControl control, ControlRange* range) {
    if (!(controls_ & control_bit(control)))
        return Status::error(Code::unsupported, "%s has no such control", name_);
    const bool kinect = model_.family == SensorFamily::kinect;
    *range = {control_values_[static_cast<int>(control)], 0, 1, 1, 0};
    std::uint16_t value = 0;
    switch (control) {
        case SourceControl::mirror:
            BURIN_TRY(channel_.get_param(stream_of(StreamKind::depth) ? kDepthMirror : kImageMirror, &value));
            range->value = value != 0;
            break;
        case SourceControl::colour_auto_exposure:
            if (kinect) {
                BURIN_TRY(channel_.get_cmos(kCmosAuto, &value));
                range->value = (value & kAutoExposureBit) != 0;
            } else {
                BURIN_TRY(channel_.get_param(kAutoExposure, &value));
                range->value = value != 0;
            }
            range->normal = 1;
            break;
        case SourceControl::colour_exposure_us: {
            const SensorStream* s = stream_of(StreamKind::colour);
            const double line_us = s->mode_.format == WireFormat::bayer ? kShutterBayer_us : kShutterUyvy_us;
            BURIN_TRY(channel_.get_cmos(kCmosShutter, &value));
            range->value = value * line_us;
            range->least = range->step = line_us;
            range->most = range->normal = 1e6 / s->mode_.fps;
            break;
        }
        case SourceControl::close_range:
            if (!kinect) {
                BURIN_TRY(channel_.get_param(kCloseRange, &value));
                range->value = value != 0;
            }
            break;
        default:  // emitter: cannot be read; what was set last
            range->normal = 1;
            break;
    }
    return {};
}

Status UsbSensor::set(SourceControl control, double value) {
    if (!(controls_ & control_bit(control)))
        return Status::error(Code::unsupported, "%s has no such control", name_);
    const bool kinect = model_.family == SensorFamily::kinect;
    const bool exposure = control == SourceControl::colour_exposure_us;
    if (!exposure && value != 0 && value != 1)
        return Status::error(Code::invalid_argument, "%s: the value is %g, expected 0 or 1", name_, value);
    const std::uint16_t on = value == 1;
    switch (control) {
        case SourceControl::mirror:
            if (stream_of(StreamKind::depth)) BURIN_TRY(write({{kDepthMirror, on}}));
            if (stream_of(StreamKind::colour)) BURIN_TRY(write({{kImageMirror, on}}));
            if (stream_of(StreamKind::infrared)) BURIN_TRY(write({{kInfraredMirror, on}}));
            break;
        case SourceControl::colour_auto_exposure:
            if (kinect) {
                std::uint16_t flags = 0;
                BURIN_TRY(channel_.get_cmos(kCmosAuto, &flags));
                flags = static_cast<std::uint16_t>(on ? flags | kAutoExposureBit : flags & ~kAutoExposureBit);
                BURIN_TRY(channel_.set_cmos(kCmosAuto, flags));
            } else {
                BURIN_TRY(write({{kAutoExposure, on}}));
            }
            break;
        case SourceControl::colour_exposure_us: {
            const SensorStream* s = stream_of(StreamKind::colour);
            const double line_us = s->mode_.format == WireFormat::bayer ? kShutterBayer_us : kShutterUyvy_us;
            const double most = 1e6 / s->mode_.fps;
            if (!(value >= line_us && value <= most))
                return Status::error(Code::invalid_argument, "%s: an exposure of %g us, expected %g..%g",
                                     name_, value, line_us, most);
            BURIN_TRY(
                channel_.set_cmos(kCmosShutter, static_cast<std::uint16_t>(std::lround(value / line_us))));
            break;
        }
        case SourceControl::close_range:
            if (kinect) {
                BURIN_TRY(write({{kInfraredGain, on ? kNearGain : kFarGain}}));
                sleep_until_ns(monotonic_ns() + kNearPause_ns);
                BURIN_TRY(write({{kNearRegister, on ? kNear : kFar}}));
            } else {
                BURIN_TRY(write({{kCloseRange, on}}));
            }
            break;
        default: {  // emitter
            BURIN_TRY(channel_.request(Opcode::emitter, &on, 1, nullptr, 0, nullptr));
            break;
        }
    }
    control_values_[static_cast<int>(control)] = value;
    return {};
}

}  // namespace burin
