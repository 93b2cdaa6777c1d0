// SPDX-License-Identifier: MIT
#include "platform/v4l2/v4l2_backend.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>

#include "capture/calibration.h"
#include "platform/v4l2/d4xx.h"
#include "platform/v4l2/v4l2_streaming.h"

#ifndef V4L2_META_FMT_D4XX
#define V4L2_META_FMT_D4XX v4l2_fourcc('D', '4', 'X', 'X')
#endif

namespace burin {
namespace {

// Of the nodes of one sensor the first that shows depth is its address; else the first that shows anything.
bool describe_node(const V4l2Found& f, bool depth_first, DeviceEntry* e) {
    V4l2Node node;
    const Status opened = node.open(f.node, -1, false);
    if (opened.code() == Code::unsupported) return false;  // metadata, outputs, radios
    *e = DeviceEntry();
    std::snprintf(e->address, sizeof e->address, "%s", f.node);
    std::snprintf(e->name, sizeof e->name, "%s", f.name);
    std::snprintf(e->serial, sizeof e->serial, "%s", f.serial);
    std::snprintf(e->location, sizeof e->location, "%s", f.location);
    std::snprintf(e->driver, sizeof e->driver, "%s", f.driver);
    if (!opened.ok()) {
        e->access = opened.code() == Code::denied ? DeviceAccess::denied
                    : opened.code() == Code::busy ? DeviceAccess::busy
                                                  : DeviceAccess::unsupported;
        std::snprintf(e->hint, sizeof e->hint, "%.255s", opened.text());
        return true;
    }
    V4l2Choice choice;
    if (depth_first &&
        (!choose_v4l2_format(node.fd(), f.node, StreamKind::depth, {}, &choice).ok() || !choice.format))
        return false;
    describe_v4l2_formats(node.fd(), e->formats, sizeof e->formats);
    if (!e->formats[0]) {
        e->access = DeviceAccess::unsupported;
        std::snprintf(e->hint, sizeof e->hint,
                      "none of its pixel formats is one that we read (docs/v4l2.md lists them)");
    }
    return true;
}

Status list(DeviceVisit visit, void* user) {
    V4l2Found found[kMaxV4l2Nodes];
    const int count = find_v4l2_nodes(found);
    for (int i = 0; i < count; ++i) {
        bool first = true;
        for (int j = 0; j < i && first; ++j) first = std::strcmp(found[j].parent, found[i].parent) != 0;
        if (!first) continue;
        DeviceEntry e;
        bool told = false;
        for (const bool depth_first : {true, false})
            for (int j = i; j < count && !told; ++j)
                if (std::strcmp(found[j].parent, found[i].parent) == 0)
                    told = describe_node(found[j], depth_first, &e);
        if (told) visit(user, e);
    }
    return {};
}

// The node that the address means, among those found.
int find_address(const V4l2Found* found, int count, const char* address) {
    for (int i = 0; i < count; ++i) {
        if (std::strcmp(found[i].node, address) == 0) return i;
        if (std::strncmp(address, "serial:", 7) == 0 && std::strcmp(found[i].serial, address + 7) == 0)
            return i;
    }
    return -1;
}

// What of `kind` the node shows; choice->format is null where nothing.
Status look_at(V4l2Device* d, const char* path, int fd, StreamKind kind, V4l2Choice* choice) {
    *choice = V4l2Choice();
    V4l2Node node;
    const Status opened = node.open(path, fd, false);
    if (opened.code() == Code::unsupported) return {};
    BURIN_TRY(opened);
    return choose_v4l2_format(node.fd(), path, kind, d->options, choice);
}

// Makes a stream of what the node shows.
Status take_node(V4l2Device* d, const char* path, int fd, StreamKind kind, const V4l2Choice& choice) {
    V4l2Stream& s = d->streams[d->count++];
    BURIN_TRY(s.node.open(path, fd, false));
    s.kind = kind;
    s.choice = choice;
    BURIN_TRY(set_v4l2_format(s.node.fd(), path, &s.choice));
    return prepare_v4l2_stream(d, &s);
}

// The metadata node is the next one of the same interface.
void open_metadata(V4l2Stream* s, const V4l2Found* found, int count, const V4l2Found& of) {
    for (int i = 0; i < count; ++i) {
        if (std::strcmp(found[i].device, of.device) != 0 || found[i].index != of.index + 1) continue;
        if (!s->metadata.open(found[i].node, -1, true).ok()) break;
        ::v4l2_format f = {};
        for (const std::uint32_t format : {V4L2_META_FMT_D4XX, V4L2_META_FMT_UVC}) {
            f = {};
            f.type = V4L2_BUF_TYPE_META_CAPTURE;
            f.fmt.meta.dataformat = format;
            if (v4l2_call(s->metadata.fd(), VIDIOC_S_FMT, &f) < 0 || f.fmt.meta.dataformat != format)
                continue;
            s->d4xx = format == V4L2_META_FMT_D4XX;
            std::uint8_t descriptors[4096];
            const std::size_t bytes = read_usb_descriptors(of, descriptors, sizeof descriptors);
            const std::uint32_t hz = uvc_clock_hz(descriptors, bytes, of.interface);
            s->clock_hz = hz >= 1000 ? hz : 1e6;
            return;
        }
        break;
    }
    s->metadata.close();
}

Status open_streams(V4l2Device* d, const V4l2Found* found, int count, const char* address) {
    const int self = find_address(found, count, address);
    const bool by_fd = d->options.fd >= 0;
    if (self < 0 && !by_fd)
        return Status::error(Code::disconnected,
                             "v4l2: there is no '%.150s'; burin devices lists what there is", address);
    bool used[kMaxV4l2Nodes] = {};
    for (const StreamKind kind :
         {StreamKind::depth, StreamKind::colour, StreamKind::infrared, StreamKind::confidence}) {
        if (!(d->options.streams & stream_bit(kind)) || d->info.has(kind) ||
            d->count == V4l2Device::kMaxStreams)
            continue;
        V4l2Choice choice;
        if (by_fd) {
            const char* path = address[0] ? address : "the descriptor";
            if (d->count > 0) continue;
            BURIN_TRY(look_at(d, path, d->options.fd, kind, &choice));
            if (choice.format) BURIN_TRY(take_node(d, path, d->options.fd, kind, choice));
            continue;
        }
        // The best format of all nodes of the sensor; of equal ones that of the address, then the first.
        int best = -1;
        Status failed;  // of a node that is busy, or lacks the size: told when no other will do
        for (int k = 0; k <= count; ++k) {
            const int i = k == 0 ? self : k - 1;
            if (used[i] || std::strcmp(found[i].parent, found[self].parent) != 0) continue;
            V4l2Choice here;
            const Status looked = look_at(d, found[i].node, -1, kind, &here);
            if (!looked.ok() && failed.ok()) failed = looked;
            if (!looked.ok() || !here.format || (best >= 0 && here.rank >= choice.rank)) continue;
            best = i;
            choice = here;
        }
        if (best < 0) BURIN_TRY(failed);
        if (best < 0) continue;
        BURIN_TRY(take_node(d, found[best].node, -1, kind, choice));
        used[best] = true;
        open_metadata(&d->streams[d->count - 1], found, count, found[best]);
    }
    d->device_time = d->count > 0;
    for (int i = 0; i < d->count; ++i) d->device_time = d->device_time && d->streams[i].metadata.is_open();
    if (self < 0) return {};
    std::snprintf(d->info.name, sizeof d->info.name, "%s", found[self].name);
    std::snprintf(d->info.serial, sizeof d->info.serial, "%s", found[self].serial);
    std::snprintf(d->info.location, sizeof d->info.location, "%s", found[self].location);
    return {};
}

// Intrinsics from the device where it tells, else from the file.
Status calibrate(V4l2Device* d) {
    if (d->count > 0 && has_d4xx_unit(d->streams[0].node.fd())) {
        d->unit = true;
        char usb_serial[sizeof d->info.serial];
        std::memcpy(usb_serial, d->info.serial, sizeof usb_serial);
        const Status read = read_d4xx(d->streams[0].node.fd(), &d->info);
        if (read.code() == Code::disconnected) return read;
        if (!read.ok())
            std::snprintf(d->warning, sizeof d->warning, "%.400s; intrinsics are nominal", read.text());
        // list() knows the one of USB: a device that is unplugged is found again by it.
        std::memcpy(d->info.serial, usb_serial, sizeof usb_serial);
    }
    if (d->options.calibration[0]) return read_calibration(d->options.calibration, &d->info);
    return {};
}

Status open(const char* address, const SourceOptions& options, void** device, DeviceInfo* info) {
    auto* d = new (std::nothrow) V4l2Device;
    if (!d) return Status::error(Code::insufficient_memory, "v4l2: no memory for the device");
    d->options = options;
    d->has_layout = options.layout[0] != 0;
    V4l2Found found[kMaxV4l2Nodes];
    Status opened = d->has_layout ? parse_raw_layout(options.layout, &d->layout) : Status();
    if (opened.ok()) opened = open_streams(d, found, find_v4l2_nodes(found), address);
    if (opened.ok()) opened = calibrate(d);
    if (!opened.ok()) {
        delete d;
        return opened;
    }
    *info = d->info;
    *device = d;
    return {};
}

V4l2Device* self(void* device) { return static_cast<V4l2Device*>(device); }
Status start(void* device, SourceSink* sink) { return start_v4l2(self(device), sink); }
Status pump(void* device, std::int64_t deadline_ns) { return pump_v4l2(self(device), deadline_ns); }
Status stop(void* device) { return stop_v4l2(self(device)); }
void close(void* device) { delete self(device); }
void give_back(void* device, std::uint64_t token) {
    // Refused only by a node that is gone, which pump tells.
    (void)self(device)->streams[token >> 32].node.give(static_cast<int>(token & 0xffffffffu));
}
Status get(void* device, SourceControl control, ControlRange* range) {
    return get_v4l2_control(self(device), control, range);
}
Status set(void* device, SourceControl control, double value) {
    return set_v4l2_control(self(device), control, value);
}

}  // namespace

const SourceBackend kV4l2Backend = {"v4l2",    "cameras and depth sensors that the kernel has a driver for",
                                    list,      open,
                                    start,     pump,
                                    stop,      close,
                                    give_back, get,
                                    set};

}  // namespace burin
