// SPDX-License-Identifier: MIT
// What scan and record share about sensors: options, interruption, the line of what went wrong.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "burin/capture.h"
#include "core/status.h"

namespace burin::cli {

struct SourceFlags {
    std::string depth_size, colour_size, depth_format, colour_format, calibration, layout;
    double fps = 0, patience_s = 10;
    bool lossless = false, no_colour_stream = false, infrared = false;
    void add_to(CLI::App& app);
};

// An open source, closed with it.
class OwnedSource {
  public:
    OwnedSource() = default;
    ~OwnedSource() { burin_source_close(&source_); }
    OwnedSource(const OwnedSource&) = delete;
    OwnedSource& operator=(const OwnedSource&) = delete;
    // Opens and starts. Lines of the source go to stderr unless quiet.
    Status open(const std::string& address, const SourceFlags& flags, bool quiet);
    burin_source get() const { return source_; }

    // The next frame: true; false when the source has ended or the user has interrupted. While the device is
    // unplugged, waits for patience_s; then, or when it fails, the error.
    Result<bool> next(burin_captured_frame* frame);

  private:
    burin_source source_ = {0, 0};
    std::string address_;
    double patience_s_ = 10;
};

// SIGINT and SIGTERM end the loop, not the program: what was captured is kept. From catch_interrupts() on,
// which opening a source calls too.
void catch_interrupts();
bool interrupted();

// frames, lost, dropped, damaged of each stream, latencies, drift: "capture" of a report.
nlohmann::json source_report(burin_source source);

}  // namespace burin::cli
