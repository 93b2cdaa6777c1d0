// SPDX-License-Identifier: MIT
// Lossless coding of images of 16 bits, with zstd behind a model of what depth sensors deliver: many pixels
// without a reading, and few distinct values (structured light measures disparity in eighths of a pixel, so
// that a frame of a room has some hundred different depths and steps of 30 mm at 3 m).
//
// The image as a list: a mask of the pixels that are not 0; the distinct values among those; of each such
// pixel the place of its value in that list, as the difference to the one before in raster order. What zstd
// gets, in this order:
//     u32 distinct, u32 valid
//     u16 rise[distinct]           each value less the one before, the first less 0
//     u8  mask[(pixels + 7) / 8]   pixel i is bit i % 8 of byte i / 8; 1: not 0
//     u8  low[valid], high[valid]  the bytes of zigzag(difference of places mod 2^16), the first less 0
// with zigzag(d) = 2 d for d >= 0, else -2 d - 1.
//
// Measured (640x480, one core of an EPYC, zstd level 1): docs/recording.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "core/status.h"

struct ZSTD_CCtx_s;
struct ZSTD_DCtx_s;

namespace burin {

// Working memory for images up to a size; nothing is allocated after reserve(). One thread at a time.
class PixelEncoder {
  public:
    PixelEncoder() = default;
    ~PixelEncoder();
    PixelEncoder(const PixelEncoder&) = delete;
    PixelEncoder& operator=(const PixelEncoder&) = delete;

    // max_pixels of 16 bits, max_bytes for encode_bytes. Error: insufficient_memory.
    Status reserve(std::size_t max_pixels, std::size_t max_bytes);
    // The most that encode_* can need for `out`.
    std::size_t bound() const { return bound_; }

    // Bytes written to out (bound() of room), 0 when the coder failed. Rows of stride bytes.
    std::size_t encode_depth(const std::uint8_t* rows, std::size_t stride, int width, int height,
                             std::uint8_t* out);
    // Differences to the byte `step` before, the first ones as they are.
    std::size_t encode_bytes(const std::uint8_t* bytes, std::size_t count, std::size_t step,
                             std::uint8_t* out);

  private:
    std::size_t compress(std::size_t bytes, std::uint8_t* out);

    ZSTD_CCtx_s* context_ = nullptr;  // in the workspace
    std::unique_ptr<std::uint8_t[]> workspace_;
    std::unique_ptr<std::uint8_t[]> plain_;    // what zstd gets
    std::unique_ptr<std::uint16_t[]> values_;  // of the valid pixels
    std::unique_ptr<std::uint16_t[]> rank_;    // 65536
    std::unique_ptr<std::uint8_t[]> seen_;     // 65536
    std::size_t plain_bytes_ = 0, bound_ = 0;
};

class PixelDecoder {
  public:
    PixelDecoder() = default;
    ~PixelDecoder();
    PixelDecoder(const PixelDecoder&) = delete;
    PixelDecoder& operator=(const PixelDecoder&) = delete;

    Status reserve(std::size_t max_pixels, std::size_t max_bytes);
    // False with a reason when the bytes are no image of that size; `out` then holds anything. `out`: width *
    // height values, packed.
    bool decode_depth(const std::uint8_t* coded, std::size_t bytes, std::size_t pixels, std::uint16_t* out,
                      const char** reason);
    bool decode_bytes(const std::uint8_t* coded, std::size_t bytes, std::size_t count, std::size_t step,
                      std::uint8_t* out, const char** reason);

  private:
    // The plain bytes, expected between least and most.
    bool decompress(const std::uint8_t* coded, std::size_t bytes, std::uint8_t* out, std::size_t least,
                    std::size_t most, std::size_t* got, const char** reason);

    ZSTD_DCtx_s* context_ = nullptr;
    std::unique_ptr<std::uint8_t[]> plain_;
    std::unique_ptr<std::uint16_t[]> value_;  // 65536, by place
    std::size_t plain_bytes_ = 0;
};

}  // namespace burin
