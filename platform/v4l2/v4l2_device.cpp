// SPDX-License-Identifier: MIT
// Time stamps and the way of a buffer from the driver to the sink.
#include "platform/v4l2/v4l2_device.h"

#include <poll.h>

#include <algorithm>

#include "capture/monotonic.h"
#include "platform/v4l2/v4l2_streaming.h"

namespace burin {
namespace {

// Takes what the metadata node has; a frame's own comes before or with it.
Status take_metadata(V4l2Stream* s) {
    if (!s->metadata.streaming()) return {};
    for (int i = 0; i < V4l2Node::kMaxBuffers; ++i) {
        V4l2Filled filled;
        BURIN_TRY(s->metadata.take(&filled));
        if (filled.index < 0) return {};
        const UvcFrameMetadata m =
            parse_uvc_metadata(s->metadata.buffer(filled.index).memory, filled.bytes, s->d4xx);
        if (m.has_pts) s->kept[filled.sequence % V4l2Stream::kKept] = {filled.sequence, m.pts, true, m.error};
        BURIN_TRY(s->metadata.give(filled.index));
    }
    return {};
}

// The device's clock where the metadata has it. A frame whose metadata is missing is where the driver's
// stamps put it.
void stamp_by_device(V4l2Stream* s, const V4l2Filled& filled, ImageStamp* stamp) {
    const V4l2Stream::Kept& kept = s->kept[filled.sequence % V4l2Stream::kKept];
    if (kept.any && kept.sequence == filled.sequence) {
        stamp->device_ns = s->ticks.ns(kept.pts);
        stamp->damaged = stamp->damaged || kept.damaged;
    } else {
        stamp->device_ns = s->last_device_ns + (filled.stamp_ns - s->last_stamp_ns);
        if (!s->any_device_time) return;
    }
    s->any_device_time = true;
    s->last_device_ns = stamp->device_ns;
    s->last_stamp_ns = filled.stamp_ns;
    stamp->has_device_time = true;
}

Status take_images(V4l2Device* d, int index) {
    V4l2Stream& s = d->streams[index];
    for (int i = 0; i < V4l2Node::kMaxBuffers; ++i) {
        V4l2Filled filled;
        BURIN_TRY(s.node.take(&filled));
        if (filled.index < 0) return {};
        ImageStamp stamp;
        stamp.sequence = filled.sequence;
        stamp.host_ns = monotonic_ns();
        stamp.damaged = filled.damaged;
        BURIN_TRY(take_metadata(&s));
        if (d->device_time) {
            stamp_by_device(&s, filled, &stamp);
        } else if (filled.monotonic) {
            // The driver's stamp of the frame's begin; already the host's clock, nearer to the exposure than
            // now.
            stamp.device_ns = filled.stamp_ns;
            stamp.has_device_time = true;
        }
        BURIN_TRY(hand_over_v4l2(d, index, filled, stamp));
    }
    return {};
}

}  // namespace

Status stop_v4l2(V4l2Device* d) {
    Status worst;
    for (int i = 0; i < d->count; ++i) {
        (void)d->streams[i].metadata.stop();
        if (const Status stopped = d->streams[i].node.stop(); !stopped.ok()) worst = stopped;
    }
    return worst;
}

Status start_v4l2(V4l2Device* d, SourceSink* sink) {
    d->sink = sink;
    if (d->warning[0]) sink->log(LogLevel::warning, "%s", d->warning);
    d->warning[0] = 0;
    for (int i = 0; i < d->count; ++i) {
        V4l2Stream& s = d->streams[i];
        std::fill(std::begin(s.kept), std::end(s.kept), V4l2Stream::Kept());
        s.any_device_time = false;
        s.ticks = TickClock(s.clock_hz);
        Status started;
        // Metadata first, so that no frame is without; as many buffers, since a frame takes one of each.
        if (d->device_time) started = s.metadata.start(d->options.buffers, false);
        if (started.ok()) started = s.node.start(d->options.buffers, d->options.lend);
        if (started.ok()) continue;
        (void)stop_v4l2(d);
        return started;
    }
    return {};
}

Status pump_v4l2(V4l2Device* d, std::int64_t deadline_ns) {
    pollfd fds[2 * V4l2Device::kMaxStreams];
    int count = 0;
    for (int i = 0; i < d->count; ++i) fds[count++] = {d->streams[i].node.fd(), POLLIN | POLLPRI, 0};
    const std::int64_t left_ns = std::max<std::int64_t>(deadline_ns - monotonic_ns(), 0);
    const timespec wait = {static_cast<time_t>(left_ns / 1'000'000'000),
                           static_cast<long>(left_ns % 1'000'000'000)};
    const int ready = ::ppoll(fds, static_cast<nfds_t>(count), &wait, nullptr);
    if (ready < 0 && errno != EINTR) return v4l2_error(d->streams[0].node.path(), "poll", errno);
    if (ready <= 0) return {};
    for (int i = 0; i < d->count; ++i) {
        if (!fds[i].revents) continue;
        // An unplugged node, or one without a buffer of its own left, is told of by POLLERR; DQBUF says which
        // it is.
        if (fds[i].revents & POLLERR) {
            V4l2Filled filled;
            const Status status = d->streams[i].node.take(&filled);
            if (status.code() == Code::disconnected) return status;
            if (filled.index >= 0) BURIN_TRY(d->streams[i].node.give(filled.index));
            // All buffers are lent: nothing to do but to wait for one.
            sleep_until_ns(std::min(deadline_ns, monotonic_ns() + 1'000'000));
            continue;
        }
        BURIN_TRY(take_images(d, i));
    }
    return {};
}

}  // namespace burin
