// SPDX-License-Identifier: MIT
// Recordings of include/burin/capture.h over RecordingWriter.
#include <cstdio>
#include <new>

#include "api/source_handles.h"
#include "burin/capture.h"

namespace burin {
namespace {

Status checked_options(const burin_recorder_options& o, RecordingOptions* out) {
    if (o.struct_size != sizeof o)
        return Status::error(Code::invalid_argument, "options: size is %u, expected %zu", o.struct_size,
                             sizeof o);
    if (o.lossless > 1)
        return Status::error(Code::invalid_argument, "options: lossless is %u, expected 0 or 1", o.lossless);
    if (o.queue_frames < 1 || o.queue_frames > 256)
        return Status::error(Code::invalid_argument, "options: queue_frames is %u, expected 1..256",
                             o.queue_frames);
    if (o.colour > BURIN_RECORDED_RAW)
        return Status::error(Code::invalid_argument, "options: colour is %u, expected 0..2", o.colour);
    if (o.jpeg_quality < 1 || o.jpeg_quality > 100)
        return Status::error(Code::invalid_argument, "options: jpeg_quality is %u, expected 1..100",
                             o.jpeg_quality);
    if (!(o.sync_s >= 0 && o.sync_s <= 3600))
        return Status::error(Code::invalid_argument, "options: sync_s is %g, expected 0..3600", o.sync_s);
    for (const std::uint64_t r : o.reserved)
        if (r != 0) return Status::error(Code::invalid_argument, "options: reserved fields are not zero");
    constexpr RecordedColour kColours[] = {RecordedColour::jpeg, RecordedColour::lossless,
                                           RecordedColour::raw};
    out->lossless = o.lossless != 0;
    out->queue_frames = static_cast<int>(o.queue_frames);
    out->colour = kColours[o.colour];
    out->jpeg_quality = static_cast<int>(o.jpeg_quality);
    out->sync_ns = static_cast<std::int64_t>(o.sync_s * 1e9);
    return {};
}

Camera camera_of(const burin_camera& c) {
    return {static_cast<int>(c.width),
            static_cast<int>(c.height),
            c.fx,
            c.fy,
            c.cx,
            c.cy,
            c.k1,
            c.k2,
            c.p1,
            c.p2,
            c.k3};
}

CapturedFrame captured(const burin_captured_frame& frame) {
    CapturedFrame out;
    out.t_ns = frame.t_ns;
    out.imu = reinterpret_cast<const ImuSample*>(frame.imu);  // the same layout: frame_check.cpp
    out.imu_count = static_cast<int>(frame.imu_count);
    for (int k = 0; k < kStreamKinds; ++k) {
        const burin_image& i = frame.images[k];
        if (!i.data) continue;
        CapturedImage& image = out.images[k];
        image.pixels = static_cast<const std::uint8_t*>(i.data);
        image.stride_bytes = i.stride_bytes;
        image.camera = camera_of(i.camera);
        image.stamp.sequence = i.sequence;
        image.stamp.device_ns = i.device_ns;
        image.stamp.host_ns = i.host_ns;
        image.stamp.has_device_time = i.has_device_time != 0;
        image.stamp.damaged = i.damaged != 0;
        image.t_ns = i.t_ns;
        image.lost = i.lost;
    }
    return out;
}

// The images have the size that the recording was opened with.
Status checked_frame(const DeviceInfo& info, const burin_captured_frame& frame) {
    for (int k = 0; k < kStreamKinds; ++k) {
        const burin_image& i = frame.images[k];
        const StreamInfo& s = info.streams[k];
        if (i.data &&
            (i.camera.width != static_cast<std::uint32_t>(s.width) ||
             i.camera.height != static_cast<std::uint32_t>(s.height) || i.stride_bytes < s.row_bytes))
            return Status::error(Code::invalid_argument, "frame: %s is %ux%u, the source's is %dx%d",
                                 stream_name(static_cast<StreamKind>(k)), i.camera.width, i.camera.height,
                                 s.width, s.height);
    }
    return {};
}

Status open_recorder(burin_source source, const char* folder, const burin_recorder_options* options,
                     burin_recorder* out) {
    if (!folder) return null_argument("folder");
    if (!out) return null_argument("recorder");
    const burin_recorder_options defaults = burin_recorder_options_default();
    RecordingOptions checked;
    BURIN_TRY(checked_options(options ? *options : defaults, &checked));
    auto* object = new (std::nothrow) RecorderObject;
    if (!object) return Status::error(Code::insufficient_memory, "no memory for a recorder");
    const burin_status opened = call_on(sources().find(source), [&](SourceObject& s) {
        object->info = s.source.info();
        return object->writer.open(folder, s.source.info().name, s.source.info(), checked);
    });
    if (opened != BURIN_OK) {
        const Status status = Status::error(static_cast<Code>(opened), "%s", burin_source_error(source));
        delete object;
        return status;
    }
    if (recorders().add(object, out)) return {};
    delete object;
    return Status::error(Code::state, "%u recorders are open, there are no more places",
                         RecorderTable::places);
}

}  // namespace
}  // namespace burin

