// SPDX-License-Identifier: MIT
// Images of a recording to bytes and back. Working memory is taken by reserve(); one thread at a time.
#pragma once

#include "capture/depth_codec.h"
#include "capture/jpeg_codec.h"
#include "capture/recording_format.h"

namespace burin {

// How colour is recorded. Depth, infrared and confidence are always lossless.
enum class RecordedColour : std::uint8_t { jpeg, lossless, raw };

// The second plane of a packed image of nv12 or nv21: rows of this many bytes, behind the first.
inline constexpr std::size_t chroma_row_bytes(int width) {
    return static_cast<std::size_t>((width + 1) / 2) * 2;
}
inline bool has_chroma_plane(const StreamInfo& s) {
    return s.pixels == StreamPixels::colour &&
           (s.colour_format == PixelFormat::nv12 || s.colour_format == PixelFormat::nv21);
}
ColourRows packed_colour(const StreamInfo& stream, const std::uint8_t* image);

class ImageEncoder {
  public:
    Status reserve(const DeviceInfo& info, RecordedColour colour, int jpeg_quality);
    // The most bytes of any coded image.
    std::size_t bound() const { return bound_; }
    // A packed image (StreamInfo::image_bytes) to `out`; returns the bytes, *codec and *parameter say how.
    // What a codec does not make smaller is written raw.
    std::size_t encode(const StreamInfo& stream, const std::uint8_t* image, std::uint8_t* out,
                       ImageCodec* codec, std::uint32_t* parameter);

  private:
    RecordedColour colour_ = RecordedColour::jpeg;
    int quality_ = 0;
    std::size_t bound_ = 0;
    PixelEncoder pixels_;
    JpegEncoder jpeg_;
};

class ImageDecoder {
  public:
    Status reserve(const DeviceInfo& info);
    // To a packed image of the stream; of jpeg RGB, or grey where the stream is grey: see decoded_stream.
    // Error (format): the bytes are no such image; `where` begins the message. *out may then hold anything.
    Status decode(const StreamInfo& stream, const RecordHead& head, const std::uint8_t* coded,
                  std::size_t bytes, const char* where, std::uint8_t* out);

  private:
    PixelDecoder pixels_;
    JpegDecoder jpeg_;
};

// The stream as images of this codec come out of the decoder: the same, but jpeg makes RGB of what is not
// grey.
StreamInfo decoded_stream(const StreamInfo& stream, ImageCodec codec);

}  // namespace burin
