// SPDX-License-Identifier: MIT
#include "cli/source_flags.h"

#include <atomic>
#include <csignal>
#include <cstdio>

#include "cli/common.h"

namespace burin::cli {
namespace {

std::atomic<bool> stop_asked{false};

void ask_to_stop(int) { stop_asked.store(true); }

bool parse_size(const std::string& text, std::uint32_t* width, std::uint32_t* height) {
    int end = 0;
    return text.empty() || (std::sscanf(text.c_str(), "%ux%u%n", width, height, &end) == 2 &&
                            end == static_cast<int>(text.size()));
}

Status source_status(burin_status status, burin_source source) {
    if (status == BURIN_OK) return {};
    return Status::error(static_cast<Code>(status), "%s", burin_source_error(source));
}

}  // namespace

void SourceFlags::add_to(CLI::App& app) {
    const char* group = "Sensors";
    app.add_option("--depth-size", depth_size, "WIDTHxHEIGHT of depth images")->group(group);
    app.add_option("--colour-size", colour_size, "WIDTHxHEIGHT of colour images")->group(group);
    app.add_option("--fps", fps, "frames a second (otherwise the fastest)")
        ->group(group)
        ->check(CLI::Range(0.0, 1000.0));
    app.add_option("--depth-format", depth_format, "as burin devices names it")->group(group);
    app.add_option("--colour-format", colour_format, "as burin devices names it")->group(group);
    app.add_option("--calibration", calibration, "a calibration file, for devices that know none of theirs")
        ->group(group);
    app.add_option("--layout", layout, "of the raw words of a time-of-flight board (docs/v4l2.md)")
        ->group(group);
    app.add_option("--patience", patience_s, "seconds to wait for a sensor that was unplugged")
        ->group(group)
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    app.add_flag("--lossless", lossless, "hold up the sensor rather than drop frames when too slow")
        ->group(group);
    app.add_flag("--no-colour-stream", no_colour_stream, "capture depth alone")->group(group);
    app.add_flag("--infrared", infrared, "capture infrared images too")->group(group);
}

Status OwnedSource::open(const std::string& address, const SourceFlags& flags, bool quiet) {
    burin_source_options o = burin_source_options_default();
    if (!parse_size(flags.depth_size, &o.depth_width, &o.depth_height))
        return Status::error(Code::invalid_argument, "--depth-size: '%.40s', expected WIDTHxHEIGHT",
                             flags.depth_size.c_str());
    if (!parse_size(flags.colour_size, &o.colour_width, &o.colour_height))
        return Status::error(Code::invalid_argument, "--colour-size: '%.40s', expected WIDTHxHEIGHT",
                             flags.colour_size.c_str());
    const auto text = [](const std::string& s) { return s.empty() ? nullptr : s.c_str(); };
    o.depth_format = text(flags.depth_format);
    o.colour_format = text(flags.colour_format);
    o.calibration = text(flags.calibration);
    o.layout = text(flags.layout);
    o.fps = flags.fps;
    o.lossless = flags.lossless;
    // A hiccup of one frame is bridged; more waiting frames would only make what a slow tracker sees older.
    o.waiting_frames = 2;
    o.streams = BURIN_STREAM_BIT(BURIN_STREAM_DEPTH) | BURIN_STREAM_BIT(BURIN_STREAM_CONFIDENCE);
    if (!flags.no_colour_stream) o.streams |= BURIN_STREAM_BIT(BURIN_STREAM_COLOUR);
    if (flags.infrared)
        o.streams |= BURIN_STREAM_BIT(BURIN_STREAM_INFRARED) | BURIN_STREAM_BIT(BURIN_STREAM_INFRARED_RIGHT);
    if (!quiet)
        o.log = [](void*, burin_log_level, const char* line) { std::fprintf(stderr, "burin: %s\n", line); };
    address_ = address;
    patience_s_ = flags.patience_s;
    // From here on an interruption ends the loop, and the sensor is given back in order.
    catch_interrupts();
    if (const burin_status opened = burin_source_open(address.c_str(), &o, &source_); opened != BURIN_OK)
        return source_status(opened, {0, 0});
    return source_status(burin_source_start(source_), source_);
}

Result<bool> OwnedSource::next(burin_captured_frame* frame) {
    // How soon an interruption is noticed.
    constexpr std::int64_t kLook_ns = 100'000'000;
    const double began_ms = now_ms();
    for (;;) {
        if (interrupted()) return false;
        const burin_status status = burin_source_next(source_, kLook_ns, frame);
        if (status == BURIN_OK) return true;
        if (status == BURIN_ENDED) return false;
        const bool may_come = status == BURIN_TIMEOUT || status == BURIN_DISCONNECTED;
        if (!may_come || now_ms() - began_ms > patience_s_ * 1000) return source_status(status, source_);
    }
}

void catch_interrupts() {
    std::signal(SIGINT, ask_to_stop);
    std::signal(SIGTERM, ask_to_stop);
}

bool interrupted() { return stop_asked.load(); }

nlohmann::json source_report(burin_source source) {
    burin_source_statistics s = {};
    s.struct_size = sizeof s;
    if (burin_source_stats(source, &s) != BURIN_OK) return nullptr;
    constexpr const char* kNames[BURIN_STREAMS] = {"depth", "colour", "infrared", "infrared_right",
                                                   "confidence"};
    nlohmann::json streams;
    for (int k = 0; k < BURIN_STREAMS; ++k) {
        burin_stream_info info;
        if (burin_source_stream(source, static_cast<burin_stream>(k), &info) != BURIN_OK || info.width == 0)
            continue;
        const burin_stream_counts& c = s.streams[k];
        streams[kNames[k]] = {
            {"format", info.format},  {"width", info.width},      {"height", info.height},
            {"captured", c.captured}, {"delivered", c.delivered}, {"lost", c.lost},
            {"damaged", c.damaged},   {"dropped", c.dropped},     {"calibrated", info.calibrated != 0}};
    }
    return {{"streams", streams},
            {"reconnects", s.reconnects},
            {"restarts", s.restarts},
            {"ring_bytes", s.ring_bytes},
            {"wait_ms", {{"p50", s.wait_p50_ms}, {"p95", s.wait_p95_ms}, {"max", s.wait_max_ms}}},
            {"delay_ms", {{"p50", s.delay_p50_ms}, {"p95", s.delay_p95_ms}, {"max", s.delay_max_ms}}},
            {"drift_ppm", s.drift_ppm}};
}

}  // namespace burin::cli
