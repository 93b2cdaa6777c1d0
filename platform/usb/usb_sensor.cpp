// SPDX-License-Identifier: MIT
// Opening: what the device tells, and what is made of it. Streaming: sensor_stream.cpp; controls:
// sensor_controls.cpp.
#include "platform/usb/usb_sensor.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>

#include "platform/usb/bytes.h"

namespace burin {
namespace {

// Kinect: libfreenect's numbers; PrimeSense: OpenNI2, XnHostProtocolAlgorithmType.
constexpr std::uint16_t kDepthInfo = 0, kFrequency = 0x80;
constexpr std::uint16_t kKinectRegistration = 0x40, kKinectPadding = 0x41;
constexpr std::uint16_t kPrimeSenseRegistration = 2, kPrimeSensePadding = 3;
constexpr int kFixedParamsBytes = 168;
constexpr int kVga = 1;

// Kinect's colour camera where the device's table gives none: the focal length that Kinect's users take
// (ROS openni_launch, TUM RGB-D benchmark), in pixels of 640.
constexpr double kNominalColourFocal = 525;

// An error after which to ask for less important things is of no use.
bool hopeless(const Status& s) {
    return s.code() == Code::disconnected || s.code() == Code::timeout || s.code() == Code::denied;
}

Camera scaled(const Camera& vga, int width, int height) {
    // Sizes of one sensor are cut to 4:3 from the top and shrunk (libfreenect, of 1280 x 1024).
    const double s = width / 640.0;
    Camera c = vga;
    c.width = width, c.height = height;
    c.fx *= s, c.fy *= s;
    c.cx = (c.cx + 0.5) * s - 0.5, c.cy = (c.cy + 0.5) * s - 0.5;
    return c;
}

}  // namespace

UsbSensor::UsbSensor(const SensorModel& model, UsbIo* camera, UsbIo* motor, const char* name)
    : model_(model), camera_(camera), motor_(motor) {
    std::snprintf(name_, sizeof name_, "%s", name);
    channel_.attach(camera, name_);
}

void UsbSensor::note(const char* format, ...) {
    if (note_count_ == static_cast<int>(sizeof notes_ / sizeof *notes_)) return;
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(notes_[note_count_++], sizeof *notes_, format, arguments);
    va_end(arguments);
}

bool UsbSensor::firmware_at_least(int major, int minor, int build) const {
    const int wanted[] = {major, minor, build};
    return !std::lexicographical_compare(firmware_, firmware_ + 3, wanted, wanted + 3);
}

SensorStream* UsbSensor::stream_of(StreamKind kind) {
    for (int i = 0; i < stream_count_; ++i)
        if (streams_[i].kind_ == kind) return &streams_[i];
    return nullptr;
}

// Long answers come in pieces, each asked for by its offset in words.
Status UsbSensor::algorithm(std::uint16_t id, int resolution, int fps, std::uint8_t* data, int capacity,
                            int* bytes) {
    *bytes = 0;
    while (*bytes < capacity) {
        const std::uint16_t words[] = {id, 0, static_cast<std::uint16_t>(resolution),
                                       static_cast<std::uint16_t>(fps),
                                       static_cast<std::uint16_t>(*bytes / 2)};
        int got = 0;
        BURIN_TRY(
            channel_.request(Opcode::algorithm_params, words, 5, data + *bytes, capacity - *bytes, &got));
        if (got == 0) break;
        *bytes += std::min(got, capacity - *bytes);
    }
    return {};
}

Status UsbSensor::read_primesense_version() {
    std::uint8_t data[12];
    int bytes = 0;
    BURIN_TRY(channel_.request(Opcode::version, nullptr, 0, data, sizeof data, &bytes));
    if (bytes < 4)
        return Status::error(Code::format, "%s: the version has %d bytes, expected at least 4", name_, bytes);
    firmware_[0] = data[1];
    firmware_[1] = data[0];
    const int build = le16(data + 2);  // binary-coded decimal
    firmware_[2] = build / 4096 * 1000 + build / 256 % 16 * 100 + build / 16 % 16 * 10 + build % 16;
    if (!firmware_at_least(5, 0, 0))
        return Status::error(Code::unsupported, "%s has firmware %d.%d.%d, expected 5.0 or newer", name_,
                             firmware_[0], firmware_[1], firmware_[2]);
    return {};
}

Status UsbSensor::open_primesense() {
    BURIN_TRY(read_primesense_version());
    std::uint8_t fixed[kFixedParamsBytes];
    int have = 0;
    while (have < kFixedParamsBytes) {
        const std::uint16_t offset = static_cast<std::uint16_t>(have / 4);
        int got = 0;
        BURIN_TRY(
            channel_.request(Opcode::fixed_params, &offset, 1, fixed + have, kFixedParamsBytes - have, &got));
        got = std::min(got, kFixedParamsBytes - have);
        have += got;
        if (got < 4) break;  // no progress: what there is gets checked below
    }
    BURIN_TRY(parse_fixed_params(fixed, have, name_, &geometry_));

    std::uint8_t data[kMaxReplyBytes];
    int bytes = 0;
    Status asked = algorithm(kFrequency, 0, 0, data, 4, &bytes);
    const double mhz = asked.ok() && bytes == 4 ? static_cast<double>(le_float(data)) : 0;
    if (mhz >= 1 && mhz <= 1000) {
        ticks_per_second_ = 1e6 * mhz;
    } else if (hopeless(asked)) {
        return asked;
    } else {
        note("%s tells a clock of %g MHz, expected 1..1000; taken for 60", name_, mhz);
    }
    if (model_.colour && firmware_at_least(5, 3, 29)) {
        const std::uint16_t image = 0;
        asked = channel_.request(Opcode::cmos_presets, &image, 1, data, sizeof data, &bytes);
        if (asked.ok())
            colour_presets_ = parse_colour_presets(data, std::min<int>(bytes, sizeof data));
        else if (hopeless(asked))
            return asked;
    }
    return {};
}

Status UsbSensor::open_kinect() {
    const std::uint16_t zeros[5] = {};
    std::uint8_t fixed[kMaxReplyBytes];
    int bytes = 0;
    BURIN_TRY(channel_.request(Opcode::fixed_params, zeros, 5, fixed, sizeof fixed, &bytes));
    return parse_fixed_params(fixed, std::min<int>(bytes, sizeof fixed), name_, &geometry_);
}

Status UsbSensor::read_constants(std::uint16_t registration_id, std::uint16_t padding_id) {
    std::uint8_t data[kRegistrationBytes];
    int bytes = 0;
    const SensorStream* depth = stream_of(StreamKind::depth);
    const bool primesense = model_.family == SensorFamily::primesense;
    const int resolution = primesense && depth ? depth->mode_.resolution : kVga;
    const int fps = primesense && depth ? depth->mode_.fps : 30;
    if (depth) {
        BURIN_TRY(algorithm(kDepthInfo, resolution, fps, data, 2, &bytes));
        BURIN_TRY(parse_const_shift(data, bytes, name_, &geometry_));
    }
    T_colour_depth_ = colour_from_depth(geometry_);
    // The table is of use for colour alone.
    if (!wishes_.registered && !stream_of(StreamKind::colour)) return {};
    Status table = algorithm(registration_id, kVga, 30, data, kRegistrationBytes, &bytes);
    if (table.ok()) table = parse_registration(data, bytes, name_, &polynomial_);
    if (table.ok()) table = algorithm(padding_id, kVga, 30, data, kPaddingBytes, &bytes);
    if (table.ok()) table = parse_padding(data, bytes, name_, &polynomial_);
    if (hopeless(table)) return table;
    if (table.ok() && polynomial_.empty())
        table = Status::error(Code::format, "%s has an empty registration table", name_);
    if (table.ok() && !registration_.build(polynomial_, geometry_))
        return Status::error(Code::insufficient_memory, "%s: no memory for the registration table", name_);
    const Camera depth_vga = depth_camera(geometry_, 640, 480);
    double residual_px = 0;
    if (table.ok()) {
        colour_fitted_ =
            registration_.fit_camera(depth_vga, geometry_, &colour_camera_, &T_colour_depth_, &residual_px);
        if (!colour_fitted_)
            table = Status::error(Code::format, "%s: the registration table fits no camera (%.3g pixels off)",
                                  name_, residual_px);
    }
    if (!colour_fitted_) {
        if (wishes_.registered)
            return Status::error(Code::unsupported, "depth cannot be registered: %.400s", table.text());
        note("%.150s; colour gets nominal intrinsics", table.text());
        const double f = kNominalColourFocal;
        colour_camera_ = {640, 480, f, f, 319.5, 239.5};
    }
    return {};
}

void UsbSensor::describe(SensorStream& stream, StreamInfo* info) {
    const SensorMode& m = stream.mode_;
    StreamInfo& s = *info;
    s.kind = stream.kind_;
    std::snprintf(s.format, sizeof s.format, "%s", wire_name(m.format));
    s.width = m.width, s.height = m.height, s.fps = m.fps;
    switch (stream.kind_) {
        case StreamKind::depth:
            s.pixels = StreamPixels::u16;
            s.unit_m = 0.001;
            s.camera = wishes_.registered ? colour_camera_ : depth_camera(geometry_, m.width, m.height);
            s.calibrated = true;
            break;
        case StreamKind::colour:
            s.pixels = StreamPixels::colour;
            s.colour_format = FrameDecoder::colour_format(m.format);
            s.camera = scaled(colour_camera_, m.width, m.height);
            s.calibrated = colour_fitted_;
            if (!wishes_.registered) s.T_stream_depth = T_colour_depth_;
            break;
        default:
            s.pixels = StreamPixels::u16;
            s.camera = scaled(depth_camera(geometry_, 640, 480), m.width, m.height);
            s.calibrated = true;
            if (wishes_.registered) s.T_stream_depth = T_colour_depth_.inverse();
    }
    set_image_bytes(&s);
}

Status UsbSensor::add_stream(StreamKind kind, const SourceOptions& o, DeviceInfo* info) {
    const bool kinect = model_.family == SensorFamily::kinect, depth = kind == StreamKind::depth;
    ModeList modes = kinect ? kinect_modes(kind) : primesense_modes(kind, wishes_.isochronous);
    if (kind == StreamKind::colour && colour_presets_.count > 0) modes = colour_presets_;
    SensorStream& s = streams_[stream_count_];
    // Infrared comes from the depth camera: its size and rate are those of depth.
    const bool colour = kind == StreamKind::colour;
    const int width = colour ? o.colour_width : o.depth_width,
              height = colour ? o.colour_height : o.depth_height;
    const char* format = depth ? o.depth_format : colour ? o.colour_format : "";
    BURIN_TRY(choose_mode(modes, kind, width, height, o.fps, format, name_, &s.mode_));
    s.sensor_ = this;
    s.kind_ = kind;
    s.on_ = false;
    ++stream_count_;
    (void)info;
    return {};
}

Status UsbSensor::choose_streams(const SourceOptions& o, DeviceInfo* info) {
    const auto wanted = [&](StreamKind kind) { return (o.streams & stream_bit(kind)) != 0; };
    const bool colour = wanted(StreamKind::colour) && model_.colour, infrared = wanted(StreamKind::infrared);
    if (colour && infrared)
        return Status::error(Code::unsupported,
                             "%s sends colour or infrared, not both: they share a stream; ask for one",
                             name_);
    stream_count_ = 0;
    if (wanted(StreamKind::depth)) BURIN_TRY(add_stream(StreamKind::depth, o, info));
    if (colour) BURIN_TRY(add_stream(StreamKind::colour, o, info));
    if (infrared) BURIN_TRY(add_stream(StreamKind::infrared, o, info));
    const SensorStream *d = stream_of(StreamKind::depth), *ir = stream_of(StreamKind::infrared);
    if (d && ir && ir->mode_.resolution > kVga && ir->mode_.resolution < 4)
        return Status::error(Code::unsupported, "%s sends infrared of %dx%d without depth only", name_,
                             ir->mode_.width, ir->mode_.height);
    if (wishes_.registered && d && d->mode_.resolution != kVga)
        return Status::error(Code::unsupported, "%s registers depth of 640x480 only, %dx%d was asked for",
                             name_, d->mode_.width, d->mode_.height);
    return {};
}

Status UsbSensor::find_endpoints() {
    const bool kinect = model_.family == SensorFamily::kinect;
    const bool isochronous = kinect || wishes_.isochronous;
    // Depth and image changed places in Kinect and in firmware before 5.2 (OpenNI2, XnDeviceSensorInit.cpp).
    const bool swapped = kinect || !firmware_at_least(5, 2, 0);
    if (model_.alternate >= 0)
        alternate_ = model_.alternate;
    else
        alternate_ = isochronous == firmware_at_least(5, 5, 0) ? 1 : 0;
    const int guess = alternate_;
    // The descriptors have the last word.
    for (int turn = 0; turn < 4; ++turn) {
        alternate_ = turn == 0 ? guess : turn <= guess ? turn - 1 : turn;
        bool all = true;
        for (int i = 0; i < stream_count_ && all; ++i) {
            SensorStream& s = streams_[i];
            const std::uint8_t address = (s.kind_ == StreamKind::depth) != swapped ? 0x81 : 0x82;
            all = camera_->endpoint(alternate_, address, &s.endpoint_) &&
                  s.endpoint_.isochronous == isochronous && s.endpoint_.packet_bytes > 0 &&
                  s.endpoint_.packet_bytes <= 3 * 1024 * 16;
        }
        if (all) return alternate_ == 0 ? Status() : camera_->select_alternate(alternate_);
    }
    return Status::error(Code::format, "%s has no %s endpoints for depth and image in its descriptors", name_,
                         isochronous ? "isochronous" : "bulk");
}

Status UsbSensor::open(const SourceOptions& options, const SensorWishes& wishes, DeviceInfo* info) {
    wishes_ = wishes;
    const bool kinect = model_.family == SensorFamily::kinect;
    BURIN_TRY(kinect ? open_kinect() : open_primesense());
    BURIN_TRY(choose_streams(options, info));
    BURIN_TRY(find_endpoints());
    BURIN_TRY(read_constants(kinect ? kKinectRegistration : kPrimeSenseRegistration,
                             kinect ? kKinectPadding : kPrimeSensePadding));
    for (int i = 0; i < stream_count_; ++i) {
        SensorStream& s = streams_[i];
        describe(s, &info->at(s.kind_));
        if (s.kind_ == StreamKind::depth) {
            // 60 images a second come from half the sensor's pixels (OpenNI2,
            // RecalculateReferenceResolution).
            build_depth_table(geometry_, s.mode_.fps == 60 ? 2 : 1, depth_table_);
            if (wishes_.registered) {
                s.unregistered_.reset(new (std::nothrow) std::uint16_t[640 * 480]);
                if (!s.unregistered_)
                    return Status::error(Code::insufficient_memory, "%s: no memory for registration", name_);
            }
        }
    }
    controls_ = control_bit(SourceControl::mirror);
    if (kinect) {
        if (model_.close_range) controls_ |= control_bit(SourceControl::close_range);
        if (stream_of(StreamKind::colour))
            controls_ |= control_bit(SourceControl::colour_auto_exposure) |
                         control_bit(SourceControl::colour_exposure_us);
    } else {
        if (firmware_at_least(5, 4, 0) && stream_of(StreamKind::colour))
            controls_ |= control_bit(SourceControl::colour_auto_exposure);
        if (firmware_at_least(5, 6, 0)) controls_ |= control_bit(SourceControl::close_range);
        if (firmware_at_least(5, 8, 15)) controls_ |= control_bit(SourceControl::emitter);
    }
    info->controls = controls_;
    info->has_imu = wishes_.accelerometer && motor_ != nullptr;
    // Level and at rest y reads +1 g, so y is up; x and z as a turn about x by half a circle has them.
    info->T_camera_imu.R = Mat3d{{1, 0, 0, 0, -1, 0, 0, 0, -1}};
    if (wishes_.accelerometer && !motor_)
        note("%s: the accelerometer's device (045e:02b0) is not there or not open to us", name_);
    return {};
}

}  // namespace burin
