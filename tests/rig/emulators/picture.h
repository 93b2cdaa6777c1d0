// SPDX-License-Identifier: MIT
// Where an emulator's pixels come from: the pattern, or frames that were rendered before (a `burin synth`
// sequence, written by rig_room). Such a file, or block device, is
//
//     one line of text, filled up with zeros to 4096 bytes:  rig FRAMES DEPTH_W DEPTH_H COLOUR_W COLOUR_H FX
//     FY CX CY for each frame: depth, u16 little endian, millimetres, 0 for none; then colour, RGB, 8 bits
//     each
//
// (intrinsics of both, in pixels of depth) and is played from its first frame to its last, which then stays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "../pattern.h"

namespace rig {

class Picture {
  public:
    // Understands --frames FILE, --still N (every frame is frame N of the pattern or file) and --hold N (the
    // first frame comes N times more, for a host that misses the beginning); returns how many arguments were
    // taken at argv[i], 0 for none. What cannot be read ends the program with a line.
    int argument(int argc, char** argv, int i);

    bool open(const char* path);  // false: a line is on stderr

    // The frame to show as the stream's n-th.
    std::uint32_t number(std::uint32_t n) const {
        if (still_ >= 0) return static_cast<std::uint32_t>(still_);
        return n > static_cast<std::uint32_t>(hold_) ? n - static_cast<std::uint32_t>(hold_) : 0;
    }
    bool recorded() const { return data_ != nullptr; }
    int depth_width() const { return depth_w_; }
    int depth_height() const { return depth_h_; }
    int colour_width() const { return colour_w_; }
    int colour_height() const { return colour_h_; }
    int frames() const { return frames_; }
    double fx() const { return k_[0]; }
    double fy() const { return k_[1]; }
    double cx() const { return k_[2]; }
    double cy() const { return k_[3]; }

    // Of a recorded one; outside it 0.
    std::uint16_t depth_mm(std::uint32_t frame, int x, int y) const;
    void rgb(std::uint32_t frame, int x, int y, std::uint8_t out[3]) const;

  private:
    const std::uint8_t* at(std::uint32_t frame) const;
    int still_ = -1, hold_ = 0;
    double k_[4] = {};
    const std::uint8_t* data_ = nullptr;
    int frames_ = 0, depth_w_ = 0, depth_h_ = 0, colour_w_ = 0, colour_h_ = 0;
    std::size_t frame_bytes_ = 0;
};

// Luma and chroma of BT.601 in full range, as UVC cameras send them.
inline std::uint8_t luma(const std::uint8_t c[3]) {
    return static_cast<std::uint8_t>((77 * c[0] + 150 * c[1] + 29 * c[2] + 128) >> 8);
}
inline std::uint8_t chroma_u(const std::uint8_t c[3]) {
    return static_cast<std::uint8_t>((-43 * c[0] - 85 * c[1] + 128 * c[2] + 32768 + 127) >> 8);
}
inline std::uint8_t chroma_v(const std::uint8_t c[3]) {
    return static_cast<std::uint8_t>((128 * c[0] - 107 * c[1] - 21 * c[2] + 32768 + 127) >> 8);
}

}  // namespace rig
