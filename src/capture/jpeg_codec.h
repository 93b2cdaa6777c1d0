// SPDX-License-Identifier: MIT
// Colour images to JPEG and back, by libjpeg(-turbo). The library takes some working memory for each image;
// everything else is allocated once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "capture/frame.h"
#include "core/status.h"

namespace burin {

// A colour image in memory. chroma: the second plane of nv12 and nv21, else null. The sizes are checked by
// the caller: 1..kMaxImageSide each way.
struct ColourRows {
    PixelFormat format = PixelFormat::rgb8;
    int width = 0, height = 0;
    const std::uint8_t* pixels = nullptr;
    std::size_t stride_bytes = 0;
    const std::uint8_t* chroma = nullptr;
    std::size_t chroma_stride_bytes = 0;
};

// Rows packed as RGB; the conversions are those of the map (BT.601, see burin_pixel_format). Of `row` only.
void row_to_rgb(const ColourRows& image, int row, std::uint8_t* rgb);

class JpegEncoder {
  public:
    JpegEncoder();
    ~JpegEncoder();
    JpegEncoder(const JpegEncoder&) = delete;
    JpegEncoder& operator=(const JpegEncoder&) = delete;

    Status reserve(int max_width);
    // grey8 stays grey, everything else becomes colour at 4:2:0, the most common and the fastest to decode.
    // quality: 1..100. Bytes written, 0 when `room` is too small for it or the library refuses.
    std::size_t encode(const ColourRows& image, int quality, std::uint8_t* out, std::size_t room);

  private:
    struct State;
    std::unique_ptr<State> state_;
    std::unique_ptr<std::uint8_t[]> row_;
};

class JpegDecoder {
  public:
    JpegDecoder();
    ~JpegDecoder();
    JpegDecoder(const JpegDecoder&) = delete;
    JpegDecoder& operator=(const JpegDecoder&) = delete;

    // False, with a reason of at most 159 bytes, when the bytes are not one whole image of that size. out:
    // rows of `stride` bytes, channels (1 or 3, RGB) each pixel. The same pixels on every machine: the
    // transform is the exact one.
    bool decode(const std::uint8_t* bytes, std::size_t size, int width, int height, int channels,
                std::uint8_t* out, std::size_t stride, char reason[160]);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace burin