using namespace burin;

extern "C" {

burin_recorder_options burin_recorder_options_default(void) {
    burin_recorder_options o = {};
    o.struct_size = sizeof o;
    o.queue_frames = 15;
    o.jpeg_quality = 90;
    o.sync_s = 2;
    return o;
}

burin_status burin_recorder_open(burin_source source, const char* folder,
                                 const burin_recorder_options* options, burin_recorder* recorder) {
    return tell(source_thread_error(), open_recorder(source, folder, options, recorder));
}

burin_status burin_recorder_add(burin_recorder recorder, const burin_captured_frame* frame) {
    if (!frame) return tell(source_thread_error(), null_argument("frame"));
    return call_on(recorders().find(recorder), [&](RecorderObject& r) {
        if (frame->struct_size != sizeof *frame)
            return Status::error(Code::invalid_argument, "frame: size is %u, expected %zu",
                                 frame->struct_size, sizeof *frame);
        BURIN_TRY(checked_frame(r.info, *frame));
        return r.writer.add(captured(*frame));
    });
}

burin_status burin_recorder_finish(burin_recorder recorder) {
    return call_on(recorders().find(recorder), [](RecorderObject& r) { return r.writer.close(); });
}

burin_status burin_recorder_close(burin_recorder* recorder) {
    if (!recorder) return tell(source_thread_error(), null_argument("recorder"));
    burin_status status = BURIN_OK;
    RecorderObject* object = enter(recorders().find(*recorder), &status);
    if (!object) return status;
    recorders().remove(*recorder);
    status = tell(source_thread_error(), object->writer.close());
    delete object;
    *recorder = {0, 0};
    return status;
}

const char* burin_recorder_error(burin_recorder recorder) {
    const RecorderObject* object = recorders().find(recorder);
    return object ? object->error : source_thread_error();
}

burin_status burin_recorder_stats(burin_recorder recorder, burin_recorder_statistics* out) {
    if (!out) return tell(source_thread_error(), null_argument("statistics"));
    return call_on(recorders().find(recorder), [&](RecorderObject& r) {
        if (out->struct_size != sizeof *out)
            return Status::error(Code::invalid_argument, "statistics: size is %u, expected %zu",
                                 out->struct_size, sizeof *out);
        const RecordingStatistics s = r.writer.statistics();
        out->disk_full = s.state == RecordingState::full;
        out->failed = s.state == RecordingState::failed;
        out->queue_high_water = static_cast<std::uint32_t>(s.queue_high_water);
        out->frames = s.frames;
        out->dropped = s.dropped;
        out->file_bytes = s.file_bytes;
        out->image_bytes = s.image_bytes;
        out->coded_bytes = s.coded_bytes;
        out->imu_samples = s.imu_samples;
        out->write_p50_ms = s.write_p50_ms;
        out->write_p95_ms = s.write_p95_ms;
        out->write_max_ms = s.write_max_ms;
        return Status();
    });
}

}  // extern "C"
