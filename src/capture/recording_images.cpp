// SPDX-License-Identifier: MIT
#include "capture/recording_images.h"

#include <algorithm>
#include <cstring>

namespace burin {
namespace {

// From a byte to the one of the same channel: the pixel before, of yuyv the pair before.
std::uint32_t step_of(const StreamInfo& s) {
    if (s.pixels != StreamPixels::colour) return 1;
    switch (s.colour_format) {
        case PixelFormat::rgb8:
        case PixelFormat::bgr8:
            return 3;
        case PixelFormat::rgba8:
        case PixelFormat::bgra8:
        case PixelFormat::yuyv:
            return 4;
        default:
            return 1;
    }
}

// Room for a jpeg beside the size of its raw image: its tables are some 600 bytes. One that is larger still
// (of noise, at quality 100) is written without loss.
constexpr std::size_t kJpegTables = 4096;

}  // namespace

ColourRows packed_colour(const StreamInfo& s, const std::uint8_t* image) {
    ColourRows rows = {s.colour_format, s.width, s.height, image, s.row_bytes, nullptr, 0};
    if (has_chroma_plane(s)) {
        rows.chroma = image + s.row_bytes * static_cast<std::size_t>(s.height);
        rows.chroma_stride_bytes = chroma_row_bytes(s.width);
    }
    return rows;
}

StreamInfo decoded_stream(const StreamInfo& stream, ImageCodec codec) {
    StreamInfo s = stream;
    if (codec != ImageCodec::jpeg || s.colour_format == PixelFormat::grey8) return s;
    s.colour_format = PixelFormat::rgb8;
    set_image_bytes(&s);
    return s;
}

Status ImageEncoder::reserve(const DeviceInfo& info, RecordedColour colour, int jpeg_quality) {
    colour_ = colour;
    quality_ = jpeg_quality;
    std::size_t pixels = 0, bytes = 0;
    for (const StreamInfo& s : info.streams) {
        if (s.width <= 0) continue;
        if (s.pixels == StreamPixels::u16) pixels = std::max(pixels, s.image_bytes / 2);
        bytes = std::max(bytes, s.image_bytes);
    }
    BURIN_TRY(pixels_.reserve(pixels, bytes));
    bound_ = std::max(pixels_.bound(), bytes + kJpegTables);
    if (colour != RecordedColour::jpeg || !info.has(StreamKind::colour)) return {};
    return jpeg_.reserve(info.at(StreamKind::colour).width);
}

std::size_t ImageEncoder::encode(const StreamInfo& s, const std::uint8_t* image, std::uint8_t* out,
                                 ImageCodec* codec, std::uint32_t* parameter) {
    std::size_t bytes = 0;
    *parameter = 0;
    if (s.pixels == StreamPixels::u16) {
        *codec = ImageCodec::depth;
        bytes = pixels_.encode_depth(image, s.row_bytes, s.width, s.height, out);
    } else if (s.pixels == StreamPixels::colour && colour_ == RecordedColour::jpeg) {
        *codec = ImageCodec::jpeg;
        bytes = jpeg_.encode(packed_colour(s, image), quality_, out, s.image_bytes + kJpegTables);
        if (bytes > 0) return bytes;
    }
    if (bytes == 0 && (s.pixels != StreamPixels::colour || colour_ != RecordedColour::raw)) {
        *codec = ImageCodec::bytes;
        *parameter = step_of(s);
        bytes = pixels_.encode_bytes(image, s.image_bytes, *parameter, out);
    }
    if (bytes > 0 && bytes < s.image_bytes) return bytes;
    *codec = ImageCodec::raw;
    *parameter = 0;
    std::memcpy(out, image, s.image_bytes);
    return s.image_bytes;
}

Status ImageDecoder::reserve(const DeviceInfo& info) {
    std::size_t pixels = 0, bytes = 0;
    for (const StreamInfo& s : info.streams) {
        if (s.width <= 0) continue;
        if (s.pixels == StreamPixels::u16) pixels = std::max(pixels, s.image_bytes / 2);
        bytes = std::max(bytes, s.image_bytes);
    }
    return pixels_.reserve(pixels, bytes);
}

Status ImageDecoder::decode(const StreamInfo& s, const RecordHead& head, const std::uint8_t* coded,
                            std::size_t bytes, const char* where, std::uint8_t* out) {
    char text[160] = "";
    const char* reason = text;
    bool ok = false;
    switch (head.codec) {
        case ImageCodec::raw:
            ok = bytes == s.image_bytes;
            if (ok)
                std::memcpy(out, coded, bytes);
            else
                std::snprintf(text, sizeof text, "it has %zu bytes, expected %zu", bytes, s.image_bytes);
            break;
        case ImageCodec::depth:
            reason = "codec 1 is for 16 bits a pixel";
            ok = s.pixels == StreamPixels::u16 &&
                 pixels_.decode_depth(coded, bytes, s.image_bytes / 2,
                                      static_cast<std::uint16_t*>(static_cast<void*>(out)), &reason);
            break;
        case ImageCodec::bytes:
            ok = pixels_.decode_bytes(coded, bytes, s.image_bytes, head.parameter, out, &reason);
            break;
        case ImageCodec::jpeg: {
            reason = "codec 3 is for colour";
            if (s.pixels != StreamPixels::colour) break;
            reason = text;
            const StreamInfo made = decoded_stream(s, ImageCodec::jpeg);
            ok = jpeg_.decode(coded, bytes, s.width, s.height,
                              made.colour_format == PixelFormat::grey8 ? 1 : 3, out, made.row_bytes, text);
            break;
        }
        default:
            std::snprintf(text, sizeof text, "its codec is %d, expected 0..3", static_cast<int>(head.codec));
    }
    if (ok) return {};
    return Status::error(Code::format, "%s: %s image %llu cannot be decoded: %s", where, stream_name(s.kind),
                         static_cast<unsigned long long>(head.sequence), reason);
}

}  // namespace burin
