// SPDX-License-Identifier: MIT
// burin record of a sensor: what comes goes into the recording until it ends or the user does.
#include "cli/record_source.h"

#include "burin/capture.h"

namespace burin::cli {
namespace {

Status recorder_status(burin_status status, burin_recorder recorder) {
    if (status == BURIN_OK) return {};
    return Status::error(static_cast<Code>(status), "%s", burin_recorder_error(recorder));
}

}  // namespace

OwnedRecorder::~OwnedRecorder() { burin_recorder_close(&recorder_); }

Status OwnedRecorder::open(burin_source source, const std::string& folder, const RecorderFlags& flags) {
    burin_recorder_options o = burin_recorder_options_default();
    o.lossless = flags.lossless;
    o.colour = flags.colour == "raw"        ? BURIN_RECORDED_RAW
               : flags.colour == "lossless" ? BURIN_RECORDED_LOSSLESS
                                            : BURIN_RECORDED_JPEG;
    o.jpeg_quality = static_cast<std::uint32_t>(flags.quality);
    return recorder_status(burin_recorder_open(source, folder.c_str(), &o, &recorder_), {0, 0});
}

Status OwnedRecorder::add(const burin_captured_frame& frame) {
    return recorder_status(burin_recorder_add(recorder_, &frame), recorder_);
}

nlohmann::json OwnedRecorder::report() const {
    burin_recorder_statistics s = {};
    s.struct_size = sizeof s;
    if (burin_recorder_stats(recorder_, &s) != BURIN_OK) return nullptr;
    const double ratio =
        s.coded_bytes > 0 ? static_cast<double>(s.image_bytes) / static_cast<double>(s.coded_bytes) : 0.0;
    return {{"frames", s.frames},
            {"dropped", s.dropped},
            {"imu_samples", s.imu_samples},
            {"file_bytes", s.file_bytes},
            {"compression", ratio},
            {"disk_full", s.disk_full != 0},
            {"queue_high_water", s.queue_high_water},
            {"write_ms", {{"p50", s.write_p50_ms}, {"p95", s.write_p95_ms}, {"max", s.write_max_ms}}}};
}

Status OwnedRecorder::finish() { return recorder_status(burin_recorder_finish(recorder_), recorder_); }

Status record_source(const RecordSource& what, nlohmann::json* report) {
    OwnedSource source;
    BURIN_TRY(source.open(what.address, what.source, what.quiet));
    OwnedRecorder recorder;
    BURIN_TRY(recorder.open(source.get(), what.folder, what.recorder));
    const double end_ms = what.seconds > 0 ? now_ms() + what.seconds * 1000 : 0;
    Status outcome;
    {
        Progress progress("record", what.frames, what.quiet);
        for (int i = 0; (what.frames == 0 || i < what.frames) && (end_ms == 0 || now_ms() < end_ms); ++i) {
            burin_captured_frame frame = {};
            frame.struct_size = sizeof frame;
            const Result<bool> got = source.next(&frame);
            if (!got.ok() || !*got) {
                outcome = got.status();
                break;
            }
            if (outcome = recorder.add(frame); !outcome.ok()) break;
            progress.update(i + 1);
        }
    }
    const Status finished = recorder.finish();
    *report = recorder.report();
    (*report)["capture"] = source_report(source.get());
    return outcome.ok() ? finished : outcome;
}

}  // namespace burin::cli
