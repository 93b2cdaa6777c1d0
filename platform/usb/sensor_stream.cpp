// SPDX-License-Identifier: MIT
// Starting and stopping the streams of a sensor, and the way of a frame to the sink.
#include <algorithm>
#include <cmath>

#include "capture/monotonic.h"
#include "platform/usb/usb_sensor.h"

namespace burin {
namespace {

// Parameters by the names of OpenNI2, XnParams.h.
constexpr std::uint16_t kRegistration = 2, kStream0 = 5, kStream1 = 6;
constexpr std::uint16_t kImageFormat = 12, kImageResolution = 13, kImageFps = 14;
constexpr std::uint16_t kDepthFormat = 18, kDepthResolution = 19, kDepthFps = 20;
constexpr std::uint16_t kInfraredFormat = 25, kInfraredResolution = 26, kInfraredFps = 27;
constexpr std::uint16_t kImageCrop = 50, kDepthCrop = 55, kInfraredCrop = 60;
constexpr std::uint16_t kProjectorCycle = 0x105;  // Kinect: pauses the projector by itself
constexpr std::uint16_t kOff = 0, kImage = 1, kDepth = 2, kInfrared = 3;

// Payload of all packets of a frame but the last (libfreenect, cameras.c).
constexpr int kKinectDepthPacket = 1748, kKinectImagePacket = 1908;
// The depth camera has 8 rows more than it delivers, but for its full size (OpenNI2, XnIRProcessor.cpp;
// libfreenect). The device sends them.
constexpr int kExtraRows = 8;

// The time between frames is averaged over so many.
constexpr double kPeriodFrames = 4;

// One line a stream a second at most, however bad the cable is.
constexpr std::int64_t kLogPeriod_ns = 1'000'000'000;

}  // namespace

Status UsbSensor::write(std::initializer_list<Param> params) {
    for (const Param& p : params) BURIN_TRY(channel_.set_param(p.param, p.value));
    return {};
}

Status UsbSensor::begin(SensorStream& s) {
    const std::uint16_t code = s.mode_.code, resolution = s.mode_.resolution, fps = s.mode_.fps;
    const bool kinect = model_.family == SensorFamily::kinect;
    // Unknown to older firmware, which does without.
    const auto optional = [&](std::uint16_t param, std::uint16_t value) {
        Status set = channel_.set_param(param, value);
        return set.code() == Code::unsupported ? Status() : set;
    };
    s.on_ = true;
    switch (s.kind_) {
        case StreamKind::depth:
            if (kinect) BURIN_TRY(write({{kProjectorCycle, 0}, {kStream1, kOff}}));
            BURIN_TRY(write({{kDepthFormat, code}, {kDepthResolution, resolution}, {kDepthFps, fps}}));
            if (!kinect) BURIN_TRY(optional(kRegistration, 0));
            BURIN_TRY(write({{kStream1, kDepth}}));
            if (!kinect) BURIN_TRY(optional(kDepthCrop, 0));
            break;
        case StreamKind::colour:
            BURIN_TRY(write({{kImageFormat, code}, {kImageResolution, resolution}, {kImageFps, fps}}));
            BURIN_TRY(write({{kStream0, kImage}}));
            if (!kinect) BURIN_TRY(optional(kImageCrop, 0));
            break;
        default:
            // The firmware sends its full size only after depth ran once (libfreenect, cameras.c).
            if (kinect && resolution == 2)
                BURIN_TRY(
                    write({{kDepthResolution, 1}, {kDepthFps, 30}, {kStream1, kDepth}, {kStream1, kOff}}));
            BURIN_TRY(
                write({{kInfraredFormat, code}, {kInfraredResolution, resolution}, {kInfraredFps, fps}}));
            if (kinect) BURIN_TRY(write({{kProjectorCycle, 0}}));
            BURIN_TRY(write({{kStream0, kInfrared}}));
            if (!kinect) BURIN_TRY(optional(kInfraredCrop, 0));
            break;
    }
    return {};
}

Status UsbSensor::start(SourceSink* sink) {
    sink_ = sink;
    gone_ = false;
    for (int i = 0; i < note_count_; ++i) sink->log(LogLevel::warning, "%s", notes_[i]);
    note_count_ = 0;
    clock_.reset(ticks_per_second_);
    const bool kinect = model_.family == SensorFamily::kinect;
    started_ = true;
    Status begun;
    for (int i = 0; i < stream_count_ && begun.ok(); ++i) {
        SensorStream& s = streams_[i];
        const int pixels = s.mode_.width * s.mode_.height;
        const bool depth = s.kind_ == StreamKind::depth,
                   extra = s.kind_ == StreamKind::infrared && s.mode_.resolution != 2;
        const int wire_pixels = pixels + (extra ? kExtraRows * s.mode_.width : 0);
        FrameLayout layout;
        layout.stream = depth ? PacketStream::depth : PacketStream::image;
        layout.pixels = pixels;
        if (kinect) {
            layout.bytes = wire_bytes(s.mode_.format, wire_pixels);
            layout.packet_bytes = depth ? kKinectDepthPacket : kKinectImagePacket;
            layout.id_bits = 8;
            layout.capacity = layout.bytes;
        } else {
            // Any format may come from firmware that does as it likes, and the compressed one is the longest.
            layout.capacity =
                depth ? wire_bytes(WireFormat::ps_depth, pixels) : wire_bytes(s.mode_.format, wire_pixels);
            layout.padded = depth && firmware_at_least(5, 1, 0);
        }
        s.parser_.reset(&s.assembler_, kinect                    ? PacketFraming::whole
                                       : s.endpoint_.isochronous ? PacketFraming::datagrams
                                                                 : PacketFraming::stream);
        s.sequence_ = 0;
        s.last_device_ns_ = s.last_log_ns_ = 0;
        s.any_stamp_ = s.gap_ = s.told_format_ = false;
        s.untimed_ = s.unlogged_ = 0;
        s.period_ns_ = 1e9 / s.mode_.fps;
        if (!s.assembler_.reset(layout, &s) ||
            !s.decoder_.reset(s.kind_, s.mode_, depth_table_, model_.formats_as_they_come))
            begun = Status::error(Code::insufficient_memory, "%s: no memory for frames of %s", name_,
                                  stream_name(s.kind_));
        // Transfers first: the first packets come with the last parameter.
        if (begun.ok()) begun = camera_->open_pipe(s.endpoint_, &s);
    }
    for (int i = 0; i < stream_count_ && begun.ok(); ++i) begun = begin(streams_[i]);
    if (begun.ok() && control_values_[static_cast<int>(SourceControl::mirror)] == 0) {
        const Status mirrored = set(SourceControl::mirror, 0);
        if (mirrored.code() == Code::disconnected) begun = mirrored;
    }
    if (!begun.ok()) {
        (void)stop();
        return begun;
    }
    if (wishes_.accelerometer && motor_) accelerometer_.start(motor_, sink);
    return {};
}

Status UsbSensor::pump(std::int64_t deadline_ns) {
    BURIN_TRY(accelerometer_.pump(monotonic_ns()));
    Status pumped = camera_->pump(deadline_ns);
    gone_ = pumped.code() == Code::disconnected;
    return pumped;
}

Status UsbSensor::stop() {
    if (!started_) return {};
    started_ = false;
    accelerometer_.stop();
    Status stopped;
    for (int i = 0; i < stream_count_; ++i) {
        SensorStream& s = streams_[i];
        // One that does not answer is not asked again: each question takes most of a second.
        if (s.on_ && !gone_ && stopped.ok())
            stopped = channel_.set_param(s.kind_ == StreamKind::depth ? kStream1 : kStream0, kOff);
        s.on_ = false;
    }
    const int left = camera_->close_pipes();
    if (left > 0)
        sink_->log(LogLevel::warning, "%s: the system has not given back %d transfers", name_, left);
    return stopped.code() == Code::disconnected ? Status() : stopped;
}

void SensorStream::log_fault(const RawFrame& frame, std::int64_t host_ns) {
    ++unlogged_;
    if (last_log_ns_ != 0 && host_ns - last_log_ns_ < kLogPeriod_ns) return;
    last_log_ns_ = host_ns;
    char lost[40] = "";
    if (frame.packets_lost > 0) std::snprintf(lost, sizeof lost, " (%d packets)", frame.packets_lost);
    sensor_->sink_->log(LogLevel::warning,
                        "%s: %s frame %llu is damaged: %s%s; %d bytes came; %d since the last line",
                        sensor_->name_, stream_name(kind_), static_cast<unsigned long long>(sequence_),
                        fault_text(frame.fault), lost, frame.bytes, unlogged_);
    unlogged_ = 0;
}

void SensorStream::frame(const RawFrame& raw) {
    RawFrame frame = raw;
    SourceSink& sink = *sensor_->sink_;
    ImageStamp stamp;
    stamp.host_ns = monotonic_ns();
    // Without depth, the stamps of infrared stand still (OpenNI2, XnIRProcessor.cpp).
    const bool clocked = kind_ != StreamKind::infrared || sensor_->stream_of(StreamKind::depth);
    stamp.has_device_time =
        frame.has_stamp && clocked && sensor_->clock_.ns(frame.stamp, stamp.host_ns, &stamp.device_ns);
    // Frames have no number. Where packets are missing, time says how many frames were between: by how long
    // they have taken so far, since a device may be slower than it was told.
    std::uint64_t step = 1;
    gap_ = gap_ || frame.after_gap || frame.packets_lost > 0;
    if (stamp.has_device_time && any_stamp_) {
        const double passed_ns = static_cast<double>(stamp.device_ns - last_device_ns_);
        if (gap_) {
            step = static_cast<std::uint64_t>(
                std::clamp(std::nearbyint(passed_ns / period_ns_) - untimed_, 1.0, 1000.0));
        } else {
            period_ns_ = std::fmax(1e9 / mode_.fps, period_ns_ + (passed_ns - period_ns_) / kPeriodFrames);
        }
    }
    sequence_ += step;
    if (stamp.has_device_time) {
        last_device_ns_ = stamp.device_ns;
        any_stamp_ = true;
        gap_ = false;
        untimed_ = 0;
        sensor_->accelerometer_.image_at(stamp.device_ns, stamp.host_ns);
    } else {
        ++untimed_;
    }
    stamp.sequence = sequence_;

    const WireFormat came = decoder_.format_of(frame);
    if (came != mode_.format && !told_format_ && frame.fault == FrameFault::none) {
        told_format_ = true;
        sink.log(LogLevel::info, "%s was told %s and sends %s; it is taken as it comes", sensor_->name_,
                 wire_name(mode_.format), wire_name(came));
    }
    std::uint8_t* image = sink.acquire(kind_);
    if (!image) return;
    std::uint8_t* into = unregistered_ ? reinterpret_cast<std::uint8_t*>(unregistered_.get()) : image;
    if (!decoder_.decode(frame, into) && frame.fault == FrameFault::none)
        frame.fault = FrameFault::wrong_size;
    if (unregistered_)
        sensor_->registration_.apply(unregistered_.get(), reinterpret_cast<std::uint16_t*>(image));
    stamp.damaged = frame.fault != FrameFault::none;
    if (stamp.damaged) log_fault(frame, stamp.host_ns);
    sink.commit(kind_, image, stamp);
}

}  // namespace burin
