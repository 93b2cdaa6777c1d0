// SPDX-License-Identifier: MIT
// Sources of include/burin/capture.h over LiveSource. What is plugged in: burin_devices.cpp.
#include "burin/capture.h"

#include <cstdio>
#include <cstring>
#include <new>

#include "api/c_frame.h"
#include "api/capture_backends.h"
#include "api/source_handles.h"

namespace burin {
namespace {

template <class Body>
burin_status call(burin_source handle, Body&& body) {
    return call_on(sources().find(handle), [&](SourceObject& object) { return body(object.source); });
}

template <std::size_t N>
Status copy_text(char (&out)[N], const char* text, const char* name) {
    if (!text) return {};
    if (std::strlen(text) >= N)
        return Status::error(Code::invalid_argument, "%s: '%.60s...' is longer than %zu bytes", name, text,
                             N - 1);
    std::snprintf(out, N, "%s", text);
    return {};
}

Status checked_options(const burin_source_options& o, LiveOptions* out) {
    if (o.struct_size != sizeof o)
        return Status::error(Code::invalid_argument, "options: size is %u, expected %zu", o.struct_size,
                             sizeof o);
    if (o.streams == 0 || o.streams >= 1u << BURIN_STREAMS)
        return Status::error(Code::invalid_argument, "options: streams is %#x, expected bits of 0x1f",
                             o.streams);
    const std::uint32_t sides[] = {o.depth_width, o.depth_height, o.colour_width, o.colour_height};
    for (const std::uint32_t side : sides)
        if (side > static_cast<std::uint32_t>(kMaxImageSide))
            return Status::error(Code::invalid_argument, "options: an image side of %u, expected at most %d",
                                 side, kMaxImageSide);
    if ((o.depth_width == 0) != (o.depth_height == 0) || (o.colour_width == 0) != (o.colour_height == 0))
        return Status::error(Code::invalid_argument, "options: expected both width and height, or neither");
    if (!(o.fps >= 0 && o.fps <= 1000))
        return Status::error(Code::invalid_argument, "options: fps is %g, expected 0..1000", o.fps);
    for (const std::uint32_t flag : {o.lossless, o.reconnect, o.keep_damaged, o.copy})
        if (flag > 1)
            return Status::error(Code::invalid_argument, "options: a flag is %u, expected 0 or 1", flag);
    if (o.registration > BURIN_REGISTRATION_COLOUR_TO_DEPTH)
        return Status::error(Code::invalid_argument, "options: registration is %u, expected 0..2",
                             o.registration);
    for (const std::uint64_t r : o.reserved)
        if (r != 0) return Status::error(Code::invalid_argument, "options: reserved fields are not zero");
    if (o.waiting_frames < 1 || o.waiting_frames > 32)
        return Status::error(Code::invalid_argument, "options: waiting_frames is %u, expected 1..32",
                             o.waiting_frames);
    SourceOptions& d = out->device;
    d.streams = o.streams;
    d.depth_width = static_cast<int>(o.depth_width);
    d.depth_height = static_cast<int>(o.depth_height);
    d.colour_width = static_cast<int>(o.colour_width);
    d.colour_height = static_cast<int>(o.colour_height);
    d.fps = o.fps;
    BURIN_TRY(copy_text(d.depth_format, o.depth_format, "options: depth_format"));
    BURIN_TRY(copy_text(d.colour_format, o.colour_format, "options: colour_format"));
    BURIN_TRY(copy_text(d.calibration, o.calibration, "options: calibration"));
    BURIN_TRY(copy_text(d.layout, o.layout, "options: layout"));
    d.fd = o.fd;
    d.lend = o.copy == 0;
    out->lossless = o.lossless != 0;
    out->waiting_frames = static_cast<int>(o.waiting_frames);
    out->reconnect = o.reconnect != 0;
    out->keep_damaged = o.keep_damaged != 0;
    out->registration = static_cast<RegistrationMode>(o.registration);
    return {};
}

burin_image c_image(const CapturedImage& i) {
    burin_image out = {};
    out.dmabuf_fd = -1;
    if (!i.pixels) return out;
    out.data = i.pixels;
    out.stride_bytes = i.stride_bytes;
    out.camera = c_camera(i.camera);
    out.t_ns = i.t_ns;
    out.host_ns = i.stamp.host_ns;
    out.device_ns = i.stamp.has_device_time ? i.stamp.device_ns : 0;
    out.sequence = i.stamp.sequence;
    out.lost = i.lost;
    out.has_device_time = i.stamp.has_device_time;
    out.damaged = i.stamp.damaged;
    out.dmabuf_fd = i.dmabuf_fd;
    return out;
}

Status open_source(const char* address, const burin_source_options* options, burin_source* out) {
    if (!address) return null_argument("address");
    if (!out) return null_argument("source");
    const burin_source_options defaults = burin_source_options_default();
    LiveOptions live;
    BURIN_TRY(checked_options(options ? *options : defaults, &live));
    const char* rest = nullptr;
    const SourceBackend* backend = find_capture_backend(address, &rest);
    if (!backend)
        return Status::error(
            Code::invalid_argument,
            "'%.100s': expected BACKEND:ADDRESS with a back end of this build, as burin devices "
            "lists them",
            address);
    auto* object = new (std::nothrow) SourceObject;
    if (!object) return Status::error(Code::insufficient_memory, "no memory for a source");
    if (options && options->log) {
        object->log = options->log;
        object->log_user = options->log_user;
        live.log = SourceObject::tell_log;
        live.log_user = object;
    }
    if (const Status opened = object->source.open(*backend, rest, live); !opened.ok()) {
        delete object;
        return opened;
    }
    if (!sources().add(object, out)) {
        delete object;
        return Status::error(Code::state, "%u sources are open, there are no more places",
                             SourceTable::places);
    }
    return {};
}

}  // namespace
}  // namespace burin

