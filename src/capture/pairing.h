// SPDX-License-Identifier: MIT
// Which colour, infrared and confidence image belongs to which depth image: the nearest in time, decided once
// a later one could not be nearer. No locks of its own.
#pragma once

#include <cstdint>

#include "capture/image_pool.h"

namespace burin {

// One image of each stream as a slot of the pool, -1 where there is none. Holds a reference to each.
struct Bundle {
    int slots[kStreamKinds] = {-1, -1, -1, -1, -1};
};

class Pairing {
  public:
    // Images of these streams come. The leading stream has an image in every bundle: depth, else infrared,
    // else colour.
    void reset(const DeviceInfo& info);
    StreamKind leading() const { return leading_; }

    // A captured image; its reference is the pairing's from now on. `spill` is a slot of the same stream that
    // had to go because more wait than kWaiting (its reference is the caller's to drop), or -1.
    void add(StreamKind kind, int slot, std::int64_t time_ns, int* spill);

    // The next bundle that is decided, true; or false. now_ns: CLOCK_MONOTONIC; an image whose companion does
    // not come within its own period goes alone. Slots that no later bundle can use are returned for
    // dropping.
    struct Dropped {
        StreamKind kind;
        int slot;
    };
    bool next(ImagePool& pool, std::int64_t now_ns, Bundle* bundle, Dropped* dropped, int* dropped_count);
    // The most that one next() drops.
    static constexpr int kMaxDropped = 64;

    // Gives up what waits, one slot a call (the oldest of the leading stream first); false when nothing does.
    bool give_up(Dropped* dropped);

    // Images a stream may have waiting: the leading stream waits a period of the slowest companion at most
    // (90 images a second against 15), companions for what they may be paired with.
    static constexpr int kWaiting = 8;

  private:
    struct Waiting {
        int slot;
        std::int64_t time_ns, since_ns;
    };
    struct Queue {
        Waiting entries[kWaiting];
        int count = 0;
        bool used = false;  // the stream is delivered
        std::int64_t period_ns = 0;
        Waiting pop_front();
    };
    bool decided(const Queue& companion, const Waiting& leader, std::int64_t now_ns) const;

    Queue queues_[kStreamKinds];
    StreamKind leading_ = StreamKind::depth;
};

}  // namespace burin
