// SPDX-License-Identifier: MIT
#include "tracking/disturb.h"

#include <algorithm>
#include <cstdint>

namespace burin::bench {
namespace {

constexpr double kHandM = 0.3;           // an arm's bend away, and within the range that is fused
constexpr double kHandWidth = 0.8;       // of the image, from the left
constexpr std::uint8_t kSkin = 120;      // one brightness all over: nothing to hold on to
constexpr std::uint64_t kOne = 1000000;  // shares are counted in millionths

// The finaliser of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014): every bit of x reaches all of the result.
std::uint64_t mixed(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

template <class T>
void drop(std::vector<T>& pixels, int index, double share) {
    const auto limit = static_cast<std::uint64_t>(share * static_cast<double>(kOne));
    for (std::size_t i = 0; i < pixels.size(); ++i)
        if (mixed((static_cast<std::uint64_t>(index) << 32) + i + 1) % kOne < limit) pixels[i] = 0;
}

// `value` into the left columns of every row; a pixel has `channels` values.
template <class T>
void cover(std::vector<T>& pixels, int width, int channels, T value) {
    const std::size_t row = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels);
    const std::size_t covered =
        static_cast<std::size_t>(kHandWidth * width) * static_cast<std::size_t>(channels);
    for (std::size_t at = 0; row > 0 && at + row <= pixels.size(); at += row)
        std::fill_n(pixels.begin() + static_cast<std::ptrdiff_t>(at), covered, value);
}

}  // namespace

Span Disturbance::span() const {
    if (dropout > 0 || skip > 1) return {0, 1 << 30};
    if (blank.empty()) return hand;
    if (hand.empty()) return blank;
    return {std::min(blank.first, hand.first), std::max(blank.last, hand.last)};
}

void disturb(const Disturbance& d, int index, Frame* frame) {
    if (d.dropout > 0) {
        drop(frame->depth_u16.pixels, index, d.dropout);
        drop(frame->depth_f32.pixels, index, d.dropout);
    }
    if (d.hand.has(index)) {
        const double value = kHandM / frame->depth_unit_m;
        cover(frame->depth_u16.pixels, frame->depth_u16.width, 1, static_cast<std::uint16_t>(value + 0.5));
        cover(frame->depth_f32.pixels, frame->depth_f32.width, 1, static_cast<float>(value));
        cover(frame->colour.pixels, frame->colour.width, 3, kSkin);
    }
    if (d.blank.has(index)) {
        std::fill(frame->depth_u16.pixels.begin(), frame->depth_u16.pixels.end(), std::uint16_t{0});
        std::fill(frame->depth_f32.pixels.begin(), frame->depth_f32.pixels.end(), 0.0f);
        frame->colour = {};
    }
}

}  // namespace burin::bench
