// SPDX-License-Identifier: MIT
// The interface every sensor implements: one table of functions a back end, and the sink that takes what it
// captures. How to write one, step by step: platform/PORTING.md. The smallest one: platform/null. Recorded
// data sets: capture/dataset.h.
//
// Who does what. A back end lists, opens and runs devices of one kind, and unpacks their pixels. Everything
// that sensors share is above it (capture/live_source.h): the thread that calls pump(), the ring of images,
// drops, pairing by time, clocks, statistics, registration, and the way back after a cable was pulled.
#pragma once

#include <cstdint>

#include "capture/stream.h"
#include "core/imu.h"
#include "core/status.h"

namespace burin {

// -------------------------------------------------------------------------------------------------------
// devices

// Why a device that is there cannot be opened now. The numeric values are those of burin_device_access.
enum class DeviceAccess : std::uint8_t { ready, busy, denied, unsupported };

// One device as list() finds it. Texts are cut to fit and always end in a zero.
struct DeviceEntry {
    char address[160] = "";  // what open() takes: "/dev/video0", "1d27:0601@1-2.3"
    char name[96] = "";      // for people: "Kinect v1 (Xbox NUI Camera)"
    char serial[64] = "";    // empty when the device tells none
    char location[64] = "";  // where it is plugged, the same after a replug: "usb-0000:00:14.0-2"
    char driver[32] = "";    // of the kernel, which has it now: "uvcvideo", "gspca_kinect"; may be empty
    char formats[256] = "";  // "depth Z16 640x480@30, colour YUYV 640x480@30"
    DeviceAccess access = DeviceAccess::ready;
    char hint[256] = "";  // when not ready: why, and what to do, one sentence
};

using DeviceVisit = void (*)(void* user, const DeviceEntry& entry);

// -----------------------------------------------------------------------------------------------------------
// open

struct SourceOptions {
    unsigned streams =
        stream_bit(StreamKind::depth) | stream_bit(StreamKind::colour);  // wanted, by stream_bit
    int depth_width = 0, depth_height = 0;  // 0: the device's own choice; else this or an error
    int colour_width = 0, colour_height = 0;
    double fps = 0;              // 0: the fastest at that size
    char depth_format[24] = "";  // by the name in StreamInfo::format; empty: the best there is
    char colour_format[24] = "";
    char calibration[256] = "";  // path of a calibration file, for devices that know none of theirs
    char layout[256] = "";       // raw words of ToF boards: see platform/v4l2/raw_layout.h
    int fd = -1;                 // an open descriptor in place of an address (Android), not closed by us
    int buffers = 4;             // of the kernel's, per stream, 2..32
    bool lend = true;            // images may stay in the kernel's memory (dmabuf, mmap): no copy at all
};

struct DeviceInfo {
    char name[96] = "";
    char serial[64] = "";
    char location[64] = "";
    StreamInfo streams[kStreamKinds];  // by StreamKind; width 0: not delivered
    bool has_imu = false;
    Se3 T_camera_imu;       // IMU coordinates to depth camera coordinates
    unsigned controls = 0;  // by control_bit: those that get and set take

    bool has(StreamKind kind) const { return streams[static_cast<int>(kind)].width > 0; }
    StreamInfo& at(StreamKind kind) { return streams[static_cast<int>(kind)]; }
    const StreamInfo& at(StreamKind kind) const { return streams[static_cast<int>(kind)]; }
};

// The numeric values are those of burin_control.
enum class SourceControl : std::uint8_t {
    depth_exposure_us,
    depth_gain,
    depth_auto_exposure,  // 0 or 1
    laser_power_mw,
    emitter,  // 0 or 1
    colour_exposure_us,
    colour_gain,
    colour_auto_exposure,  // 0 or 1
    mirror,                // 0 or 1
    close_range,           // 0 or 1
};
inline constexpr int kSourceControls = 10;
inline constexpr unsigned control_bit(SourceControl c) { return 1u << static_cast<unsigned>(c); }

struct ControlRange {
    double value = 0, least = 0, most = 0, step = 0, normal = 0;
};

// --------------------------------------------------------------------------------------------------------
// captured

// What a back end knows of one image.
struct ImageStamp {
    std::uint64_t sequence =
        0;  // of the device or its driver, this stream's own, rising by 1: gaps are losses
    std::int64_t device_ns = 0;  // the device's clock, wrap-around undone; only when has_device_time
    std::int64_t host_ns = 0;    // CLOCK_MONOTONIC when the last byte had come
    bool has_device_time = false;
    bool damaged = false;  // parts are missing or the driver flagged an error: delivered only when asked for
    const Camera* camera = nullptr;  // this image's intrinsics where they change; read during the call
};

enum class LogLevel : std::uint8_t { error, warning, info };

// Where a back end puts what it captured. Called by the thread inside pump() only. Never allocates, never
// fails.
class SourceSink {
  public:
    virtual ~SourceSink() = default;

