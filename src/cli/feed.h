// SPDX-License-Identifier: MIT
// Where the frames of a reconstruction come from: a recorded data set, or a sensor that streams.
#pragma once

#include <memory>
#include <string>

#include "burin/burin.h"
#include "cli/source_flags.h"
#include "core/status.h"

namespace burin::cli {

// A frame for the C interface; what it points to holds until the next but one is asked for, of a sensor until
// the next one.
struct FeedFrame {
    burin_frame view = burin_frame_default();
    bool has_pose = false;        // view.T_world_camera is the source's own
    std::int64_t arrived_ns = 0;  // of a sensor: when the last byte had come, CLOCK_MONOTONIC; else 0
};

class FrameFeed {
  public:
    virtual ~FrameFeed() = default;
    // The next frame: true; false after the last, also once the user has interrupted.
    virtual Result<bool> next(FeedFrame* frame) = 0;
    virtual int index() const = 0;  // of the frame last handed out
    // Whether the next frame may be asked for before this one is taken in: not when that means to wait for a
    // sensor.
    virtual bool looks_ahead() const { return false; }
    virtual int total() const = 0;  // frames there will be, 0: nobody knows
    virtual int width() const = 0;  // of depth images, the largest
    virtual int height() const = 0;
    virtual std::string notes() { return {}; }  // lines for the user, once it is over
    // What a report tells of a sensor; null for data sets.
    virtual nlohmann::json report() { return nullptr; }
};

struct FeedOptions {
    std::string path, format;         // a folder or file, or BACKEND:ADDRESS
    int begin = 0, end = 1000000000;  // frames
    double seconds = 0;               // of a sensor: when to stop; 0: when interrupted
    bool quiet = false;
    int min_confidence = -1;  // depth of less is ignored; -1: what the source says
    SourceFlags source;
    std::string record;  // of a sensor: a folder for a recording of what comes
};

// A sensor's address begins with the name of a back end and a colon, and is no path that exists.
bool is_source_address(const std::string& path);

Result<std::unique_ptr<FrameFeed>> open_dataset_feed(const FeedOptions& options);
Result<std::unique_ptr<FrameFeed>> open_source_feed(const FeedOptions& options);

}  // namespace burin::cli
