// SPDX-License-Identifier: MIT
// The one thread that reads frames of OpenNI2, for all devices and the rest of the process.
// oniWaitForAnyStream keeps an event for every thread that ever called it and asks pthread_kill() whether
// that thread still lives, which since glibc 2.34 is undefined for one that has been joined, and crashes
// (seen with 2.2.0.33). So no thread that ends may ever call it.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>

#include "platform/openni2/openni2_library.h"

namespace burin {

inline constexpr int kOniStreams = 3;  // of a device: depth, colour, infrared

// The frames that were read and not taken yet.
struct Openni2Frames {
    static constexpr int kWaiting = 8;  // of all streams: a tenth of a second of depth and colour
    struct Entry {
        int stream;
        OniFrame* frame;
    };
    OniStreamHandle streams[kOniStreams] = {};
    int stream_count = 0;

    // Below: under the reader's mutex.
    Entry entries[kWaiting];
    int count = 0;
    std::atomic<bool> failed{false};
    std::condition_variable arrived;
};

class Openni2Reader {
  public:
    static Openni2Reader& get();

    // From now on until remove() the streams are read. Errors: insufficient_memory (no thread, or too many
    // devices).
    Status add(const Openni2& oni, Openni2Frames* frames);
    // Releases what was not taken.
    void remove(Openni2Frames* frames);
    // The next frame: true. Waits until deadline_ns (CLOCK_MONOTONIC). False: none came, or reading failed.
    bool next(Openni2Frames* frames, std::int64_t deadline_ns, Openni2Frames::Entry* entry);

  private:
    static constexpr int kDevices = 16;  // as many as sources
    static void* enter(void* self);
    void run();

    std::mutex mutex_;
    std::condition_variable changed_;
    const Openni2* oni_ = nullptr;
    Openni2Frames* devices_[kDevices] = {};
    int count_ = 0;
    bool running_ = false;
    bool reading_ = false;  // outside the mutex
};

}  // namespace burin
