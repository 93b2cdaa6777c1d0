// SPDX-License-Identifier: MIT
// A recorder for the commands that have a sensor: record, and scan --record.
#pragma once

#include "cli/common.h"
#include "cli/source_flags.h"

namespace burin::cli {

struct RecorderFlags {
    std::string colour = "jpeg";  // or lossless, raw
    int quality = 90;             // of jpeg
    bool lossless = false;        // wait for the disk rather than drop
};

// A recorder, closed with it.
class OwnedRecorder {
  public:
    OwnedRecorder() = default;
    ~OwnedRecorder();
    OwnedRecorder(const OwnedRecorder&) = delete;
    OwnedRecorder& operator=(const OwnedRecorder&) = delete;
    Status open(burin_source source, const std::string& folder, const RecorderFlags& flags);
    Status add(const burin_captured_frame& frame);
    Status finish();  // writes what waits; no frames after it
    nlohmann::json report() const;

  private:
    burin_recorder recorder_ = {0, 0};
};

struct RecordSource {
    std::string address, folder;
    SourceFlags source;
    RecorderFlags recorder;
    int frames = 0;      // 0: until it ends, or the user interrupts
    double seconds = 0;  // the same
    bool quiet = false;
};

// What was recorded stays in an error too; *report is that of the recorder, with "capture".
Status record_source(const RecordSource& what, nlohmann::json* report);

}  // namespace burin::cli
