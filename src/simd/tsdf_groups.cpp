// SPDX-License-Identifier: MIT
// The specification of observe_groups: one division a group of 32 voxels, the rest in 16 bits.
#include "simd/tsdf_groups.h"

namespace burin::simd {
namespace {

// a b / 2^15, to nearest: one instruction of every vector unit.
inline int scaled(int a, int b) { return (a * b + 16384) >> 15; }
inline int narrow(int v) { return std::clamp(v, -32768, 32767); }
inline int low_16(int v) { return static_cast<std::int16_t>(v); }

// The middle of a group in the image. In steps of a pixel: (u, v) from the corner of the window, half a pixel
// added so that rounding down gives the nearest; what a full across and a full depth add.
struct Middle {
    int u, v, across, shear_u, shear_v;
    const std::uint16_t* corner;  // of the window
    int depth, rest;              // depth in steps, and what it lacks, in half units

    Middle(const DepthProjection& frame, const ProjectedChunk& chunk, const GroupScale& scale, int g) {
        const GroupOffsets& groups = frame.groups;
        const int side = window_side(chunk.pixels);
        const float steps = pixel_steps(chunk.pixels), back = 0.5f * static_cast<float>(side) - 0.5f;
        const float z = chunk.z + groups.middle_z[g], inverse_z = 1.0f / z;
        const float at_u = (chunk.u + groups.middle_u[g]) * inverse_z;
        const float at_v = (chunk.v + groups.middle_v[g]) * inverse_z;
        const int column =
            round_to_int(std::min(std::max(at_u - back, 0.0f), static_cast<float>(frame.width + 2 - side)));
        const int row =
            round_to_int(std::min(std::max(at_v - back, 0.0f), static_cast<float>(frame.height + 2 - side)));
        corner = frame.pixels + row * frame.stride + column;
        u = round_to_int((at_u - static_cast<float>(column) + 0.5f) * steps);
        v = round_to_int((at_v - static_cast<float>(row) + 0.5f) * steps);
        across = low_16(round_to_int(groups.most_across * steps * inverse_z));
        shear_u = low_16(round_to_int((groups.centre_u - at_u) * (groups.most_z * steps) * inverse_z));
        shear_v = low_16(round_to_int((groups.centre_v - at_v) * (groups.most_z * steps) * inverse_z));
        depth = round_to_int(std::min(z * (1.0f / scale.unit), 65535.0f));
        const float lacks =
            (static_cast<float>(depth) * scale.unit - z) * (scale.half_unit * (1.0f / scale.unit));
        rest = round_to_int(std::min(std::max(lacks, -32767.0f), 16000.0f));
    }
};

}  // namespace

bool DepthProjection::allows_groups(float along) const {
    if (weighted() || truncation.quadratic || width < 16 || height < 16 || stride > 4096) return false;
    for (const float a : {1.0f, along}) {
        const float half_unit = unit_m * truncation.units_per_m() * 0.5f * a,
                    slope = groups.most_z * 0.5f * a;
        if (!(half_unit < 16000.0f && slope < 16000.0f)) return false;
        // (16000: rest and slope, each below it, stay within 16 bits together.)
        // A step at the limit must leave the band wherever in the group, 8 for rounding.
        const GroupScale scale(*this, a);
        if (!(static_cast<float>(scale.limit) * half_unit > 16384.0f + slope + half_unit + 8.0f))
            return false;
    }
    return true;
}

namespace scalar {

Observation observe_groups(const DepthProjection& frame, const ProjectedChunk& chunk,
                           std::int16_t* distances) {
    const GroupScale scale(frame, chunk.along);
    const GroupOffsets& groups = frame.groups;
    const int bits = pixel_bits(chunk.pixels);
    Observation seen{false, false};
    for (int g = 0; g < kGroups; ++g) {
        const Middle middle(frame, chunk, scale, g);
        for (int k = 0; k < kGroupVoxels; ++k) {
            const int u =
                middle.u + scaled(groups.across_u[k], middle.across) + scaled(groups.z[k], middle.shear_u);
            const int v =
                middle.v + scaled(groups.across_v[k], middle.across) + scaled(groups.z[k], middle.shear_v);
            const int column = (u & 0xffff) >> bits, row = (v & 0xffff) >> bits;
            const int steps = std::clamp(middle.corner[row * frame.stride + column] - middle.depth,
                                         -scale.limit, scale.limit);
            const int deeper = narrow(scaled(groups.z[k], scale.slope) - middle.rest);
            const int half = narrow(steps * scale.whole + scaled(steps, scale.fraction) - deeper);
            const int distance = narrow(2 * half);
            seen.touched |= distance != kUnseen && distance != kFree;
            seen.free |= distance == kFree;
            const int x = 4 * (g & 1) + (k & 3), y = 4 * (g >> 1 & 1) + (k >> 3),
                      z = 2 * (g >> 2) + (k >> 2 & 1);
            distances[x + 8 * y + 64 * z] = static_cast<std::int16_t>(distance);
        }
    }
    return seen;
}

}  // namespace scalar
}  // namespace burin::simd
