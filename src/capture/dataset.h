// SPDX-License-Identifier: MIT
// The interface every recorded data set implements. Live sensors: capture/source.h.
#pragma once

#include <memory>
#include <string>

#include "capture/frame.h"

namespace burin {

class Dataset {
  public:
    virtual ~Dataset() = default;
    // Short name of the format as `--format` takes it: "tum", "7scenes", ...
    virtual const char* format() const = 0;
    virtual int frame_count() const = 0;
    // Frames are complete before they are handed out: a truncated image or a bad pose is an error that names
    // the file, the value and what was expected. Safe to call from several threads at once; 0 <= index <
    // frame_count(). A frame whose pose is unknown comes with has_pose == false.
    virtual Status load(int index, Frame* out) const = 0;
    // One-line notes for the user from opening (e.g. "5 of 251 depth images have no pose within 20 ms"), may
    // be empty.
    virtual std::string notes() const { return {}; }
};

}  // namespace burin
