// SPDX-License-Identifier: MIT
// From the bytes of a frame to an image: unpacking, shift to depth, colour.
#pragma once

#include <cstdint>
#include <memory>

#include "capture/demosaic.h"
#include "capture/ps_compressed.h"
#include "platform/usb/depth_geometry.h"
#include "platform/usb/frame_assembler.h"
#include "platform/usb/sensor_modes.h"

namespace burin {

class FrameDecoder {
  public:
    // Depth is looked up in `table` (kShifts entries), which must live as long as this. any_depth_format: the
    // size of a frame says its format, whatever was agreed (Astra).
    // False: no memory. Allocates; decode() does not.
    bool reset(StreamKind kind, const SensorMode& mode, const std::uint16_t* table, bool any_depth_format);

    // What colour becomes: RGB of a mosaic, else YUYV, which is the sensor's own bytes.
    static PixelFormat colour_format(WireFormat wire) {
        return wire == WireFormat::bayer || wire == WireFormat::ps_bayer ? PixelFormat::rgb8
                                                                         : PixelFormat::yuyv;
    }

    // Writes the whole image, rows packed: depth u16 in millimetres, infrared u16 (10 bits), colour as
    // colour_format() says. What is missing is 0. False: the frame has not the size that its format demands
    // (the image is written as far as it goes). Never reads beyond frame.bytes + kRawMargin.
    bool decode(const RawFrame& frame, std::uint8_t* image);

    // The format that frame is in.
    WireFormat format_of(const RawFrame& frame) const;

  private:
    bool decode_depth(const RawFrame& frame, std::uint16_t* image);
    bool decode_infrared(const RawFrame& frame, std::uint16_t* image) const;
    bool decode_colour(const RawFrame& frame, std::uint8_t* image);

    StreamKind kind_ = StreamKind::depth;
    SensorMode mode_;
    const std::uint16_t* table_ = nullptr;
    bool any_ = false;
    PsCompressed compressed_;
    std::unique_ptr<Demosaic> demosaic_;
    std::unique_ptr<std::uint8_t[]> plain_;  // of compressed colour
};

// Undoes PrimeSense's compression of colour bytes: rows of nibbles, high one first. 0..C: difference -6..+6
// to the value before in its channel; D: nothing; F and two nibbles: the value. Every row begins at 0.
// Channels: U Y V Y, or of a mosaic every other pixel. (OpenNI2, Uncomp.cpp.) Returns the bytes written, at
// most `capacity`.
enum class PsColour { yuv, mosaic };
int decode_ps_colour(PsColour kind, const std::uint8_t* data, int bytes, int row_bytes, std::uint8_t* out,
                     int capacity);

}  // namespace burin
