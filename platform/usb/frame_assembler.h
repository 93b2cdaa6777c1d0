// SPDX-License-Identifier: MIT
// From data packets to whole frames in one buffer, with everything that can be missing named.
#pragma once

#include <cstdint>
#include <memory>

#include "platform/usb/packet_parser.h"

namespace burin {

// What is wrong with a frame; the first thing that went wrong wins.
enum class FrameFault : std::uint8_t {
    none,
    packets_lost,   // ids with a gap
    packet_short,   // fewer bytes than a packet of this place has
    packet_long,    // more
    packet_broken,  // cut off in a transfer that failed
    out_of_place,   // first, middle or last where another had to be
    no_end,         // the next frame began before the last packet
    wrong_size,     // whole, but not of the size of its format
};
const char* fault_text(FrameFault fault);

struct RawFrame {
    const std::uint8_t* data = nullptr;  // kRawMargin bytes behind the last may be read
    int bytes = 0;
    int pad_before = 0, pad_after = 0;  // pixels without depth around what was sent
    std::uint32_t stamp = 0;            // of the last packet
    bool has_stamp = false;
    FrameFault fault = FrameFault::none;
    int packets_lost = 0;
    bool after_gap = false;  // packets are missing since the frame before: whole frames may be
};

// Unpacking may read a vector beyond the end.
inline constexpr int kRawMargin = 64;

class FrameTarget {
  public:
    virtual ~FrameTarget() = default;
    virtual void frame(const RawFrame& frame) = 0;
};

struct FrameLayout {
    PacketStream stream = PacketStream::depth;
    int bytes = 0;         // of a frame; 0: any, up to capacity (compressed)
    int capacity = 0;      // of the buffer, at least `bytes`
    int packet_bytes = 0;  // payload of all packets but the last; 0: as their headers say
    int id_bits = 16;      // Kinect: 8
    bool padded = false;   // the first packet's stamp says how many pixels to pad
    int pixels = 0;        // of a frame; what padding may not exceed
};

// Frames begin at the first packet that begins one, so what comes before, after a start, is no fault.
class FrameAssembler final : public PacketSink {
  public:
    // False: no memory. Allocates; nothing else here does.
    bool reset(const FrameLayout& layout, FrameTarget* target);

    void packet_begin(const PacketHeader& header) override;
    void packet_data(const std::uint8_t* data, int bytes) override;
    void packet_end() override;
    void packet_broken() override;
    void garbage(int bytes) override { garbage_ += static_cast<std::uint64_t>(bytes); }

    std::uint64_t garbage_bytes() const { return garbage_; }

  private:
    int packets_per_frame() const {
        return (layout_.bytes + layout_.packet_bytes - 1) / layout_.packet_bytes;
    }
    void open_frame();
    void close_frame();
    void blame(FrameFault fault) {
        if (frame_.fault == FrameFault::none) frame_.fault = fault;
    }
    void skip_lost(int packets);
    void fill_to(int position);
    void place(const PacketHeader& header);

    FrameLayout layout_;
    FrameTarget* target_ = nullptr;
    std::unique_ptr<std::uint8_t[]> buffer_;
    RawFrame frame_;
    PacketHeader packet_;
    bool ours_ = false;  // the packet under way is of this stream and of a frame
    bool in_frame_ = false;
    bool id_known_ = false;
    bool synced_ = false;  // a first packet was seen; with packets of one size: and since then all fitted
    bool gap_ = false;     // since the frame before
    std::uint16_t next_id_ = 0;
    int position_ = 0;  // bytes in the buffer
    int index_ = 0;     // packets of this frame so far, with those lost
    int limit_ = 0;     // where the packet under way has to end at the latest
    std::uint64_t garbage_ = 0;
};

}  // namespace burin
