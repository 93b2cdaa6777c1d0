// SPDX-License-Identifier: MIT
// burin record: frames into a recording (docs/recording.md), which replays bit for bit.
#include "cli/common.h"
#include "cli/feed.h"
#include "cli/record_source.h"
#include "datasets/open.h"
#include "datasets/record_dataset.h"

namespace burin::cli {
namespace {

struct Options {
    std::string source, output, format, frames, colour = "jpeg";
    int quality = 90;
    double seconds = 0;
    SourceFlags sensor;
    bool json = false, quiet = false;
};

RecordedColour colour_of(const std::string& name) {
    if (name == "raw") return RecordedColour::raw;
    return name == "lossless" ? RecordedColour::lossless : RecordedColour::jpeg;
}

nlohmann::json report_of(const std::string& path, const RecordingStatistics& s) {
    const double ratio =
        s.coded_bytes > 0 ? static_cast<double>(s.image_bytes) / static_cast<double>(s.coded_bytes) : 0.0;
    return {{"recording", path},
            {"frames", s.frames},
            {"dropped", s.dropped},
            {"imu_samples", s.imu_samples},
            {"file_bytes", s.file_bytes},
            {"compression", ratio},
            {"queue_bytes", s.queue_bytes},
            {"queue_high_water", s.queue_high_water},
            {"write_ms", {{"p50", s.write_p50_ms}, {"p95", s.write_p95_ms}, {"max", s.write_max_ms}}}};
}

void tell(const Options& o, const nlohmann::json& report) {
    if (o.json)
        std::printf("%s\n", report.dump().c_str());
    else if (!o.quiet)
        std::printf("%s: %llu frames, %.1f MB\n", (o.output + "/" + kRecordingName).c_str(),
                    static_cast<unsigned long long>(report["frames"]),
                    static_cast<double>(report["file_bytes"]) * 1e-6);
}

int run_sensor(const Options& o) {
    RecordSource what = {o.source, o.output,  o.sensor, {o.colour, o.quality, o.sensor.lossless},
                         0,        o.seconds, o.quiet};
    int begin = 0, end = 0;
    if (!o.frames.empty()) {
        if (!parse_range(o.frames, &begin, &end) || begin != 0)
            return complain(kBadInput, "--frames: '" + o.frames + "', expected 0:N for a sensor");
        what.frames = end;
    }
    nlohmann::json report;
    const Status status = record_source(what, &report);
    if (report.is_null()) return complain_input(status);  // nothing was begun
    report["recording"] = o.output + "/" + kRecordingName;
    tell(o, report);
    // A sensor that went away has not undone the recording.
    return status.ok() ? kDone : complain(kFailed, status.text());
}

int run(const Options& o) {
    if (is_source_address(o.source)) return run_sensor(o);
    RecordDatasetOptions options;
    if (!o.frames.empty() && !parse_range(o.frames, &options.begin, &options.end))
        return complain(kBadInput, "--frames: '" + o.frames + "', expected A:B with A < B");
    options.colour = colour_of(o.colour);
    options.jpeg_quality = o.quality;
    const auto dataset = open_dataset(o.source, o.format);
    if (!dataset.ok()) return complain_input(dataset.status());
    catch_interrupts();
    RecordingStatistics statistics;
    Status status;
    {
        Progress progress("record", std::min(options.end, (*dataset)->frame_count()) - options.begin,
                          o.quiet);
        status = record_dataset(
            **dataset, o.output, o.source, options,
            [&](int done, int) {
                progress.update(done);
                return !interrupted();
            },
            &statistics);
    }
    if (!status.ok()) return complain_output(status);
    const std::string path = o.output + "/" + kRecordingName;
    tell(o, report_of(path, statistics));
    return kDone;
}

}  // namespace

void add_record(CLI::App& app, int* exit) {
    auto* command = app.add_subcommand("record", "Write a recording, to be replayed bit for bit");
    auto o = std::make_shared<Options>();
    command->add_option("source", o->source, "a sequence, or a sensor as burin devices lists them")
        ->required();
    command->add_option("-o,--output", o->output, "folder for the recording")->required();
    command->add_option("--format", o->format, "layout of the data set (recognised by itself otherwise)");
    command->add_option("--frames", o->frames, "A:B, only frames A..B-1");
    command->add_option("--colour", o->colour, "jpeg, lossless or raw")
        ->check(CLI::IsMember({"jpeg", "lossless", "raw"}))
        ->capture_default_str();
    command->add_option("--quality", o->quality, "of jpeg colour")
        ->check(CLI::Range(1, 100))
        ->capture_default_str();
    command->add_option("--seconds", o->seconds, "of a sensor: when to stop (otherwise at Ctrl-C)")
        ->group("Sensors")
        ->check(CLI::NonNegativeNumber);
    o->sensor.add_to(*command);
    command->add_flag("--json", o->json, "print a summary on stdout");
    command->add_flag("--quiet", o->quiet, "no progress");
    command->callback([o, exit] { *exit = run(*o); });
}

}  // namespace burin::cli
