// SPDX-License-Identifier: MIT
#include "map/sample.h"

#include <cmath>

namespace burin {
namespace {

// Lowest voxel of the cell around p, and where in the cell p lies. False when p is outside what keys can
// tell.
bool cell_of(Vec3d p, double inverse_voxel, Vec3i* low, float fraction[3]) {
    for (int r = 0; r < 3; ++r) {
        const double x = p[r] * inverse_voxel - 0.5, floor = std::floor(x);
        if (!(std::fabs(x) < (kChunkLimit - 2.0) * kChunkSide)) return false;
        (*low)[r] = static_cast<std::int32_t>(floor);
        fraction[r] = static_cast<float>(x - floor);
    }
    return true;
}

int voxel_index(Vec3i v) { return (v.z & 7) << 6 | (v.y & 7) << 3 | (v.x & 7); }

}  // namespace

std::uint32_t Sampler::chunk_of(Vec3i voxel) {
    const ChunkKey key = pack_key({voxel.x >> 3, voxel.y >> 3, voxel.z >> 3});
    if (key != last_key_) {
        last_key_ = key;
        last_slot_ = volume_.find(key);
    }
    return last_slot_;
}

bool Sampler::interpolate(Vec3d p, float* out, Vec3f* gradient) {
    Vec3i low;
    float f[3];
    if (!cell_of(p, inverse_voxel_, &low, f)) return false;
    float d[8];
    for (int i = 0; i < 8; ++i) {
        const Vec3i v = {low.x + (i & 1), low.y + (i >> 1 & 1), low.z + (i >> 2)};
        const std::uint32_t slot = chunk_of(v);
        if (slot == kNoChunk) return false;
        const ChunkGeometry& g = volume_.geometry(slot);
        const int index = voxel_index(v);
        if (g.weight[index] == 0) return false;
        d[i] = g.sdf[index];
    }
    const float scale = volume_.units_to_m();
    const auto lerp = [](float a, float b, float t) { return a + t * (b - a); };
    const float y0 = lerp(lerp(d[0], d[1], f[0]), lerp(d[2], d[3], f[0]), f[1]);
    const float y1 = lerp(lerp(d[4], d[5], f[0]), lerp(d[6], d[7], f[0]), f[1]);
    *out = scale * lerp(y0, y1, f[2]);
    if (gradient) {
        const float k = scale * static_cast<float>(inverse_voxel_);
        gradient->x =
            k * lerp(lerp(d[1] - d[0], d[3] - d[2], f[1]), lerp(d[5] - d[4], d[7] - d[6], f[1]), f[2]);
        gradient->y =
            k * lerp(lerp(d[2] - d[0], d[3] - d[1], f[0]), lerp(d[6] - d[4], d[7] - d[5], f[0]), f[2]);
        gradient->z = k * (y1 - y0);
    }
    return true;
}

bool Sampler::nearest(Vec3d p, float* out, bool* in_chunk) {
    Vec3i low;
    float f[3];
    *in_chunk = false;
    if (!cell_of(p, inverse_voxel_, &low, f)) return false;
    const Vec3i v = {low.x + (f[0] >= 0.5f), low.y + (f[1] >= 0.5f), low.z + (f[2] >= 0.5f)};
    const std::uint32_t slot = chunk_of(v);
    if (slot == kNoChunk) return false;
    *in_chunk = true;
    const ChunkGeometry& g = volume_.geometry(slot);
    if (g.weight[voxel_index(v)] == 0) return false;
    *out = volume_.units_to_m() * g.sdf[voxel_index(v)];
    return true;
}

bool Sampler::colour(Vec3d p, float rgb[3]) {
    Vec3i low;
    float f[3];
    if (!volume_.has_colour() || !cell_of(p, inverse_voxel_, &low, f)) return false;
    float sum[3] = {}, total = 0;
    for (int i = 0; i < 8; ++i) {
        const Vec3i v = {low.x + (i & 1), low.y + (i >> 1 & 1), low.z + (i >> 2)};
        const std::uint32_t slot = chunk_of(v);
        if (slot == kNoChunk) continue;
        const std::uint8_t* c = volume_.colour(slot).rgbn[voxel_index(v)];
        if (c[3] == 0) continue;
        const float w = (i & 1 ? f[0] : 1 - f[0]) * (i & 2 ? f[1] : 1 - f[1]) * (i & 4 ? f[2] : 1 - f[2]);
        for (int k = 0; k < 3; ++k) sum[k] += w * c[k];
        total += w;
    }
    if (total <= 0) return false;
    for (int k = 0; k < 3; ++k) rgb[k] = sum[k] / total;
    return true;
}

}  // namespace burin
