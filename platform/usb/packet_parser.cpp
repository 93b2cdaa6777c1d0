// SPDX-License-Identifier: MIT
#include "platform/usb/packet_parser.h"

#include <algorithm>
#include <cstring>

#include "platform/usb/bytes.h"

namespace burin {
namespace {

constexpr std::uint8_t kMagic[2] = {0x52, 0x42};  // "RB"
// Devices send 1760 to 3072 bytes a packet. A greater one is no header but image data that looks like one,
// and following it would swallow a tenth of a frame.
constexpr int kMaxPacketBytes = 16384;

// Of image data, one in 2^40 would pass.
bool looks_like_header(const std::uint8_t* data, int length) {
    if (length < kPacketHeaderBytes || data[0] != kMagic[0] || data[1] != kMagic[1] || data[2] != 0)
        return false;
    const int place = data[3] & 0xf, stream = data[3] & 0xf0, size = be16(data + 6);
    return (stream == 0x70 || stream == 0x80) && (place == 1 || place == 2 || place == 5) &&
           size >= kPacketHeaderBytes && size <= kMaxPacketBytes;
}

}  // namespace

void PacketParser::whole_packet(const std::uint8_t* data, int length) {
    if (length < kPacketHeaderBytes || data[0] != kMagic[0] || data[1] != kMagic[1]) {
        sink_->garbage(length);
        return;
    }
    sink_->packet_begin({data[3], data[5], length - kPacketHeaderBytes, le32(data + 8)});
    if (length > kPacketHeaderBytes)
        sink_->packet_data(data + kPacketHeaderBytes, length - kPacketHeaderBytes);
    sink_->packet_end();
}

// Skips what is before the next magic; returns the bytes used.
int PacketParser::search(const std::uint8_t* data, int length) {
    if (have_ == 1) {
        if (data[0] == kMagic[1]) {
            header_[1] = kMagic[1];
            have_ = 2;
            return 1;
        }
        have_ = 0;
        sink_->garbage(1);
        return 0;
    }
    const auto* at =
        static_cast<const std::uint8_t*>(std::memchr(data, kMagic[0], static_cast<std::size_t>(length)));
    const int skipped = at ? static_cast<int>(at - data) : length;
    if (skipped > 0) sink_->garbage(skipped);
    if (!at) return length;
    header_[0] = kMagic[0];
    have_ = 1;
    return skipped + 1;
}

// True: the header holds; a packet is under way.
bool PacketParser::begin() {
    const int size = be16(header_ + 6);
    if (header_[2] != 0 || size < kPacketHeaderBytes || size > kMaxPacketBytes) return false;
    left_ = size - kPacketHeaderBytes;
    sink_->packet_begin({header_[3], le16(header_ + 4), left_, le32(header_ + 8)});
    if (left_ == 0) {
        sink_->packet_end();
        have_ = 0;
    }
    return true;
}

int PacketParser::header(const std::uint8_t* data, int length) {
    const int used = std::min(length, kPacketHeaderBytes - have_);
    std::memcpy(header_ + have_, data, static_cast<std::size_t>(used));
    have_ += used;
    if (have_ < kPacketHeaderBytes || begin()) return used;
    // No header after all: its first two bytes go, the rest is looked at again.
    std::uint8_t again[kPacketHeaderBytes - 2];
    std::memcpy(again, header_ + 2, sizeof again);
    have_ = 0;
    sink_->garbage(2);
    // Each turn drops at least two of the bytes that were kept, so this ends.
    for (int at = 0; at < static_cast<int>(sizeof again);) {
        const int left = static_cast<int>(sizeof again) - at;
        if (have_ < 2) {
            at += search(again + at, left);
        } else {
            std::memcpy(header_ + have_, again + at, static_cast<std::size_t>(left));
            have_ += left;
            at += left;
        }
    }
    return used;
}

void PacketParser::bytes(const std::uint8_t* data, int length) {
    if (framing_ == PacketFraming::whole) return whole_packet(data, length);
    if (framing_ == PacketFraming::datagrams && have_ > 0 && looks_like_header(data, length)) lost();
    while (length > 0) {
        int used;
        if (have_ < 2) {
            used = search(data, length);
        } else if (have_ < kPacketHeaderBytes) {
            used = header(data, length);
        } else {
            used = std::min(length, left_);
            sink_->packet_data(data, used);
            left_ -= used;
            if (left_ == 0) {
                sink_->packet_end();
                have_ = 0;
            }
        }
        data += used;
        length -= used;
    }
}

void PacketParser::lost() {
    if (have_ == kPacketHeaderBytes) sink_->packet_broken();
    have_ = left_ = 0;
}

}  // namespace burin
