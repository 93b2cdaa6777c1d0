// SPDX-License-Identifier: MIT
#include "capture/ps_compressed.h"

#include <algorithm>

namespace burin {

void PsCompressed::begin(std::uint16_t* frame, std::size_t count, std::size_t before, std::size_t after,
                         const std::uint16_t* depth, int entries) {
    frame_ = frame;
    count_ = count;
    depth_ = depth;
    entries_ = entries;
    first_ = at_ = std::min(before, count);
    last_ = count - std::min(after, count - at_);
    surplus_ = 0;
    partial_ = 0;
    state_ = State::code;
    std::fill(frame, frame + at_, std::uint16_t{0});
    set(0);
}

void PsCompressed::set(std::uint16_t value) {
    reading_ = value;
    pixel_ = depth_ == nullptr ? value : value < entries_ ? depth_[value] : std::uint16_t{0};
}

void PsCompressed::put(std::size_t times) {
    const std::size_t room = std::min(times, last_ - at_);
    for (std::size_t i = 0; i < room; ++i) frame_[at_ + i] = pixel_;
    at_ += room;
    surplus_ += times - room;
}

void PsCompressed::nibble(unsigned n) {
    // Readings are 16 bits; a difference that leaves them wraps around, as the device's adder does.
    const auto add = [&](int difference) {
        set(static_cast<std::uint16_t>(reading_ + difference));
        put(1);
    };
    switch (state_) {
        case State::code:
            if (n <= 0xc)
                add(static_cast<int>(n) - 6);
            else if (n == 0xe)
                state_ = State::repeat;
            else if (n == 0xf)
                state_ = State::escape;
            break;  // 0xd: nothing, a filler
        case State::repeat:
            put(n + 1);
            state_ = State::code;
            break;
        case State::escape:
            partial_ = static_cast<std::uint16_t>(n & 7);
            state_ = n & 8 ? State::difference : State::value2;
            break;
        case State::difference:
            add((partial_ << 4 | static_cast<int>(n)) - 64);
            state_ = State::code;
            break;
        case State::value2:
        case State::value1:
            partial_ = static_cast<std::uint16_t>(partial_ << 4 | n);
            state_ = state_ == State::value2 ? State::value1 : State::value0;
            break;
        case State::value0:
            set(static_cast<std::uint16_t>(partial_ << 4 | n));
            put(1);
            state_ = State::code;
            break;
    }
}

void PsCompressed::feed(const std::uint8_t* bytes, std::size_t count) {
    if (frame_ == nullptr) return;
    for (std::size_t i = 0; i < count; ++i) {
        nibble(bytes[i] >> 4);
        nibble(bytes[i] & 15u);
    }
}

PsCompressed::Result PsCompressed::end() {
    if (frame_ == nullptr) return {};
    const Result result = {at_ - first_, last_ - at_, surplus_, state_ != State::code};
    std::fill(frame_ + at_, frame_ + count_, std::uint16_t{0});
    frame_ = nullptr;
    return result;
}

}  // namespace burin
