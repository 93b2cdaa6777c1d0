// SPDX-License-Identifier: MIT
// Decodes frames ahead of the one that needs them, on threads of its own.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "capture/dataset.h"

namespace burin {

// Delivers the frames begin..end-1 of a data set, each once and in order. At most `ahead` decoded frames
// wait; their buffers and the caller's go round by swapping, so a long run allocates no pixels after its
// first frames. Neither side spins. One consumer thread; the data set must outlive the prefetcher.
// Destruction in the middle is fine: it waits for the frames being decoded at that moment.
class FramePrefetcher {
  public:
    // The range is clipped to the data set, `ahead` to 1..64 (64 VGA frames with colour are 100 MB),
    // `threads` to 1..ahead. One thread decodes VGA PNG pairs at some 60 Hz.
    FramePrefetcher(const Dataset& dataset, int begin, int end, int ahead, int threads = 1);
    ~FramePrefetcher();
    FramePrefetcher(const FramePrefetcher&) = delete;
    FramePrefetcher& operator=(const FramePrefetcher&) = delete;

    // The next frame, waiting for it when need be; true when there was one, false after the last. What *frame
    // held is taken in exchange. When a frame cannot be read its error comes at its place in the order,
    // *frame stays as it was, and the next call goes on with the frame after it.
    Result<bool> next(Frame* frame);

    // Index in the data set of the frame (or error) last delivered; begin - 1 before the first.
    int index() const { return next_index_ - 1; }

  private:
    struct Slot {
        Frame frame;
        Status status;
        bool full = false;
    };
    void work();
    Slot& slot_of(int index) { return slots_[static_cast<std::size_t>(index) % slots_.size()]; }

    const Dataset& dataset_;
    int end_ = 0;
    std::mutex mutex_;  // guards everything below but the frames of slots being decoded
    std::condition_variable room_, arrived_;
    std::vector<Slot> slots_;
    int next_index_ = 0;   // to deliver
    int next_decode_ = 0;  // to hand to a thread; at most slots_.size() beyond next_index_
    bool stop_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace burin
