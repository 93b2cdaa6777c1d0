// SPDX-License-Identifier: MIT
// What the benches share: frames of a data set, decoded and ready for the C interface, clocks and memory.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "burin/burin.h"
#include "capture/frame.h"
#include "core/status.h"

namespace burin::bench {

struct FrameRange {
    std::string dataset, format;
    int first = 0, last = 1 << 30;  // half open, clipped to the data set
    bool colour = false;            // keep the colour images
};

// Frames of the range that have a pose. `decode_ms`, one a frame, may be null.
Result<std::vector<Frame>> load_frames(const FrameRange& range, std::vector<double>* decode_ms);

// "A:B" into first and last, either end may be missing; false when it is none.
bool parse_range(const std::string& text, FrameRange* range);

// Points into `frame`.
FrameView view_of(const Frame& frame);

// Wall clock, and processor time of the whole process. With one thread both are the same on an idle machine;
// on a busy one the second still tells what the work costs, however long its frames are.
double now_ms();
double cpu_ms();
std::uint64_t peak_rss_bytes();

// A map with its memory, as the command line makes it: pages that are never touched are never paid for, and
// those that are fault in on first use, which is part of the time.
class BenchMap {
  public:
    BenchMap() = default;
    ~BenchMap();
    BenchMap(const BenchMap&) = delete;
    BenchMap& operator=(const BenchMap&) = delete;
    Status create(const burin_config& config);
    burin_map get() const { return map_; }

  private:
    burin_map map_ = {0, 0};
    void* memory_ = nullptr;
    std::uint64_t bytes_ = 0;
};

}  // namespace burin::bench
