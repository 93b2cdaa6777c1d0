// SPDX-License-Identifier: MIT
// The images of a live source in fixed memory: slots per stream, counted references. No locks of its own.
#pragma once

#include <cstdint>
#include <memory>

#include "capture/source.h"

namespace burin {

// An image with everything known of it.
struct CapturedImage {
    const std::uint8_t* pixels = nullptr;  // null: the frame has none of this stream
    std::size_t stride_bytes = 0;
    Camera camera;           // of this image
    ImageStamp stamp;        // its camera pointer is null
    std::int64_t t_ns = 0;   // CLOCK_MONOTONIC of the capture: the device's time on the host's clock
    std::uint64_t lost = 0;  // images of this stream that are missing since the last one that was captured
    int dmabuf_fd = -1;      // a descriptor of the same memory, or -1
};

class ImagePool {
  public:
    static constexpr int kMaxSlots = 48;  // a stream's: 32 frames waiting and what is between

    struct Slot {
        CapturedImage image;
        std::uint8_t* memory = nullptr;
        std::uint64_t token = 0;  // of a lent image
        bool lent = false;
        int references = 0;  // 0: free
    };

    // Memory for `slots` images of each delivered stream. Drops everything held. False: there is not enough.
    bool allocate(const DeviceInfo& info, int slots);
    std::uint64_t bytes() const { return bytes_; }

    // A free slot with one reference, or -1.
    int take(StreamKind kind);
    void hold(StreamKind kind, int slot) { ++at(kind, slot).references; }
    // The last reference frees the slot; true when a lent image is then to be given back.
    bool drop(StreamKind kind, int slot) {
        Slot& s = at(kind, slot);
        return --s.references == 0 && s.lent;
    }
    int find(StreamKind kind, const std::uint8_t* memory) const;
    Slot& at(StreamKind kind, int slot) { return slots_[static_cast<int>(kind)][slot]; }

  private:
    Slot slots_[kStreamKinds][kMaxSlots];
    int count_ = 0;
    std::unique_ptr<std::uint8_t[]> memory_;
    std::uint64_t bytes_ = 0;
};

}  // namespace burin
