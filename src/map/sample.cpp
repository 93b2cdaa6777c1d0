// SPDX-License-Identifier: MIT
#include "map/sample.h"

namespace burin {

std::uint32_t Sampler::chunk_of(Vec3i voxel) {
    const ChunkKey key = pack_key({voxel.x >> 3, voxel.y >> 3, voxel.z >> 3});
    if (key != last_key_) {
        last_key_ = key;
        last_slot_ = volume_.find(key);
    }
    return last_slot_;
}

bool Sampler::corners(Vec3i low, float d[8]) {
    if ((low.x & 7) != 7 && (low.y & 7) != 7 && (low.z & 7) != 7) {  // two of three cells: all in one chunk
        const std::uint32_t slot = chunk_of(low);
        if (slot == kNoChunk) return false;
        const ChunkGeometry& g = volume_.geometry(slot);
        const int index = voxel_index(low);
        bool known = true;
        for (int i = 0; i < 8; ++i) {
            const int at = index + (i & 1) + (i >> 1 & 1) * 8 + (i >> 2) * 64;
            known &= g.weight[at] != 0;
            d[i] = g.sdf[at];
        }
        return known;
    }
    for (int i = 0; i < 8; ++i) {
        const Vec3i v = {low.x + (i & 1), low.y + (i >> 1 & 1), low.z + (i >> 2)};
        const std::uint32_t slot = chunk_of(v);
        if (slot == kNoChunk) return false;
        const ChunkGeometry& g = volume_.geometry(slot);
        const int index = voxel_index(v);
        if (g.weight[index] == 0) return false;
        d[i] = g.sdf[index];
    }
    return true;
}

bool Sampler::interpolate(Vec3d p, float* out, Vec3f* gradient) {
    Vec3i low;
    float f[3], d[8];
    if (!cell_of(p, inverse_voxel_, &low, f) || !corners(low, d)) return false;
    const simd::Trilinear at = simd::trilinear(d, f[0], f[1], f[2]);
    *out = scale_.distance * at.value;
    if (gradient)
        for (int k = 0; k < 3; ++k) (*gradient)[k] = scale_.gradient * at.gradient[k];
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
