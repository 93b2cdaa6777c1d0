// SPDX-License-Identifier: MIT
#include "platform/openni2/openni2_streams.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "capture/monotonic.h"

namespace burin {
namespace {

struct Format {
    OniPixelFormat oni;
    StreamKind kind;
    StreamPixels pixels;
    const char* name;
    double unit_m;
};

// The pixel formats that need no unpacking, the best first. (YUV422 is U Y V Y here; devices that have it
// have RGB too.)
constexpr Format kFormats[] = {
    {ONI_PIXEL_FORMAT_DEPTH_100_UM, StreamKind::depth, StreamPixels::u16, "DEPTH_100_UM", 0.0001},
    {ONI_PIXEL_FORMAT_DEPTH_1_MM, StreamKind::depth, StreamPixels::u16, "DEPTH_1_MM", 0.001},
    {ONI_PIXEL_FORMAT_RGB888, StreamKind::colour, StreamPixels::colour, "RGB888", 0},
    {ONI_PIXEL_FORMAT_GRAY16, StreamKind::infrared, StreamPixels::u16, "GRAY16", 0},
    {ONI_PIXEL_FORMAT_GRAY8, StreamKind::infrared, StreamPixels::u8, "GRAY8", 0},
};

const Format* format_of(OniPixelFormat oni, StreamKind kind) {
    for (const Format& f : kFormats)
        if (f.oni == oni && f.kind == kind) return &f;
    return nullptr;
}

constexpr OniSensorType sensor_of(StreamKind kind) {
    return kind == StreamKind::depth    ? ONI_SENSOR_DEPTH
           : kind == StreamKind::colour ? ONI_SENSOR_COLOR
                                        : ONI_SENSOR_IR;
}

struct Wanted {
    int width, height;
    double fps;
    const char* format;
};

bool fits(const OniVideoMode& m, const Format* f, const Wanted& w) {
    return f && m.resolutionX > 0 && m.resolutionY > 0 && m.resolutionX <= kMaxImageSide &&
           m.resolutionY <= kMaxImageSide &&
           (w.width == 0 || (m.resolutionX == w.width && m.resolutionY == w.height)) &&
           (w.fps == 0 || m.fps == static_cast<int>(std::lround(w.fps))) &&
           (!*w.format || !std::strcmp(w.format, f->name));
}

// VGA before all others, as what these sensors measure; then the faster; then the larger.
bool better(const OniVideoMode& a, const OniVideoMode& b) {
    const bool vga_a = a.resolutionX == 640 && a.resolutionY == 480,
               vga_b = b.resolutionX == 640 && b.resolutionY == 480;
    if (vga_a != vga_b) return vga_a;
    if (a.fps != b.fps) return a.fps > b.fps;
    return a.resolutionX * a.resolutionY > b.resolutionX * b.resolutionY;
}

Status choose_mode(const OniSensorInfo& sensor, StreamKind kind, const Wanted& wanted, OniVideoMode* chosen) {
    bool any = false;
    char list[200] = "";
    for (int i = 0; i < sensor.numSupportedVideoModes; ++i) {
        const OniVideoMode& m = sensor.pSupportedVideoModes[i];
        const Format* f = format_of(m.pixelFormat, kind);
        const std::size_t used = std::strlen(list);
        if (f)
            std::snprintf(list + used, sizeof list - used, " %s %dx%d@%d", f->name, m.resolutionX,
                          m.resolutionY, m.fps);
        if (!fits(m, f, wanted) || (any && !better(m, *chosen))) continue;
        *chosen = m;
        any = true;
    }
    if (any) return {};
    return Status::error(Code::unsupported, "openni2: %s: no mode %s %dx%d@%g, there are%s",
                         stream_name(kind), *wanted.format ? wanted.format : "of any format", wanted.width,
                         wanted.height, wanted.fps, *list ? list : " none that can be read");
}

// Focal lengths from the fields of view, which the driver has from the device's constants or a data sheet.
Camera camera_of(const Openni2& oni, OniStreamHandle stream, int width, int height) {
    float view[2] = {0, 0};
    int size = sizeof view[0];
    if (oni.stream_get(stream, ONI_STREAM_PROPERTY_HORIZONTAL_FOV, &view[0], &size) != ONI_STATUS_OK)
        view[0] = 0;
    size = sizeof view[1];
    if (oni.stream_get(stream, ONI_STREAM_PROPERTY_VERTICAL_FOV, &view[1], &size) != ONI_STATUS_OK)
        view[1] = 0;
    // What no driver tells, or tells absurdly, is that of the PrimeSense sensors: 58 by 45 degrees.
    const double h = view[0] > 0.1f && view[0] < 3.0f ? static_cast<double>(view[0]) : 1.0122;
    const double v = view[1] > 0.1f && view[1] < 3.0f ? static_cast<double>(view[1]) : 0.7854;
    Camera c;
    c.width = width;
    c.height = height;
    c.fx = width / (2 * std::tan(h / 2));
    c.fy = height / (2 * std::tan(v / 2));
    c.cx = (width - 1) / 2.0;
    c.cy = (height - 1) / 2.0;
    return c;
}

}  // namespace

Status add_openni2_stream(Openni2Device* d, StreamKind kind, const SourceOptions& o) {
    const Openni2& oni = *d->oni;
    const OniSensorInfo* sensor = oni.sensor_info(d->handle, sensor_of(kind));
    if (!sensor || sensor->numSupportedVideoModes < 1) return {};
    Openni2Stream& s = d->streams[d->stream_count];
    s = Openni2Stream();
    s.kind = kind;
    const Wanted wanted = {kind == StreamKind::colour ? o.colour_width : o.depth_width,
                           kind == StreamKind::colour ? o.colour_height : o.depth_height, o.fps,
                           kind == StreamKind::colour  ? o.colour_format
                           : kind == StreamKind::depth ? o.depth_format
                                                       : ""};
    OniVideoMode mode;
    BURIN_TRY(choose_mode(*sensor, kind, wanted, &mode));
    if (oni.create_stream(d->handle, sensor_of(kind), &s.handle) != ONI_STATUS_OK)
        return Status::error(Code::io, "openni2: %s: %s: %.300s", d->uri, stream_name(kind),
                             openni2_error(oni));
    ++d->stream_count;
    // A recording has the mode it was recorded in and refuses to be told.
    if (!d->recording &&
        oni.stream_set(s.handle, ONI_STREAM_PROPERTY_VIDEO_MODE, &mode, sizeof mode) != ONI_STATUS_OK)
        return Status::error(Code::io, "openni2: %s: %s %dx%d@%d was refused: %.300s", d->uri,
                             stream_name(kind), mode.resolutionX, mode.resolutionY, mode.fps,
                             openni2_error(oni));
    const Format* f = format_of(mode.pixelFormat, kind);
    s.info.kind = kind;
    s.info.pixels = f->pixels;
    std::snprintf(s.info.format, sizeof s.info.format, "%s", f->name);
    s.info.width = mode.resolutionX;
    s.info.height = mode.resolutionY;
    s.info.fps = mode.fps;
    if (f->unit_m > 0) s.info.unit_m = f->unit_m;
    s.info.camera = camera_of(oni, s.handle, mode.resolutionX, mode.resolutionY);
    set_image_bytes(&s.info);
    d->info.at(kind) = s.info;
    return {};
}

void take_openni2_frame(Openni2Device* d, const Openni2Stream& s, OniFrame* frame) {
    const Openni2& oni = *d->oni;
    // A cropped or resized frame is not what the stream promised.
    const std::size_t rows = static_cast<std::size_t>(s.info.height), row = s.info.row_bytes;
    if (frame->width != s.info.width || frame->height != s.info.height || !frame->data || frame->stride < 0 ||
        static_cast<std::size_t>(frame->stride) < row || frame->dataSize < 0 ||
        static_cast<std::size_t>(frame->dataSize) <
            static_cast<std::size_t>(frame->stride) * (rows - 1) + row) {
        d->sink->log(LogLevel::warning, "openni2: %s: a frame of %dx%d, %d bytes; expected %dx%d",
                     stream_name(s.kind), frame->width, frame->height, frame->dataSize, s.info.width,
                     s.info.height);
        d->sink->count_damaged(s.kind, 1);
        oni.release_frame(frame);
        return;
    }
    ImageStamp stamp;
    stamp.sequence = static_cast<std::uint64_t>(frame->frameIndex < 0 ? 0 : frame->frameIndex);
    stamp.device_ns = static_cast<std::int64_t>(frame->timestamp) * 1000;  // microseconds
    stamp.has_device_time = true;
    stamp.host_ns = monotonic_ns();
    const auto* pixels = static_cast<const std::uint8_t*>(frame->data);
    if (d->lend) {
        d->sink->lend(s.kind, pixels, static_cast<std::size_t>(frame->stride),
                      reinterpret_cast<std::uintptr_t>(frame), -1, stamp);
        return;
    }
    if (std::uint8_t* image = d->sink->acquire(s.kind)) {
        for (std::size_t y = 0; y < rows; ++y)
            std::memcpy(image + y * row, pixels + y * static_cast<std::size_t>(frame->stride), row);
        d->sink->commit(s.kind, image, stamp);
    }
    oni.release_frame(frame);
}

}  // namespace burin
