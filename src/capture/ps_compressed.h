// SPDX-License-Identifier: MIT
// PrimeSense's compressed depth (depth format 1 of the PS1080): differences along the frame as a stream of
// nibbles, high nibble first. docs/capture_pixels.md has the code.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin {

// One frame at a time: begin(), feed() with each packet's payload in order, end(). A code may lie across
// packets. Never writes beyond the frame. No allocation; one thread at a time.
class PsCompressed {
  public:
    // Pixels of the frame go to frame[0..count). `before` and `after` pixels (the two halves of the start
    // packet's time stamp) are 0 without being sent, at the beginning and the end. depth: by reading, null
    // for readings as they are; `entries` as in simd::unpack_table.
    void begin(std::uint16_t* frame, std::size_t count, std::size_t before = 0, std::size_t after = 0,
               const std::uint16_t* depth = nullptr, int entries = 0);
    // May be called with any number of bytes, 0 too.
    void feed(const std::uint8_t* bytes, std::size_t count);

    // What the stream came to.
    struct Result {
        std::size_t pixels;   // decoded, of those that were to come
        std::size_t missing;  // pixels that did not come; they are 0
        std::size_t surplus;  // pixels beyond the frame, thrown away
        bool cut;             // ended inside a code
        bool whole() const { return missing == 0 && surplus == 0 && !cut; }
    };
    // Sets what is missing to 0. Without begin(): nothing, no pixels.
    Result end();

  private:
    enum class State : std::uint8_t { code, repeat, escape, difference, value2, value1, value0 };
    void put(std::size_t times);
    void set(std::uint16_t value);
    void nibble(unsigned n);

    std::uint16_t* frame_ = nullptr;
    const std::uint16_t* depth_ = nullptr;
    int entries_ = 0;
    std::size_t at_ = 0, last_ = 0, count_ = 0, first_ = 0, surplus_ = 0;
    std::uint16_t reading_ = 0, pixel_ = 0, partial_ = 0;
    State state_ = State::code;
};

}  // namespace burin
