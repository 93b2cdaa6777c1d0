// SPDX-License-Identifier: MIT
#include "platform/null/null_backend.h"

#include <cstdio>
#include <cstring>
#include <ctime>
#include <new>

namespace burin {
namespace {

struct NullDevice {
    DeviceInfo info;
    unsigned streams = 0;
    SourceSink* sink = nullptr;
    std::int64_t start_ns = 0, period_ns = 0;
    std::uint64_t sequence = 0;
};

std::int64_t now_ns() {
    timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return std::int64_t(t.tv_sec) * 1000000000 + t.tv_nsec;
}

Status list(DeviceVisit visit, void* user) {
    DeviceEntry entry;
    std::snprintf(entry.name, sizeof entry.name, "made-up sensor");
    std::snprintf(entry.formats, sizeof entry.formats, "depth ramp 640x480@30, colour RGB 640x480@30");
    visit(user, entry);
    return {};
}

StreamInfo stream(StreamKind kind, int width, int height, double fps) {
    StreamInfo s;
    s.kind = kind;
    s.pixels = kind == StreamKind::depth ? StreamPixels::u16 : StreamPixels::colour;
    std::snprintf(s.format, sizeof s.format, kind == StreamKind::depth ? "ramp" : "RGB");
    s.width = width;
    s.height = height;
    s.fps = fps;
    // A horizontal view of 60 degrees, about that of the structured-light sensors.
    const double f = width * 0.866;
    s.camera = {width, height, f, f, (width - 1) / 2.0, (height - 1) / 2.0};
    s.calibrated = true;
    set_image_bytes(&s);
    return s;
}

Status open(const char* address, const SourceOptions& options, void** device, DeviceInfo* info) {
    int width = 640, height = 480, end = 0;
    double fps = 30;
    const bool written =
        *address == 0 ||
        (std::sscanf(address, "%dx%d@%lf%n", &width, &height, &fps, &end) == 3 && address[end] == 0);
    if (!written || width < 1 || height < 1 || width > 4096 || height > 4096 || !(fps > 0 && fps <= 1000))
        return Status::error(
            Code::invalid_argument,
            "null: '%.100s', expected WIDTHxHEIGHT@FPS with sides of 1..4096 and at most 1000 a second",
            address);
    if (options.depth_width > 0) width = options.depth_width, height = options.depth_height;
    auto* d = new (std::nothrow) NullDevice;
    if (!d) return Status::error(Code::insufficient_memory, "null: no memory for the device");
    std::snprintf(d->info.name, sizeof d->info.name, "made-up sensor");
    d->streams = options.streams;
    d->period_ns = static_cast<std::int64_t>(1e9 / fps);
    for (const StreamKind kind : {StreamKind::depth, StreamKind::colour})
        if (options.streams & stream_bit(kind)) d->info.at(kind) = stream(kind, width, height, fps);
    *info = d->info;
    *device = d;
    return {};
}

Status start(void* device, SourceSink* sink) {
    auto* d = static_cast<NullDevice*>(device);
    d->sink = sink;
    d->start_ns = now_ns();
    d->sequence = 0;
    return {};
}

void draw(const StreamInfo& s, std::uint64_t sequence, std::uint8_t* out) {
    for (int y = 0; y < s.height; ++y)
        for (int x = 0; x < s.width; ++x) {
            const std::size_t pixel = static_cast<std::size_t>(y) * s.width + x;
            if (s.kind == StreamKind::depth) {
                const std::uint16_t mm = null_depth_mm(x, y, sequence);
                std::memcpy(out + 2 * pixel, &mm, 2);
            } else {
                std::memset(out + 3 * pixel, ((x ^ y) & 32) ? 200 : 60, 3);
            }
        }
}

Status pump(void* device, std::int64_t deadline_ns) {
    auto* d = static_cast<NullDevice*>(device);
    const std::int64_t due_ns = d->start_ns + static_cast<std::int64_t>(d->sequence + 1) * d->period_ns;
    const std::int64_t until_ns = due_ns < deadline_ns ? due_ns : deadline_ns;
    const timespec until = {until_ns / 1000000000, until_ns % 1000000000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
    if (deadline_ns < due_ns) return {};
    for (const StreamKind kind : {StreamKind::colour, StreamKind::depth}) {
        if (!d->info.has(kind)) continue;
        std::uint8_t* image = d->sink->acquire(kind);
        if (!image) continue;
        draw(d->info.at(kind), d->sequence, image);
        ImageStamp stamp;
        stamp.sequence = d->sequence;
        stamp.device_ns = static_cast<std::int64_t>(d->sequence) * d->period_ns;
        stamp.has_device_time = true;
        stamp.host_ns = now_ns();
        d->sink->commit(kind, image, stamp);
    }
    ++d->sequence;
    return {};
}

Status stop(void*) { return {}; }
void close(void* device) { delete static_cast<NullDevice*>(device); }

}  // namespace

const SourceBackend kNullBackend = {"null",  "a made-up sensor, for tests of applications",
                                    list,    open,
                                    start,   pump,
                                    stop,    close,
                                    nullptr, nullptr,
                                    nullptr};

}  // namespace burin