    // Room for one image of StreamInfo::image_bytes, 64-byte aligned, until commit() or abandon(). nullptr:
    // there is none (a consumer too slow and nothing may be dropped): the image is to be passed over, it is
    // counted.
    virtual std::uint8_t* acquire(StreamKind kind) = 0;
    virtual void commit(StreamKind kind, std::uint8_t* image, const ImageStamp& stamp) = 0;
    // The image came to nothing (damaged beyond use); counted as damaged.
    virtual void abandon(StreamKind kind, std::uint8_t* image) = 0;

    // An image in the back end's own memory: needs no unpacking, rows of stride_bytes. It stays untouched
    // until SourceBackend::give_back(device, token), which comes later, from any thread, exactly once (also
    // before or during stop). dmabuf_fd: a descriptor of the same memory, or -1.
    virtual void lend(StreamKind kind, const std::uint8_t* image, std::size_t stride_bytes,
                      std::uint64_t token, int dmabuf_fd, const ImageStamp& stamp) = 0;

    // In the order of time; t_ns on the device's clock where images have one, else CLOCK_MONOTONIC.
    virtual void imu(const ImuSample& sample) = 0;

    // Images that the back end itself had to drop, beside gaps in `sequence`: a broken packet, an unknown
    // frame.
    virtual void count_damaged(StreamKind kind, int images) = 0;

    // One line, no line end.
    virtual void log(LogLevel level, const char* format, ...) __attribute__((format(printf, 3, 4))) = 0;
};

// -------------------------------------------------------------------------------------------------------
// back ends

// One back end. Functions that a kind of device has no use for are null where it says so. Codes of errors,
// beside those each function names: disconnected (the device is gone: ENODEV, LIBUSB_ERROR_NO_DEVICE), busy
// (another program or driver has it), denied (no permission; the text names the udev rule file), io (the
// system refused), format (a reply or packet is not what the protocol demands; the text says which and what
// came), timeout.
//
// Threads: list may be called at any time. For one device: open, start, stop, close, get, set by one thread
// at a time; pump by one thread, between start and stop; set and get also during pump; give_back at any time
// between start and close. No call may block for longer than a second but pump up to its deadline. Memory:
// open and start may allocate, pump and give_back must not. Nothing throws.
struct SourceBackend {
    const char* name;   // the scheme of addresses: "v4l2" of "v4l2:/dev/video0"
    const char* about;  // one line for `burin devices`

    // Calls visit for every device of this kind that is plugged in, ready or not. ok with none. unsupported:
    // the system lacks something this back end needs (the text says what).
    Status (*list)(DeviceVisit visit, void* user);

    // Claims the device, reads its calibration, chooses formats; fills info. *device is the back end's own.
    // On error nothing is left open. unsupported: no such size, rate or format (the text lists those there
    // are).
    Status (*open)(const char* address, const SourceOptions& options, void** device, DeviceInfo* info);

    // Streams from now on into the sink, which outlives stop().
    Status (*start)(void* device, SourceSink* sink);

    // Hands over what has come; waits for something until deadline_ns (CLOCK_MONOTONIC). ok also when nothing
    // came. An error ends streaming (stop follows): disconnected is waited out by the caller, others it tells
    // on.
    Status (*pump)(void* device, std::int64_t deadline_ns);

    // Idempotent; also after a disconnect. The kernel's driver gets the device back at close.
    Status (*stop)(void* device);
    void (*close)(void* device);

    // Of a lent image; null when the back end lends none.
    void (*give_back)(void* device, std::uint64_t token);

    // unsupported: the device has no such control. invalid_argument: out of range (the text names it). May be
    // null.
    Status (*get)(void* device, SourceControl control, ControlRange* range);
    Status (*set)(void* device, SourceControl control, double value);
};

}  // namespace burin
