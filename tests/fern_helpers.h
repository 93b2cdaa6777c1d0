// SPDX-License-Identifier: MIT
// Keyframes in their own memory, and images to tell places apart without rendering any.
#pragma once

#include <vector>

#include "scene_helpers.h"
#include "track/ferns.h"

namespace burin {

class TestFerns {
  public:
    explicit TestFerns(const FernOptions& options = {}) {
        Arena measure;
        FernKeyframes().place(measure, options);
        memory_ = aligned_memory(measure.used());
        Arena arena(memory_.get(), measure.used());
        keyframes.place(arena, options);
        bytes = measure.used();
    }
    FernKeyframes keyframes;
    std::size_t bytes = 0;

  private:
    Memory memory_;
};

// Place `place` with `changed` of its cells as if seen anew.
inline Thumbnail stamp(std::uint64_t place, int changed = 0, std::uint64_t seed = 0, bool colour = true) {
    Thumbnail t = {};
    t.has_colour = colour;
    Rng rng(place), again(seed * 1000 + 77);
    const auto fill = [&](int cell, Rng& from) {
        t.depth_mm[cell] = static_cast<std::uint16_t>(300 + from.below(3600));
        for (int c = 0; c < 3; ++c) {
            const int value = 20 + from.below(200);
            if (colour) t.rgb[3 * cell + c] = static_cast<std::uint8_t>(value);
        }
    };
    for (int cell = 0; cell < Thumbnail::kCells; ++cell) fill(cell, rng);
    for (int k = 0; k < changed; ++k) fill(again.below(Thumbnail::kCells), again);
    return t;
}

inline double degrees_between(const Se3& a, const Se3& b) {
    double trace = 0;
    for (int i = 0; i < 9; ++i) trace += a.R.m[i] * b.R.m[i];
    return std::acos(std::fmin(1.0, std::fmax(-1.0, (trace - 1) / 2))) * 57.29577951308232;
}

inline std::vector<FernMatch> matches(const FernKeyframes& keyframes, const FernCode& code, int count) {
    std::vector<FernMatch> out(static_cast<std::size_t>(count));
    out.resize(static_cast<std::size_t>(keyframes.nearest(code, out.data(), count)));
    return out;
}

}  // namespace burin
