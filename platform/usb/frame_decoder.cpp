// SPDX-License-Identifier: MIT
#include "platform/usb/frame_decoder.h"

#include <algorithm>
#include <new>

#include "simd/targets.h"

namespace burin {
namespace {

// Infrared of the depth camera has up to 8 rows that nobody wants (sensor_stream.cpp).
constexpr int kExtraRows = 8;

simd::Packing packing_of(WireFormat format) {
    switch (format) {
        case WireFormat::packed10:
            return simd::Packing::msb10;
        case WireFormat::packed11:
            return simd::Packing::msb11;
        case WireFormat::packed12:
            return simd::Packing::msb12;
        default:
            return simd::Packing::le16;
    }
}

std::size_t bytes_of(const RawFrame& frame) { return static_cast<std::size_t>(frame.bytes); }

}  // namespace

bool FrameDecoder::reset(StreamKind kind, const SensorMode& mode, const std::uint16_t* table,
                         bool any_depth_format) {
    kind_ = kind, mode_ = mode, table_ = table, any_ = any_depth_format;
    simd::target_name();  // the choice of kernels allocates, once a process: not in the first frame
    if (kind != StreamKind::colour) return true;
    if (colour_format(mode.format) == PixelFormat::rgb8 && !demosaic_) {
        demosaic_.reset(new (std::nothrow) Demosaic);
        if (!demosaic_) return false;
    }
    if (wire_compressed(mode.format) && !plain_) {
        plain_.reset(new (std::nothrow) std::uint8_t[static_cast<std::size_t>(2 * mode.width * mode.height)]);
        if (!plain_) return false;
    }
    return true;
}

WireFormat FrameDecoder::format_of(const RawFrame& frame) const {
    if (!any_ || kind_ != StreamKind::depth) return mode_.format;
    const int pixels = mode_.width * mode_.height - frame.pad_before - frame.pad_after;
    for (const WireFormat f :
         {WireFormat::packed11, WireFormat::packed12, WireFormat::shift16, WireFormat::packed10})
        if (frame.bytes == wire_bytes(f, pixels)) return f;
    return mode_.format;
}

bool FrameDecoder::decode_depth(const RawFrame& frame, std::uint16_t* image) {
    const int all = mode_.width * mode_.height;
    const WireFormat format = format_of(frame);
    if (format == WireFormat::ps_depth) {
        compressed_.begin(image, static_cast<std::size_t>(all), static_cast<std::size_t>(frame.pad_before),
                          static_cast<std::size_t>(frame.pad_after), table_, kShifts);
        compressed_.feed(frame.data, bytes_of(frame));
        return compressed_.end().whole();
    }
    const int sent = all - frame.pad_before - frame.pad_after;
    std::uint16_t* out = image + frame.pad_before;
    const int came =
        simd::unpack_table(packing_of(format), frame.data, bytes_of(frame), sent, table_, kShifts, out);
    std::fill(image, out, std::uint16_t{0});
    std::fill(out + came, image + all, std::uint16_t{0});
    return frame.bytes == wire_bytes(format, sent);
}

bool FrameDecoder::decode_infrared(const RawFrame& frame, std::uint16_t* image) const {
    const int all = mode_.width * mode_.height;
    const int came = simd::unpack(packing_of(mode_.format), frame.data, bytes_of(frame), all, image);
    std::fill(image + came, image + all, std::uint16_t{0});
    return frame.bytes == wire_bytes(mode_.format, all) ||
           frame.bytes == wire_bytes(mode_.format, all + kExtraRows * mode_.width);
}

bool FrameDecoder::decode_colour(const RawFrame& frame, std::uint8_t* image) {
    const bool mosaic = colour_format(mode_.format) == PixelFormat::rgb8;
    const int pixels = mode_.width * mode_.height, row_bytes = mosaic ? mode_.width : 2 * mode_.width;
    const int bytes = row_bytes * mode_.height;
    const std::uint8_t* data = frame.data;
    int have = std::min(frame.bytes, bytes);
    bool whole = frame.bytes == bytes;
    if (wire_compressed(mode_.format)) {
        have = decode_ps_colour(mosaic ? PsColour::mosaic : PsColour::yuv, data, frame.bytes, row_bytes,
                                plain_.get(), bytes);
        whole = have == bytes;
        data = plain_.get();
    }
    if (mosaic) {
        demosaic_->run({BayerOrder::grbg, simd::Packing::u8, 8}, {data, static_cast<std::size_t>(have), 0},
                       View<std::uint8_t>{image, mode_.width, mode_.height, 3 * mode_.width, 3});
        return whole;
    }
    // Nothing there is black: Y 16, chroma 128.
    auto* words = reinterpret_cast<std::uint16_t*>(image);
    const simd::Packing order = mode_.format == WireFormat::yuyv ? simd::Packing::le16 : simd::Packing::be16;
    const int came = simd::unpack(order, data, static_cast<std::size_t>(have), pixels, words);
    for (int i = 2 * came; i < bytes; ++i) image[i] = i % 2 == 0 ? 16 : 128;
    return whole;
}

bool FrameDecoder::decode(const RawFrame& frame, std::uint8_t* image) {
    switch (kind_) {
        case StreamKind::depth:
            return decode_depth(frame, reinterpret_cast<std::uint16_t*>(image));
        case StreamKind::colour:
            return decode_colour(frame, image);
        default:
            return decode_infrared(frame, reinterpret_cast<std::uint16_t*>(image));
    }
}

int decode_ps_colour(PsColour kind, const std::uint8_t* data, int bytes, int row_bytes, std::uint8_t* out,
                     int capacity) {
    constexpr int kYuv[4] = {0, 1, 2, 1}, kMosaic[4] = {0, 1, 0, 1};
    const int* channel = kind == PsColour::yuv ? kYuv : kMosaic;
    std::uint8_t last[3] = {};
    const auto nibble = [&](std::int64_t at) { return at & 1 ? data[at / 2] & 15 : data[at / 2] >> 4; };
    const std::int64_t nibbles = std::int64_t{2} * bytes;
    int written = 0, column = 0;
    for (std::int64_t at = 0; at < nibbles && written < capacity;) {
        const int code = nibble(at++);
        if (code == 13 || code == 14) continue;
        std::uint8_t& value = last[channel[column & 3]];
        if (code == 15) {
            if (at + 2 > nibbles) break;
            value = static_cast<std::uint8_t>(nibble(at) << 4 | nibble(at + 1));
            at += 2;
        } else {
            value = static_cast<std::uint8_t>(value + code - 6);
        }
        out[written++] = value;
        if (++column == row_bytes) {
            column = 0;
            last[0] = last[1] = last[2] = 0;
        }
    }
    return written;
}

}  // namespace burin
