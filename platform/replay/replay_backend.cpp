// SPDX-License-Identifier: MIT
#include "platform/replay/replay_backend.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>

#include "capture/monotonic.h"
#include "capture/recording_reader.h"

namespace burin {
namespace {

// Half of what makes a silent device be restarted.
constexpr std::int64_t kLongestPause_ns = 500'000'000;

struct ReplayDevice {
    RecordingReader reader;
    RecordedImages images;
    DeviceInfo info;
    bool fast = false, loop = false;
    SourceSink* sink = nullptr;

    // Of the frame that is delivered next.
    struct Staged {
        bool any = false;
        RecordHead head;
        Camera camera;
        std::unique_ptr<std::uint8_t[]> pixels, other;  // other: of another format than the stream's
    } staged[kStreamKinds];
    bool is_staged = false;
    int next = 0;  // frame
    std::uint64_t offset[kStreamKinds] = {};
    std::uint64_t imu_next = 0;
    // Device time = t_ns + shift, by unsigned arithmetic: stamps are untrusted and may be anything.
    std::int64_t shift_ns = 0, last_ns = 0;
    bool anew = true;  // the shift is to be found
    std::uint64_t sequence_shift[kStreamKinds] = {}, sequence_end[kStreamKinds] = {};
};

std::int64_t plus(std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}
std::int64_t minus(std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

Status list(DeviceVisit, void*) { return {}; }

Status parse_address(const char* address, char (&folder)[1024], ReplayDevice* d) {
    std::snprintf(folder, sizeof folder, "%s", address);
    char* options = std::strrchr(folder, '?');
    if (!options) return {};
    *options++ = 0;
    while (*options) {
        const std::size_t length = std::strcspn(options, "&");
        const auto is = [&](const char* text) {
            return std::strlen(text) == length && std::memcmp(options, text, length) == 0;
        };
        if (is("pace=fast"))
            d->fast = true;
        else if (is("pace=real"))
            d->fast = false;
        else if (is("loop=1") || is("loop=0"))
            d->loop = is("loop=1");
        else
            return Status::error(Code::invalid_argument,
                                 "replay: '%.60s', expected pace=real, pace=fast, loop=0 or loop=1", options);
        options += length + (options[length] == '&');
    }
    return {};
}

bool asked_for(const StreamInfo& s, int width, int height, const char* format) {
    return (width == 0 || (width == s.width && height == s.height)) &&
           (*format == 0 || std::strcmp(format, s.format) == 0);
}

Status choose_streams(const SourceOptions& options, ReplayDevice* d) {
    d->info = d->reader.info();
    for (int k = 0; k < kStreamKinds; ++k) {
        StreamInfo& s = d->info.streams[k];
        const auto kind = static_cast<StreamKind>(k);
        if ((options.streams & stream_bit(kind)) == 0) s = StreamInfo();
        if (s.width == 0) continue;
        const bool fits =
            kind == StreamKind::depth
                ? asked_for(s, options.depth_width, options.depth_height, options.depth_format)
                : kind != StreamKind::colour ||
                      asked_for(s, options.colour_width, options.colour_height, options.colour_format);
        if (!fits)
            return Status::error(Code::unsupported, "%s: was recorded with %s %s %dx%d only",
                                 d->reader.path(), stream_name(kind), s.format, s.width, s.height);
    }
    // Jpeg comes out as RGB, and all images of a stream are alike.
    for (int i = 0; i < d->reader.frame_count() && d->info.has(StreamKind::colour); ++i) {
        const std::uint64_t offset = d->reader.frame(i).recorded.images[static_cast<int>(StreamKind::colour)];
        RecordHead head;
        if (offset == 0 || !d->reader.read_head(offset, &head)) continue;
        d->info.at(StreamKind::colour) = decoded_stream(d->info.at(StreamKind::colour), head.codec);
        break;
    }
    return {};
}

Status open(const char* address, const SourceOptions& options, void** device, DeviceInfo* info) {
    std::unique_ptr<ReplayDevice> d(new (std::nothrow) ReplayDevice);
    const auto no_memory = [] { return Status::error(Code::insufficient_memory, "replay: no memory"); };
    if (!d) return no_memory();
    char folder[1024];
    BURIN_TRY(parse_address(address, folder, d.get()));
    BURIN_TRY(d->reader.open(folder));
    if (d->reader.frame_count() == 0)
        return Status::error(Code::format, "%s: holds 0 frames, expected at least 1", d->reader.path());
    BURIN_TRY(d->images.reserve(d->reader));
    BURIN_TRY(choose_streams(options, d.get()));
    for (int k = 0; k < kStreamKinds; ++k) {
        if (d->info.streams[k].width == 0) continue;
        const std::size_t room = RecordedImages::image_room(d->reader.info().streams[k]);
        d->staged[k].pixels.reset(new (std::nothrow) std::uint8_t[room]);
        d->staged[k].other.reset(new (std::nothrow) std::uint8_t[room]);
        if (!d->staged[k].pixels || !d->staged[k].other) return no_memory();
    }
    *info = d->info;
    *device = d.release();
    return {};
}

Status start(void* device, SourceSink* sink) {
    auto* d = static_cast<ReplayDevice*>(device);
    d->sink = sink;
    d->anew = true;
    return {};
}

// An image in the format of its stream; one that cannot be had is counted.
void stage_image(ReplayDevice* d, int k, std::uint64_t offset) {
    ReplayDevice::Staged& staged = d->staged[k];
    const auto kind = static_cast<StreamKind>(k);
    const StreamInfo &recorded = d->reader.info().streams[k], &delivered = d->info.streams[k];
    const Status got =
        d->images.read(d->reader, offset, kind, &staged.head, &staged.camera, staged.pixels.get());
    if (!got.ok()) {
        d->sink->count_damaged(kind, 1);
        d->sink->log(LogLevel::warning, "%s", got.text());
        return;
    }
    staged.any = true;
    const StreamInfo decoded = decoded_stream(recorded, staged.head.codec);
    if (kind != StreamKind::colour || decoded.colour_format == delivered.colour_format) return;
    const ColourRows rows = packed_colour(decoded, staged.pixels.get());
    for (int y = 0; y < delivered.height; ++y)
        row_to_rgb(rows, y, staged.other.get() + delivered.row_bytes * static_cast<std::size_t>(y));
    staged.pixels.swap(staged.other);
}

void stage_frame(ReplayDevice* d) {
    const RecordingReader::Frame& frame = d->reader.frame(d->next);
    for (int k = 0; k < kStreamKinds; ++k) {
        const std::uint64_t offset = frame.recorded.images[k];
        d->staged[k].any = false;
        if (offset == 0 || offset == d->offset[k] || d->info.streams[k].width == 0) continue;
        d->offset[k] = offset;
        stage_image(d, k, offset);
    }
    const std::int64_t pause_ns = minus(frame.t_ns, d->last_ns);
    if (d->anew)
        d->shift_ns = minus(monotonic_ns(), frame.t_ns);
    else if (pause_ns < 0 || (!d->fast && pause_ns > kLongestPause_ns))
        d->shift_ns = minus(d->shift_ns, minus(pause_ns, pause_ns < 0 ? 1 : kLongestPause_ns));
    d->anew = false;
    d->last_ns = frame.t_ns;
    d->is_staged = true;
}

void deliver_imu(ReplayDevice* d, const RecordedFrame& frame) {
    int count = 0;
    const ImuSample* samples = d->reader.imu(frame, &count);
    for (int i = 0; i < count; ++i) {
        if (frame.imu_first + static_cast<std::uint64_t>(i) < d->imu_next) continue;
        ImuSample sample = samples[i];
        sample.t_ns = plus(sample.t_ns, d->shift_ns);
        d->sink->imu(sample);
    }
    d->imu_next = std::max(d->imu_next, frame.imu_first + static_cast<std::uint64_t>(count));
}

void deliver_image(ReplayDevice* d, int k) {
    const ReplayDevice::Staged& staged = d->staged[k];
    const auto kind = static_cast<StreamKind>(k);
    ImageStamp stamp;
    stamp.sequence = staged.head.sequence + d->sequence_shift[k];
    d->sequence_end[k] = stamp.sequence + 1;
    std::uint8_t* image = d->sink->acquire(kind);
    if (!image) return;
    std::memcpy(image, staged.pixels.get(), d->info.streams[k].image_bytes);
    stamp.device_ns = plus(staged.head.t_ns, d->shift_ns);
    stamp.has_device_time = true;
    stamp.host_ns = d->fast ? stamp.device_ns : monotonic_ns();
    stamp.damaged = (staged.head.flags & kRecordDamaged) != 0;
    if (staged.head.flags & kRecordCamera) stamp.camera = &staged.camera;
    d->sink->commit(kind, image, stamp);
}

void begin_again(ReplayDevice* d) {
    const RecordedFrame& first = d->reader.frame(0).recorded;
    for (int k = 0; k < kStreamKinds; ++k) {
        RecordHead head;
        const std::uint64_t offset = first.images[k];
        d->offset[k] = 0;
        if (offset != 0 && d->reader.read_head(offset, &head))
            d->sequence_shift[k] = d->sequence_end[k] - head.sequence;
    }
    // The first frame follows the last as the second follows the first.
    const int second = std::min(1, d->reader.frame_count() - 1);
    const std::int64_t t0_ns = d->reader.frame(0).t_ns;
    const std::int64_t step_ns = std::max<std::int64_t>(1, minus(d->reader.frame(second).t_ns, t0_ns));
    d->shift_ns = plus(d->shift_ns, plus(minus(d->last_ns, t0_ns), step_ns));
    d->last_ns = minus(t0_ns, step_ns);
    d->imu_next = 0;
    d->next = 0;
}

Status pump(void* device, std::int64_t deadline_ns) {
    auto* d = static_cast<ReplayDevice*>(device);
    if (!d->is_staged) {
        if (d->next == d->reader.frame_count()) {
            if (!d->loop) return Status::error(Code::ended, "%s: the recording is over", d->reader.path());
            begin_again(d);
        }
        stage_frame(d);
    }
    const RecordingReader::Frame& frame = d->reader.frame(d->next);
    if (!d->fast) {
        const std::int64_t due_ns = plus(frame.t_ns, d->shift_ns);
        sleep_until_ns(std::min(due_ns, deadline_ns));
        if (due_ns > deadline_ns) return {};
    }
    deliver_imu(d, frame.recorded);
    // Depth comes last: with it the frame is whole.
    for (int k = kStreamKinds - 1; k >= 0; --k)
        if (d->staged[k].any) deliver_image(d, k);
    d->is_staged = false;
    ++d->next;
    return {};
}

Status stop(void*) { return {}; }
void close(void* device) { delete static_cast<ReplayDevice*>(device); }

}  // namespace

const SourceBackend kReplayBackend = {"replay", "recordings of burin record, in place of a sensor",
                                      list,     open,
                                      start,    pump,
                                      stop,     close,
                                      nullptr,  nullptr,
                                      nullptr};

}  // namespace burin
