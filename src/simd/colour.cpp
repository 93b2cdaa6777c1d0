// SPDX-License-Identifier: MIT
// The specification of the kernels of colour.
#include "simd/colour.h"

#include <algorithm>

namespace burin::simd {

namespace scalar {

int select_voxels(const std::int16_t* distances, std::int16_t band, const std::uint8_t*,
                  std::uint16_t* list) {
    int count = 0;
    for (int i = 0; i < kChunkVoxels; ++i)
        if (distances[i] >= -band && distances[i] <= band) list[count++] = static_cast<std::uint16_t>(i);
    for (int i = count; i % 16 != 0; ++i) list[i] = list[count - 1];
    return count;
}

void find_pixels(const std::uint16_t* list, int count, const ColourFrame& frame, ProjectiveBase base,
                 std::int32_t* offsets) {
    const std::int32_t last =
        static_cast<std::int32_t>((frame.height - 1) * frame.stride + 3 * frame.width - 4);
    for (int k = 0; k < ((count + 15) & ~15); ++k) {
        const int i = list[k];
        offsets[k] = -1;
        const float at_x = static_cast<float>(i & 7), at_y = static_cast<float>(i >> 3 & 7),
                    at_z = static_cast<float>(i >> 6);
        const auto sum = [&](const float step[3], float start) {
            return ((at_x * step[0] + at_y * step[1]) + at_z * step[2]) + start;
        };
        const float z = sum(frame.step_z, base.z);
        const float inverse_z = 1.0f / std::max(z, kLeastZ);
        float u = sum(frame.step_u, base.u) * inverse_z, v = sum(frame.step_v, base.v) * inverse_z;
        if (frame.distorted) {
            const float x = (u - frame.cx) / frame.fx, y = (v - frame.cy) / frame.fy, xx = x * x, yy = y * y;
            const float r2 = xx + yy, two_xy = 2.0f * (x * y);
            const float radial = 1.0f + r2 * (frame.k1 + r2 * (frame.k2 + r2 * frame.k3));
            u = frame.fx * (x * radial + (frame.p1 * two_xy + frame.p2 * (r2 + 2.0f * xx))) + frame.cx;
            v = frame.fy * (y * radial + (frame.p1 * (r2 + 2.0f * yy) + frame.p2 * two_xy)) + frame.cy;
        }
        u += 0.5f;
        v += 0.5f;
        if (!(z > kLeastZ && u >= 0.0f && v >= 0.0f && u < static_cast<float>(frame.width) &&
              v < static_cast<float>(frame.height)))
            continue;
        const std::int32_t offset =
            static_cast<int>(v) * static_cast<std::int32_t>(frame.stride) + 3 * static_cast<int>(u);
        if (offset <= last) offsets[k] = offset;
    }
}

int fuse_colours(const std::uint16_t* list, int count, const ColourFrame& frame, const std::int32_t* offsets,
                 std::uint8_t* colours) {
    int most = 0;
    for (int k = 0; k < count; ++k) {
        const int i = list[k];
        if (offsets[k] < 0) continue;
        const std::uint8_t* reading = frame.rgb + offsets[k];
        std::uint8_t* colour = colours + 4 * i;
        const int readings = colour[3];
        // Threshold in 0..255: an odd multiplier walks through all residues over voxels and over frames.
        const int threshold =
            static_cast<int>((static_cast<std::uint32_t>(i) * 167u + frame.number * 101u) & 255u);
        const float scale = 256.0f / static_cast<float>(readings + 1);
        for (int c = 0; c < 3; ++c) {
            const int scaled =
                static_cast<int>(static_cast<float>(colour[c] * readings + reading[c]) * scale);
            colour[c] = static_cast<std::uint8_t>(std::min((scaled + threshold) >> 8, 255));
        }
        colour[3] = static_cast<std::uint8_t>(std::min(readings + 1, kColourMemory));
        most = std::max<int>(most, colour[3]);
    }
    return most;
}

}  // namespace scalar

#if defined(BURIN_SCALAR_ONLY)
int select_voxels(const std::int16_t* distances, std::int16_t band, const std::uint8_t* colours,
                  std::uint16_t* list) {
    return scalar::select_voxels(distances, band, colours, list);
}
void find_pixels(const std::uint16_t* list, int count, const ColourFrame& frame, ProjectiveBase base,
                 std::int32_t* offsets) {
    scalar::find_pixels(list, count, frame, base, offsets);
}
int fuse_colours(const std::uint16_t* list, int count, const ColourFrame& frame, const std::int32_t* offsets,
                 std::uint8_t* colours) {
    return scalar::fuse_colours(list, count, frame, offsets, colours);
}
#endif

}  // namespace burin::simd
