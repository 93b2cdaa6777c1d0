// SPDX-License-Identifier: MIT
#include "platform/usb/frame_decoder.h"

#include <algorithm>
#include <cstring>

#include "platform/usb/bytes.h"

namespace burin {
namespace {

int packed_bits(WireFormat format) {
    return format == WireFormat::packed10   ? 10
           : format == WireFormat::packed11 ? 11
           : format == WireFormat::packed12 ? 12
                                            : 16;
}

void unpack_bits(const std::uint8_t* in, int bits, int n, std::uint16_t* out) {
    std::uint32_t acc = 0;
    int have = 0;
    for (int i = 0; i < n; ++i) {
        while (have < bits) acc = acc << 8 | *in++, have += 8;
        have -= bits;
        out[i] = static_cast<std::uint16_t>(acc >> have & ((1u << bits) - 1));
    }
}

}  // namespace

WireFormat FrameDecoder::format_of(const RawFrame& frame) const {
    if (!any_ || kind_ != StreamKind::depth) return mode_.format;
    const int pixels = mode_.width * mode_.height - frame.pad_before - frame.pad_after;
    for (const WireFormat f :
         {WireFormat::packed11, WireFormat::packed12, WireFormat::shift16, WireFormat::packed10})
        if (frame.bytes == wire_bytes(f, pixels)) return f;
    return mode_.format;
}

bool FrameDecoder::decode_depth(const RawFrame& frame, std::uint16_t* image) const {
    const int all = mode_.width * mode_.height;
    const int before = frame.pad_before, sent = all - frame.pad_before - frame.pad_after;
    const WireFormat format = format_of(frame);
    int have = sent;
    bool whole = true;
    std::uint16_t* out = image + before;
    if (format == WireFormat::ps_depth) {
        return false;
    } else {
        const int bits = packed_bits(format);
        whole = frame.bytes == wire_bytes(format, sent);
        if (!whole) have = std::min<std::int64_t>(sent, std::int64_t{frame.bytes} * 8 / bits);
        if (format == WireFormat::shift16)
            for (int i = 0; i < have; ++i) out[i] = le16(frame.data + 2 * i);
        else
            unpack_bits(frame.data, bits, have, out);
    }
    for (int i = 0; i < have; ++i) out[i] = table_[std::min<int>(out[i], kShifts - 1)];
    std::fill(image, out, std::uint16_t{0});
    std::fill(out + have, image + all, std::uint16_t{0});
    return whole;
}

bool FrameDecoder::decode_infrared(const RawFrame& frame, std::uint16_t* image) const {
    const int all = mode_.width * mode_.height;
    // With the extra rows or without.
    const bool whole = frame.bytes == wire_bytes(mode_.format, all) ||
                       frame.bytes == wire_bytes(mode_.format, all + 8 * mode_.width);
    const int have = std::min<int>(all, static_cast<int>(std::int64_t{frame.bytes} * 8 / 10));
    unpack_bits(frame.data, 10, have, image);
    std::fill(image + have, image + all, std::uint16_t{0});
    return whole;
}

bool FrameDecoder::decode_colour(const RawFrame&, std::uint8_t*) const { return false; }

bool FrameDecoder::decode(const RawFrame& frame, std::uint8_t* image) const {
    switch (kind_) {
        case StreamKind::depth:
            return decode_depth(frame, reinterpret_cast<std::uint16_t*>(image));
        case StreamKind::colour:
            return decode_colour(frame, image);
        default:
            return decode_infrared(frame, reinterpret_cast<std::uint16_t*>(image));
    }
}

int decode_ps_yuv(const std::uint8_t* data, int bytes, int row_bytes, std::uint8_t* uyvy, int capacity) {
    std::uint8_t last[3] = {};  // U, Y, V
    constexpr int kChannel[4] = {0, 1, 2, 1};
    const auto nibble = [&](std::int64_t at) {
        return at & 1 ? data[at / 2] & 15 : data[at / 2] >> 4;
    };
    const std::int64_t nibbles = std::int64_t{2} * bytes;
    int written = 0, column = 0;
    for (std::int64_t at = 0; at < nibbles && written < capacity;) {
        const int code = nibble(at++);
        if (code == 13 || code == 14) continue;
        std::uint8_t& value = last[kChannel[column & 3]];
        if (code == 15) {
            if (at + 2 > nibbles) break;
            value = static_cast<std::uint8_t>(nibble(at) << 4 | nibble(at + 1));
            at += 2;
        } else {
            value = static_cast<std::uint8_t>(value + code - 6);
        }
        uyvy[written++] = value;
        if (++column == row_bytes) {
            column = 0;
            last[0] = last[1] = last[2] = 0;
        }
    }
    return written;
}

}  // namespace burin