using namespace burin;

extern "C" {

burin_source_options burin_source_options_default(void) {
    burin_source_options o = {};
    o.struct_size = sizeof o;
    o.streams = BURIN_STREAM_BIT(BURIN_STREAM_DEPTH) | BURIN_STREAM_BIT(BURIN_STREAM_COLOUR);
    o.fd = -1;
    o.waiting_frames = 3;
    o.reconnect = 1;
    return o;
}

burin_status burin_source_open(const char* address, const burin_source_options* options,
                               burin_source* source) {
    return tell(source_thread_error(), open_source(address, options, source));
}

burin_status burin_source_close(burin_source* source) {
    if (!source) return tell(source_thread_error(), null_argument("source"));
    burin_status status = BURIN_OK;
    SourceObject* object = enter(sources().find(*source), &status);
    if (!object) return status;
    sources().remove(*source);
    delete object;
    *source = {0, 0};
    return BURIN_OK;
}

burin_status burin_source_start(burin_source source) {
    return call(source, [](LiveSource& s) { return s.start(); });
}
burin_status burin_source_stop(burin_source source) {
    return call(source, [](LiveSource& s) { return s.stop(); });
}

const char* burin_source_error(burin_source source) {
    const SourceObject* object = sources().find(source);
    return object ? object->error : source_thread_error();
}

burin_status burin_source_get_state(burin_source source, burin_source_state* state) {
    if (!state) return tell(source_thread_error(), null_argument("state"));
    return call(source, [&](LiveSource& s) {
        *state = static_cast<burin_source_state>(s.state());
        return Status();
    });
}

burin_status burin_source_stream(burin_source source, uint32_t stream, burin_stream_info* info) {
    if (!info) return tell(source_thread_error(), null_argument("info"));
    return call(source, [&](LiveSource& s) {
        if (stream >= BURIN_STREAMS)
            return Status::error(Code::invalid_argument, "stream is %u, expected 0..%d", stream,
                                 BURIN_STREAMS - 1);
        const StreamInfo& i = s.info().streams[stream];
        *info = {};
        info->width = static_cast<uint32_t>(i.width);
        info->height = static_cast<uint32_t>(i.height);
        info->bytes_per_sample = i.pixels == StreamPixels::u16 ? 2 : 1;
        info->pixel_format = static_cast<uint32_t>(i.colour_format);
        info->fps = i.fps;
        info->unit_m = i.unit_m;
        info->calibrated = i.calibrated;
        std::snprintf(info->format, sizeof info->format, "%s", i.format);
        info->camera = c_camera(i.camera);
        info->T_stream_depth = c_pose(i.T_stream_depth);
        return Status();
    });
}

burin_status burin_source_next(burin_source source, int64_t timeout_ns, burin_captured_frame* frame) {
    if (!frame) return tell(source_thread_error(), null_argument("frame"));
    return call(source, [&](LiveSource& s) {
        if (frame->struct_size != sizeof *frame)
            return Status::error(Code::invalid_argument, "frame: size is %u, expected %zu",
                                 frame->struct_size, sizeof *frame);
        if (timeout_ns < 0)
            return Status::error(Code::invalid_argument, "timeout_ns is %lld, expected 0 or more",
                                 static_cast<long long>(timeout_ns));
        CapturedFrame captured;
        const Status status = s.next(timeout_ns, &captured);
        for (int k = 0; k < kStreamKinds; ++k) frame->images[k] = c_image(captured.images[k]);
        frame->t_ns = captured.t_ns;
        frame->imu =
            reinterpret_cast<const burin_imu_sample*>(captured.imu);  // the same layout: frame_check.cpp
        frame->imu_count = static_cast<uint32_t>(captured.imu_count);
        return status;
    });
}

burin_status burin_frame_of_capture(burin_source source, const burin_captured_frame* frame,
                                    burin_frame* out) {
    if (!frame || !out) return tell(source_thread_error(), null_argument(frame ? "out" : "frame"));
    return call(source, [&](LiveSource& s) {
        const burin_image &depth = frame->images[BURIN_STREAM_DEPTH],
                          &colour = frame->images[BURIN_STREAM_COLOUR],
                          &confidence = frame->images[BURIN_STREAM_CONFIDENCE];
        const DeviceInfo& info = s.info();
        if (!depth.data || !info.has(StreamKind::depth))
            return Status::error(Code::invalid_argument, "frame: has no depth image");
        burin_frame f = burin_frame_default();
        f.depth_type = BURIN_DEPTH_U16;
        f.t_ns = frame->t_ns;
        f.depth = depth.data;
        f.depth_stride_bytes = depth.stride_bytes;
        f.depth_unit_m = info.at(StreamKind::depth).unit_m;
        f.depth_camera = depth.camera;
        if (confidence.data) {
            f.confidence = static_cast<const uint8_t*>(confidence.data);
            f.confidence_stride_bytes = confidence.stride_bytes;
        }
        if (colour.data) {
            const StreamInfo& c = info.at(StreamKind::colour);
            f.colour = static_cast<const uint8_t*>(colour.data);
            f.colour_format = static_cast<uint32_t>(c.colour_format);
            f.colour_stride_bytes = colour.stride_bytes;
            f.colour_camera = colour.camera;
            f.T_colour_depth = c_pose(c.T_stream_depth);
            if (c.colour_format == PixelFormat::nv12 || c.colour_format == PixelFormat::nv21) {
                f.chroma = f.colour + colour.stride_bytes * static_cast<uint64_t>(c.height);
                f.chroma_stride_bytes = colour.stride_bytes;
            }
        }
        f.imu = frame->imu;
        f.imu_count = frame->imu_count;
        f.T_camera_imu = c_pose(info.T_camera_imu);
        *out = f;
        return Status();
    });
}

burin_status burin_source_get(burin_source source, uint32_t control, burin_control_range* range) {
    if (!range) return tell(source_thread_error(), null_argument("range"));
    return call(source, [&](LiveSource& s) {
        if (control >= static_cast<uint32_t>(kSourceControls))
            return Status::error(Code::invalid_argument, "control is %u, expected 0..%d", control,
                                 kSourceControls - 1);
        ControlRange r;
        const Status status = s.get(static_cast<SourceControl>(control), &r);
        if (status.ok()) *range = {r.value, r.least, r.most, r.step, r.normal};
        return status;
    });
}

burin_status burin_source_set(burin_source source, uint32_t control, double value) {
    return call(source, [&](LiveSource& s) {
        if (control >= static_cast<uint32_t>(kSourceControls))
            return Status::error(Code::invalid_argument, "control is %u, expected 0..%d", control,
                                 kSourceControls - 1);
        if (!(value > -1e12 && value < 1e12))
            return Status::error(Code::invalid_argument, "value is %g, expected a finite number", value);
        return s.set(static_cast<SourceControl>(control), value);
    });
}

burin_status burin_source_stats(burin_source source, burin_source_statistics* out) {
    if (!out) return tell(source_thread_error(), null_argument("statistics"));
    return call(source, [&](LiveSource& s) {
        if (out->struct_size != sizeof *out)
            return Status::error(Code::invalid_argument, "statistics: size is %u, expected %zu",
                                 out->struct_size, sizeof *out);
        const SourceStatistics st = s.statistics();
        out->state = static_cast<uint32_t>(st.state);
        for (int k = 0; k < kStreamKinds; ++k) {
            const StreamStatistics& c = st.streams[k];
            out->streams[k] = {c.captured, c.delivered, c.lost, c.damaged, c.dropped};
        }
        out->frames = st.frames;
        out->reconnects = st.reconnects;
        out->restarts = st.restarts;
        out->ring_bytes = st.ring_bytes;
        out->wait_p50_ms = st.wait_p50_ms;
        out->wait_p95_ms = st.wait_p95_ms;
        out->wait_max_ms = st.wait_max_ms;
        out->delay_p50_ms = st.delay_p50_ms;
        out->delay_p95_ms = st.delay_p95_ms;
        out->delay_max_ms = st.delay_max_ms;
        out->drift_ppm = st.drift_ppm;
        return Status();
    });
}

}  // extern "C"
