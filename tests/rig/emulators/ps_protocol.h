// SPDX-License-Identifier: MIT
// What Kinect v1 and PrimeSense's PS1080 have in common, as they hold chips of one family: requests and
// replies on endpoint 0, and frames cut into packets. Sources: libfreenect src/, OpenNI2
// Source/Drivers/PS1080 (README.md has the facts).
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "faults.h"
#include "vusb.h"

namespace rig {

// Constants of a device with which shifts become millimetres. By name: good, zero, nan, negative, huge.
struct PsConstants {
    float emitter_distance = 7.5f;   // emitter to depth sensor, cm
    float colour_distance = 2.3f;    // depth to colour sensor, cm
    float reference_distance = 120;  // zero plane, mm
    float pixel_size = 0.1042f;      // of the reference, mm
    int shift = 200;                 // constant added to shifts
    static PsConstants named(const std::string& name);
    // Of a sensor that sees 640x480 pixels with this focal length: the zero plane's pixels are those of 1280.
    void set_focal_length(double fx) { pixel_size = static_cast<float>(reference_distance / (2 * fx)); }
    void write(std::uint8_t* sixteen_bytes) const;  // the four floats in their order in the fixed parameters
};

// Millimetres of a shift at 640x480, as OpenNI2 computes them, and the shift whose distance is nearest (2047
// for none).
int ps_depth_mm(const PsConstants& c, int shift);
std::vector<std::uint16_t> ps_shift_table(const PsConstants& c);  // by millimetre, 0..10000

// How depth moves onto colour: 29 words of 32 bits, in the order of OpenNI2's XnRegistrationInformation1080
// and libfreenect's freenect_reg_info. Offsets of a few pixels that grow and bend over the image, as real
// ones do.
std::vector<std::uint8_t> ps_registration();

// The control channel. A derived class answers commands; header, tag and the faults of replies are done here.
class PsControl : public UsbDevice {
  public:
    explicit PsControl(Faults& faults) : faults_(faults) {}
    int control(const Setup& setup, std::uint8_t* data) override;

  protected:
    // Arguments are the request's payload. Appends reply data after the error code; returns that code.
    virtual int command(int opcode, const std::uint8_t* arguments, int bytes,
                        std::vector<std::uint8_t>* reply) = 0;
    Faults& faults_;

  private:
    std::vector<std::uint8_t> answer_;
};

// One endpoint's frames: cut into packets of at most `chunk` bytes of data behind a header of twelve.
class PsStream {
  public:
    PsStream(int flag, int chunk) : flag_(flag), chunk_(chunk) {}
    void start();
    void stop() { on_ = false; }
    bool on() const { return on_; }
    std::uint32_t frame() const { return frame_; }

    // paint(frame, out) makes the next frame's bytes. One packet, for an isochronous endpoint, or as much of
    // packets as fits in `size` bytes, for a bulk one. `leads`: tells of the middle of its frames.
    template <class Paint>
    int packet(std::uint8_t* out, int size, int fps, Faults& faults, bool leads, const Paint& paint) {
        if (!on_ || size < chunk_ + kHeader) return kLater;
        if (pos_ == 0) {
            if (now_s() < next_at_) return kLater;
            image_.clear();
            paint(frame_, image_);
            prepare(faults);
        }
        return next_packet(out, fps, faults, leads);
    }
    template <class Paint>
    int bytes(std::uint8_t* out, int size, int fps, Faults& faults, bool leads, const Paint& paint) {
        if (wire_pos_ == wire_.size()) {
            wire_.clear(), wire_pos_ = 0;
            std::vector<std::uint8_t> p(static_cast<std::size_t>(chunk_) + kHeader + 64);
            // A few packets at a time, not the whole frame: it may be unplugged in the middle.
            for (int n = 0; n < 8; ++n) {
                const int k = packet(p.data(), chunk_ + kHeader, fps, faults, leads, paint);
                if (k < 0) break;
                wire_.insert(wire_.end(), p.begin(), p.begin() + k);
                if (pos_ == 0) break;
            }
            if (wire_.empty()) return kLater;
        }
        const std::size_t n = std::min(static_cast<std::size_t>(size), wire_.size() - wire_pos_);
        std::copy_n(wire_.begin() + static_cast<std::ptrdiff_t>(wire_pos_), n, out);
        wire_pos_ += n;
        return static_cast<int>(n);
    }

    // PrimeSense: the time field of a frame's first packet is a number of padding pixels instead, none here.
    bool padding_field = false;
    bool byte_sequence = false;  // Kinect: packet numbers are one byte, in the high half of the field

    static constexpr int kHeader = 12;

  private:
    void prepare(Faults& faults);
    int next_packet(std::uint8_t* out, int fps, Faults& faults, bool leads);

    int flag_, chunk_;
    bool on_ = false, middle_told_ = false;
    std::uint32_t frame_ = 0;
    unsigned number_ = 0;
    double next_at_ = 0;
    std::size_t pos_ = 0, wire_pos_ = 0;
    std::vector<std::uint8_t> image_, wire_;
};

}  // namespace rig
