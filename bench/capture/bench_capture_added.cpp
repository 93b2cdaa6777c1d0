// SPDX-License-Identifier: MIT
// What capture adds between the last byte's arrival and the application: bench_capture_added [--frames N].
// A source of 640 x 480 at 30 a second, a consumer that waits for it; wall clock from the arrival until
// next() returned, through the real thread, ring, pairing and clocks. Lines of "program metric value".
//   lent      depth of 16 bits in the driver's own buffer, as V4L2 hands it out: no copy (looked at)
//   unpacked  a Kinect's packed 11 bits to depth through its table: the one copy there is
//   registered  the same, and registered to colour, which is handed out too
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "capture/live_source.h"
#include "capture/monotonic.h"
#include "capture/raw_image.h"

using namespace burin;

namespace {

constexpr int kWidth = 640, kHeight = 480, kPixels = kWidth * kHeight;
constexpr std::int64_t kPeriod_ns = 33'333'333;

// The one device there is. A driver's buffers stay as they are; what a reader does with their pixels is not
// measured.
struct Sensor {
    bool lent = false, colour = false;
    SourceSink* sink = nullptr;
    std::int64_t next_ns = 0;
    std::uint64_t sequence = 0;
    std::vector<std::uint16_t> buffer = std::vector<std::uint16_t>(kPixels, 1500);
    std::vector<std::uint8_t> packed = std::vector<std::uint8_t>(kPixels * 11 / 8, 0x55);
    std::vector<std::uint16_t> table = std::vector<std::uint16_t>(2048, 1500);
} sensor;

Status list(DeviceVisit, void*) { return {}; }

Status open(const char* address, const SourceOptions& options, void** device, DeviceInfo* info) {
    sensor.lent = std::strcmp(address, "lent") == 0;
    sensor.colour = (options.streams & stream_bit(StreamKind::colour)) != 0;
    for (const StreamKind kind : {StreamKind::depth, StreamKind::colour}) {
        if (!(options.streams & stream_bit(kind))) continue;
        StreamInfo& s = info->at(kind);
        s.kind = kind;
        s.pixels = kind == StreamKind::depth ? StreamPixels::u16 : StreamPixels::colour;
        s.width = kWidth;
        s.height = kHeight;
        s.fps = 30;
        const double f = kind == StreamKind::depth ? 585 : 525;  // a Kinect's
        s.camera = {kWidth, kHeight, f, f, 319.5, 239.5};
        if (kind == StreamKind::colour) s.T_stream_depth.t = {-0.025, 0, 0};
        set_image_bytes(&s);
    }
    *device = &sensor;
    return {};
}

Status start(void*, SourceSink* sink) {
    sensor.sink = sink;
    sensor.next_ns = monotonic_ns() + kPeriod_ns;
    return {};
}

Status pump(void*, std::int64_t deadline_ns) {
    sleep_until_ns(std::min(deadline_ns, sensor.next_ns));
    if (deadline_ns < sensor.next_ns) return {};
    sensor.next_ns += kPeriod_ns;
    ImageStamp stamp;
    stamp.sequence = sensor.sequence++;
    if (sensor.colour)
        if (std::uint8_t* image = sensor.sink->acquire(StreamKind::colour)) {
            stamp.host_ns = monotonic_ns();
            sensor.sink->commit(StreamKind::colour, image, stamp);
        }
    stamp.host_ns = monotonic_ns();
    if (sensor.lent) {
        sensor.sink->lend(StreamKind::depth, reinterpret_cast<const std::uint8_t*>(sensor.buffer.data()),
                          2 * kWidth, 0, -1, stamp);
        return {};
    }
    std::uint8_t* image = sensor.sink->acquire(StreamKind::depth);
    if (!image) return {};
    unpack_image(simd::Packing::msb11, {sensor.packed.data(), sensor.packed.size(), 0},
                 {sensor.table.data(), 2048},
                 View<std::uint16_t>{reinterpret_cast<std::uint16_t*>(image), kWidth, kHeight, kWidth});
    sensor.sink->commit(StreamKind::depth, image, stamp);
    return {};
}

Status stop(void*) { return {}; }
void close(void*) {}
void give_back(void*, std::uint64_t) {}

const SourceBackend kBackend = {"bench", "what capture adds", list,    open,   start, pump, stop,
                                close,   give_back,           nullptr, nullptr};

void must(const Status& status) {
    if (status.ok()) return;
    std::fprintf(stderr, "bench_capture_added: %s\n", status.text());
    std::exit(1);
}

void measure(const char* metric, const char* address, bool registered, int frames) {
    LiveOptions options;
    options.device.streams = stream_bit(StreamKind::depth);
    if (registered) {
        options.device.streams |= stream_bit(StreamKind::colour);
        options.registration = RegistrationMode::depth_to_colour;
    }
    LiveSource source;
    must(source.open(kBackend, address, options));
    must(source.start());
    std::vector<double> added_ms;
    for (int i = 0; i < frames; ++i) {
        CapturedFrame frame;
        must(source.next(1'000'000'000, &frame));
        const CapturedImage& depth = frame.at(StreamKind::depth);
        added_ms.push_back(static_cast<double>(monotonic_ns() - depth.stamp.host_ns) * 1e-6);
        if (sensor.lent && static_cast<const void*>(depth.pixels) != sensor.buffer.data()) {
            std::fprintf(stderr, "bench_capture_added: a lent image was copied\n");
            std::exit(1);
        }
    }
    must(source.stop());
    std::sort(added_ms.begin(), added_ms.end());
    const auto at = [&](double share) {
        return added_ms[static_cast<std::size_t>(share * static_cast<double>(added_ms.size() - 1))];
    };
    std::printf("burin added_%s_ms %.4g\nburin added_%s_p95_ms %.4g\n", metric, at(0.5), metric, at(0.95));
}

}  // namespace

int main(int argc, char** argv) {
    int frames = 300;
    if (argc == 3 && std::strcmp(argv[1], "--frames") == 0)
        frames = std::max(1, std::atoi(argv[2]));
    else if (argc != 1)
        return std::fprintf(stderr, "bench_capture_added: expected --frames N\n"), 2;
    measure("lent", "lent", false, frames);
    measure("unpacked", "packed", false, frames);
    measure("registered", "packed", true, frames);
    return 0;
}
