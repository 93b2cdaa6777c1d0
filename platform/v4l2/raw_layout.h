// SPDX-License-Identifier: MIT
// How the words of a time-of-flight board become depth, declared by the user, since no such board tells:
//     --layout "images=3 take=0 mask=0x0fff scale=0.25 offset=0 none=4095 unit=0.001"
// images: the frame is that many images one below the other (depth, brightness, confidence; ADSD3500), of
// equal height; take: which of them is depth, from 0; brightness: which is infrared (left out: none); depth
// in steps of `unit` metres = (word & mask) * scale + offset, but none where word & mask is `none`;
// confidence: which is confidence, 255 where its word is `certain` or more, in proportion below.
#pragma once

#include <cstdint>

#include "core/status.h"
#include "simd/split.h"

namespace burin {

struct RawLayout {
    int images = 1, take = 0, brightness = -1, confidence = -1;
    int certain = 255;
    simd::Affine affine;
    double unit_m = 0.001;
};

// Error (invalid_argument): a word that is none of these, a value out of range.
Status parse_raw_layout(const char* text, RawLayout* layout);

}  // namespace burin
