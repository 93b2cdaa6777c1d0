// SPDX-License-Identifier: MIT
#include "platform/usb/frame_assembler.h"

#include <algorithm>
#include <cstring>
#include <new>

namespace burin {
namespace {

// All ones is "no depth" in every packed format (2047 of 11 bits), and a colour like any other.
constexpr int kMissing = 0xff;

}  // namespace

const char* fault_text(FrameFault fault) {
    constexpr const char* kTexts[] = {"whole",
                                      "packets were lost",
                                      "a packet was too short",
                                      "a packet was too long",
                                      "a packet was cut off",
                                      "a packet was out of place",
                                      "its end is missing",
                                      "its size is wrong"};
    return kTexts[static_cast<int>(fault)];
}

bool FrameAssembler::reset(const FrameLayout& layout, FrameTarget* target) {
    *this = FrameAssembler();
    layout_ = layout;
    target_ = target;
    buffer_.reset(new (std::nothrow) std::uint8_t[static_cast<std::size_t>(layout.capacity + kRawMargin)]());
    return buffer_ != nullptr;
}

void FrameAssembler::open_frame() {
    frame_ = RawFrame();
    frame_.after_gap = gap_;
    gap_ = false;
    in_frame_ = true;
    position_ = index_ = 0;
}

void FrameAssembler::close_frame() {
    in_frame_ = false;
    if (layout_.bytes > 0 && frame_.fault == FrameFault::none && !layout_.padded &&
        position_ != layout_.bytes)
        blame(FrameFault::wrong_size);
    if (layout_.packet_bytes > 0) fill_to(layout_.bytes);
    frame_.data = buffer_.get();
    frame_.bytes = position_;
    target_->frame(frame_);
}

void FrameAssembler::fill_to(int position) {
    if (position_ >= position) return;
    std::memset(buffer_.get() + position_, kMissing, static_cast<std::size_t>(position - position_));
    position_ = position;
}

// With packets of one size the place of what is missing is known.
void FrameAssembler::skip_lost(int packets) {
    const int whole = packets_per_frame();
    while (packets > 0) {
        if (!in_frame_) open_frame();
        blame(FrameFault::packets_lost);
        const int step = std::min(packets, whole - index_);
        frame_.packets_lost += step;
        index_ += step;
        packets -= step;
        fill_to(std::min(index_ * layout_.packet_bytes, layout_.bytes));
        if (index_ == whole) close_frame();
    }
}

// A packet in a frame of packets of one size: is it where it belongs?
void FrameAssembler::place(const PacketHeader& header) {
    const int whole = packets_per_frame();
    const bool fits = header.first()  ? index_ == 0
                      : header.last() ? index_ == whole - 1
                                      : index_ > 0 && index_ < whole - 1;
    if (!fits) {
        // One that begins a frame does so whatever was expected.
        blame(header.first() ? FrameFault::no_end : FrameFault::out_of_place);
        close_frame();
        if (!header.first()) {
            synced_ = false;
            return;
        }
        open_frame();
    }
    limit_ = std::min((index_ + 1) * layout_.packet_bytes, layout_.bytes);
}

void FrameAssembler::packet_begin(const PacketHeader& header) {
    packet_ = header;
    ours_ = header.stream() == static_cast<std::uint8_t>(layout_.stream) &&
            (header.first() || header.middle() || header.last());
    if (!ours_) return;
    const unsigned mask = (1u << layout_.id_bits) - 1;
    const unsigned lost = (header.id - next_id_) & mask;
    // PrimeSense devices begin anew at 0 with a stream (OpenNI2 takes it so).
    const bool gap = id_known_ && lost != 0 && !(layout_.id_bits == 16 && header.id == 0 && header.first());
    id_known_ = true;
    next_id_ = static_cast<std::uint16_t>((header.id + 1u) & mask);
    if (gap) {
        gap_ = true;
        if (layout_.packet_bytes > 0 && synced_) {
            skip_lost(static_cast<int>(lost));
        } else if (in_frame_) {
            blame(FrameFault::packets_lost);
            frame_.packets_lost += static_cast<int>(lost);
        }
    }
    if (layout_.packet_bytes > 0) {
        if (!in_frame_ && header.first()) open_frame();
        synced_ = synced_ || header.first();
        ours_ = in_frame_;
        if (ours_) place(header);
        ours_ = in_frame_;
        return;
    }
    if (header.first()) {
        if (in_frame_) {
            blame(FrameFault::no_end);
            close_frame();
        }
        open_frame();
        if (layout_.padded) {
            frame_.pad_before = static_cast<int>(header.stamp >> 16);
            frame_.pad_after = static_cast<int>(header.stamp & 0xffff);
            if (frame_.pad_before + frame_.pad_after > layout_.pixels) {
                frame_.pad_before = frame_.pad_after = 0;
                blame(FrameFault::wrong_size);
            }
        }
    }
    ours_ = in_frame_;
    limit_ = layout_.capacity;
}

void FrameAssembler::packet_data(const std::uint8_t* data, int bytes) {
    if (!ours_) return;
    const int room = limit_ - position_;
    if (bytes > room) {
        blame(FrameFault::packet_long);
        bytes = room;
    }
    std::memcpy(buffer_.get() + position_, data, static_cast<std::size_t>(bytes));
    position_ += bytes;
}

void FrameAssembler::packet_end() {
    if (!ours_) return;
    ours_ = false;
    ++index_;
    if (layout_.packet_bytes > 0 && position_ < limit_) {
        blame(FrameFault::packet_short);
        fill_to(limit_);
    }
    if (!packet_.last()) return;
    frame_.stamp = packet_.stamp;
    frame_.has_stamp = true;
    close_frame();
}

void FrameAssembler::packet_broken() {
    if (!ours_) return;
    ours_ = false;
    blame(FrameFault::packet_broken);
    if (packet_.last()) close_frame();
}

}  // namespace burin
