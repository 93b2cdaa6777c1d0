// SPDX-License-Identifier: MIT
#include "platform/openni2/openni2_backend.h"

#include <sys/stat.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <new>

#include "capture/monotonic.h"
#include "platform/openni2/openni2_streams.h"

namespace burin {
namespace {

Status list(DeviceVisit visit, void* user) {
    const Openni2* oni = nullptr;
    BURIN_TRY(load_openni2(&oni));
    OniDeviceInfo* devices = nullptr;
    int count = 0;
    if (oni->device_list(&devices, &count) != ONI_STATUS_OK)
        return Status::error(Code::io, "OpenNI2 cannot list devices: %.300s", openni2_error(*oni));
    for (int i = 0; i < count; ++i) {
        DeviceEntry e;
        std::snprintf(e.address, sizeof e.address, "%.159s", devices[i].uri);
        std::snprintf(e.name, sizeof e.name, "%.47s %.47s", devices[i].vendor, devices[i].name);
        // An address changes with every plugging in: what stays is the kind of device.
        if (devices[i].usbVendorId != 0)
            std::snprintf(e.location, sizeof e.location, "any port, %04x:%04x", devices[i].usbVendorId,
                          devices[i].usbProductId);
        visit(user, e);
    }
    oni->release_device_list(devices);
    return {};
}

bool same(const Openni2Device& d, const OniDeviceInfo* info) {
    return info && std::strcmp(d.uri, info->uri) == 0;
}

void told_disconnected(const OniDeviceInfo* info, void* device) {
    auto* d = static_cast<Openni2Device*>(device);
    if (same(*d, info)) d->gone.store(true);
}
void told_state(const OniDeviceInfo* info, OniDeviceState state, void* device) {
    auto* d = static_cast<Openni2Device*>(device);
    if (same(*d, info) && state == ONI_DEVICE_STATE_EOF) d->over.store(true);
    if (same(*d, info) && state == ONI_DEVICE_STATE_ERROR) d->gone.store(true);
}

void close(void* device) {
    auto* d = static_cast<Openni2Device*>(device);
    for (int i = 0; i < d->stream_count; ++i) d->oni->destroy_stream(d->streams[i].handle);
    if (d->callbacks) d->oni->unregister_device_callbacks(d->callbacks);
    if (d->handle) d->oni->device_close(d->handle);
    delete d;
}

// A recording plays once; "fast": a frame whenever one is asked for.
void set_playback(Openni2Device* d, bool fast) {
    const float speed = fast ? -1.0f : 1.0f;
    const OniBool repeat = FALSE;
    d->oni->device_set(d->handle, ONI_DEVICE_PROPERTY_PLAYBACK_SPEED, &speed, sizeof speed);
    d->oni->device_set(d->handle, ONI_DEVICE_PROPERTY_PLAYBACK_REPEAT_ENABLED, &repeat, sizeof repeat);
}

// With depth as the colour camera sees it the two share one view, which makes the extrinsic between them,
// that no OpenNI2 device tells, the identity.
void register_depth(Openni2Device* d) {
    if (!d->info.has(StreamKind::depth) || !d->info.has(StreamKind::colour) || d->recording) return;
    const OniImageRegistrationMode mode = ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR;
    if (d->oni->can_register(d->handle, mode) &&
        d->oni->device_set(d->handle, ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION, &mode, sizeof mode) ==
            ONI_STATUS_OK &&
        d->info.at(StreamKind::depth).width == d->info.at(StreamKind::colour).width)
        d->info.at(StreamKind::depth).camera = d->info.at(StreamKind::colour).camera;
}

Status open_device(const char* address, bool fast, const SourceOptions& o, Openni2Device* d) {
    const Openni2& oni = *d->oni;
    struct stat file;
    d->recording = ::stat(address, &file) == 0 && S_ISREG(file.st_mode);
    if (const OniStatus status = oni.device_open(address, &d->handle); status != ONI_STATUS_OK)
        return Status::error(d->recording                     ? Code::format
                             : status == ONI_STATUS_NO_DEVICE ? Code::disconnected
                                                              : Code::io,
                             "openni2: %.150s cannot be opened (%d): %.200s", address,
                             static_cast<int>(status), openni2_error(oni));
    OniDeviceInfo told;
    if (oni.device_info(d->handle, &told) != ONI_STATUS_OK)
        return Status::error(Code::io, "openni2: %.150s: %.300s", address, openni2_error(oni));
    std::snprintf(d->uri, sizeof d->uri, "%.255s", told.uri);
    std::snprintf(d->info.name, sizeof d->info.name, "%.47s %.47s", told.vendor, told.name);
    if (!d->recording && told.usbVendorId != 0)
        std::snprintf(d->info.location, sizeof d->info.location, "any port, %04x:%04x", told.usbVendorId,
                      told.usbProductId);
    OniDeviceCallbacks callbacks = {nullptr, told_disconnected, told_state};
    oni.register_device_callbacks(&callbacks, d, &d->callbacks);
    for (const StreamKind kind : {StreamKind::depth, StreamKind::colour, StreamKind::infrared})
        if (o.streams & stream_bit(kind)) BURIN_TRY(add_openni2_stream(d, kind, o));
    if (d->recording) set_playback(d, fast);
    register_depth(d);
    return {};
}

Status open(const char* address, const SourceOptions& options, void** device, DeviceInfo* info) {
    const Openni2* oni = nullptr;
    BURIN_TRY(load_openni2(&oni));
    if (options.fd >= 0)
        return Status::error(Code::unsupported, "openni2: devices cannot be opened by a descriptor");
    char path[160];
    std::snprintf(path, sizeof path, "%s", address);
    char* query = std::strstr(path, "?pace=");
    const bool fast = query && std::strcmp(query, "?pace=fast") == 0;
    if (query && !fast && std::strcmp(query, "?pace=real") != 0)
        return Status::error(Code::invalid_argument, "openni2: '%s', expected ?pace=fast or ?pace=real",
                             query);
    if (query) *query = 0;
    auto* d = new (std::nothrow) Openni2Device;
    if (!d) return Status::error(Code::insufficient_memory, "openni2: no memory for the device");
    d->oni = oni;
    d->lend = options.lend;
    if (const Status opened = open_device(path, fast, options, d); !opened.ok()) {
        close(d);
        return opened;
    }
    *info = d->info;
    *device = d;
    return {};
}

Status stop(void* device) {
    auto* d = static_cast<Openni2Device*>(device);
    if (d->streaming) {
        Openni2Reader::get().remove(&d->frames);
        for (int i = 0; i < d->stream_count; ++i) d->oni->stop_stream(d->streams[i].handle);
    }
    d->streaming = false;
    return {};
}

Status start(void* device, SourceSink* sink) {
    auto* d = static_cast<Openni2Device*>(device);
    d->sink = sink;
    d->over.store(false);
    d->frames.stream_count = d->stream_count;
    for (int i = 0; i < d->stream_count; ++i) d->frames.streams[i] = d->streams[i].handle;
    BURIN_TRY(Openni2Reader::get().add(*d->oni, &d->frames));
    d->streaming = true;
    for (int i = 0; i < d->stream_count; ++i)
        if (d->oni->start_stream(d->streams[i].handle) != ONI_STATUS_OK) {
            const Status failed = Status::error(Code::io, "openni2: %s: %s does not start: %.300s", d->uri,
                                                stream_name(d->streams[i].kind), openni2_error(*d->oni));
            (void)stop(d);
            return failed;
        }
    return {};
}

Status pump(void* device, std::int64_t deadline_ns) {
    auto* d = static_cast<Openni2Device*>(device);
    do {
        Openni2Frames::Entry entry;
        if (Openni2Reader::get().next(&d->frames, deadline_ns, &entry))
            take_openni2_frame(d, d->streams[entry.stream], entry.frame);
        else if (d->gone.load())
            return Status::error(Code::disconnected, "openni2: %s is unplugged", d->uri);
        else if (d->frames.failed)
            return Status::error(Code::io, "openni2: %s: reading failed: %.300s", d->uri,
                                 openni2_error(*d->oni));
        else if (d->over.load())
            return Status::error(Code::ended, "openni2: %s is over", d->uri);
    } while (monotonic_ns() < deadline_ns);
    return {};
}

void give_back(void* device, std::uint64_t token) {
    static_cast<Openni2Device*>(device)->oni->release_frame(
        reinterpret_cast<OniFrame*>(static_cast<std::uintptr_t>(token)));
}

// The controls that OpenNI2 has, each a property of a stream.
struct Property {
    SourceControl control;
    StreamKind stream;
    int id;
};
constexpr Property kProperties[] = {
    {SourceControl::mirror, StreamKind::depth, ONI_STREAM_PROPERTY_MIRRORING},
    {SourceControl::colour_auto_exposure, StreamKind::colour, ONI_STREAM_PROPERTY_AUTO_EXPOSURE},
    {SourceControl::colour_exposure_us, StreamKind::colour, ONI_STREAM_PROPERTY_EXPOSURE},
    {SourceControl::colour_gain, StreamKind::colour, ONI_STREAM_PROPERTY_GAIN},
};

const Openni2Stream* stream_with(const Openni2Device& d, SourceControl control, int* id) {
    for (const Property& p : kProperties)
        for (int i = 0; i < d.stream_count; ++i)
            if (p.control == control && d.streams[i].kind == p.stream &&
                d.oni->stream_has(d.streams[i].handle, p.id)) {
                *id = p.id;
                return &d.streams[i];
            }
    return nullptr;
}

Status get(void* device, SourceControl control, ControlRange* range) {
    auto* d = static_cast<Openni2Device*>(device);
    int id = 0, value = 0, size = sizeof value;
    const Openni2Stream* s = stream_with(*d, control, &id);
    if (!s) return Status::error(Code::unsupported, "openni2: %s has no such control", d->uri);
    if (d->oni->stream_get(s->handle, id, &value, &size) != ONI_STATUS_OK)
        return Status::error(Code::io, "openni2: %s: %.300s", d->uri, openni2_error(*d->oni));
    const bool flag = control == SourceControl::mirror || control == SourceControl::colour_auto_exposure;
    // OpenNI2 tells no range.
    *range = {static_cast<double>(value), 0, flag ? 1.0 : 65535.0, 1, 0};
    return {};
}

Status set(void* device, SourceControl control, double value) {
    auto* d = static_cast<Openni2Device*>(device);
    int id = 0;
    const Openni2Stream* s = stream_with(*d, control, &id);
    if (!s) return Status::error(Code::unsupported, "openni2: %s has no such control", d->uri);
    const bool flag = control == SourceControl::mirror || control == SourceControl::colour_auto_exposure;
    if (!(value >= 0 && value <= (flag ? 1 : 65535)))
        return Status::error(Code::invalid_argument, "openni2: %g, expected 0..%d", value, flag ? 1 : 65535);
    const int whole = static_cast<int>(value);
    if (d->oni->stream_set(s->handle, id, &whole, sizeof whole) != ONI_STATUS_OK)
        return Status::error(Code::io, "openni2: %s refuses %g: %.300s", d->uri, value,
                             openni2_error(*d->oni));
    return {};
}

}  // namespace

const SourceBackend kOpenni2Backend = {"openni2", "devices and .oni recordings through OpenNI2",
                                       list,      open,
                                       start,     pump,
                                       stop,      close,
                                       give_back, get,
                                       set};

}  // namespace burin
