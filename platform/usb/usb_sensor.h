// SPDX-License-Identifier: MIT
// One open sensor, whatever is below it: the sequences that start and stop it, its streams, its clock.
#pragma once

#include <memory>

#include "capture/source.h"
#include "platform/usb/accelerometer.h"
#include "platform/usb/control_channel.h"
#include "platform/usb/frame_decoder.h"
#include "platform/usb/registration.h"
#include "platform/usb/sensor_models.h"
#include "platform/usb/tick_clock.h"
#include "platform/usb/usb_io.h"

namespace burin {

struct SensorWishes {
    bool isochronous = false;    // PrimeSense: rather than bulk
    bool registered = false;     // depth as the colour camera sees it, by the device's table
    bool accelerometer = false;  // Kinect: hand out its readings
};

class UsbSensor;

// One stream: packets to frames to images to the sink.
class SensorStream final : public UsbReceiver, public FrameTarget {
  public:
    void bytes(const std::uint8_t* data, int length) override { parser_.bytes(data, length); }
    void lost() override { parser_.lost(); }
    void frame(const RawFrame& frame) override;

  private:
    friend class UsbSensor;
    void log_fault(const RawFrame& frame, std::int64_t host_ns);

    UsbSensor* sensor_ = nullptr;
    StreamKind kind_ = StreamKind::depth;
    SensorMode mode_;
    UsbEndpoint endpoint_;
    bool on_ = false;
    FrameLayout layout_;
    PacketParser parser_;
    FrameAssembler assembler_;
    FrameDecoder decoder_;
    std::uint64_t sequence_ = 0;
    std::int64_t last_device_ns_ = 0;
    double period_ns_ = 0;
    bool any_stamp_ = false;
    bool gap_ = false;  // packets are missing since the last stamp
    int untimed_ = 0;   // frames since the last stamp
    std::int64_t last_log_ns_ = 0;
    int unlogged_ = 0;
    bool told_format_ = false;
    std::unique_ptr<std::uint16_t[]> unregistered_;
};

class UsbSensor {
  public:
    // `camera` and `motor` (may be null) live as long as this. `name` is for people and messages.
    UsbSensor(const SensorModel& model, UsbIo* camera, UsbIo* motor, const char* name);

    // Reads the calibration, chooses modes. Errors: those of SourceBackend::open.
    Status open(const SourceOptions& options, const SensorWishes& wishes, DeviceInfo* info);
    Status start(SourceSink* sink);
    Status pump(std::int64_t deadline_ns);
    Status stop();
    Status get(SourceControl control, ControlRange* range);
    Status set(SourceControl control, double value);

    const DepthGeometry& geometry() const { return geometry_; }

  private:
    friend class SensorStream;
    static constexpr int kStreams = 2;
    struct Param {
        std::uint16_t param, value;
    };

    Status open_kinect();
    Status open_primesense();
    Status read_primesense_version();
    Status read_constants(std::uint16_t registration_id, std::uint16_t padding_id);
    Status algorithm(std::uint16_t id, int resolution, int fps, std::uint8_t* data, int capacity, int* bytes);
    Status choose_streams(const SourceOptions& options, DeviceInfo* info);
    Status add_stream(StreamKind kind, const SourceOptions& options, DeviceInfo* info);
    void describe(SensorStream& stream, StreamInfo* info);
    Status find_endpoints();
    Status begin(SensorStream& stream);
    Status write(std::initializer_list<Param> params);
    bool firmware_at_least(int major, int minor, int build) const;
    SensorStream* stream_of(StreamKind kind);

    const SensorModel& model_;
    UsbIo* camera_;
    UsbIo* motor_;
    char name_[96];
    ControlChannel channel_;
    SensorWishes wishes_;
    DepthGeometry geometry_;
    RegistrationPolynomial polynomial_;
    Registration registration_;
    Camera colour_camera_;
    Se3 T_colour_depth_;
    bool colour_fitted_ = false;
    int firmware_[3] = {};
    double ticks_per_second_ = 60e6;
    int alternate_ = 0;
    ModeList colour_presets_;
    std::uint16_t depth_table_[kShifts] = {};
    SensorStream streams_[kStreams];
    int stream_count_ = 0;
    TickClock clock_;
    Accelerometer accelerometer_;
    SourceSink* sink_ = nullptr;
    bool started_ = false, gone_ = false;
    unsigned controls_ = 0;
    double control_values_[kSourceControls] = {};
    char notes_[3][200] = {};  // what open had to say, logged at start
    int note_count_ = 0;
    void note(const char* format, ...) __attribute__((format(printf, 2, 3)));
};

}  // namespace burin
