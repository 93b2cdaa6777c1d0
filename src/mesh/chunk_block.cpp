// SPDX-License-Identifier: MIT
#include "mesh/chunk_block.h"

#include <algorithm>

#include "simd/tsdf.h"

namespace burin {
ChunkBlock::ChunkBlock(const SurfaceField& field, const Neighbourhood& neighbours, int z_first, int z_last)
    : field_(field), neighbours_(neighbours) {
    const auto value = [](const ChunkGeometry& g, int voxel) {
        return g.weight[voxel] == 0 ? simd::kUnseen : g.sdf[voxel];
    };
    for (int dz = -1; dz <= 1; ++dz)
        for (int dy = -1; dy <= 1; ++dy) {
            const int y0 = dy < 0 ? -1 : 8 * dy, y1 = dy < 0 ? 0 : dy == 0 ? 8 : 10;
            const int z0 = std::max(dz < 0 ? -1 : 8 * dz, z_first - 1), z1 = std::min(dz < 0    ? 0
                                                                                      : dz == 0 ? 8
                                                                                                : 10,
                                                                                      z_last + 3);
            for (int dx = -1; dx <= 1; ++dx) {
                const std::uint32_t slot = neighbours_.slot[(dz + 1) * 9 + (dy + 1) * 3 + dx + 1];
                for (int z = z0; z < z1; ++z)
                    for (int y = y0; y < y1; ++y) {
                        std::int16_t* out = sdf_ + index(dx < 0 ? -1 : 8 * dx, y, z);
                        if (slot == kNoChunk) {
                            if (dx < 0) out[0] = simd::kUnseen;
                            if (dx == 0) std::fill_n(out, 8, simd::kUnseen);
                            if (dx > 0) out[0] = out[1] = simd::kUnseen;
                            continue;
                        }
                        const ChunkGeometry& g = field.geometry(slot);
                        const int row = Neighbourhood::voxel(0, y, z);
                        if (dx < 0) {
                            out[0] = value(g, row + 7);
                        } else if (dx == 0) {
                            for (int x = 0; x < 8; ++x) out[x] = value(g, row + x);
                        } else {
                            out[0] = value(g, row);
                            out[1] = value(g, row + 1);
                        }
                    }
            }
        }
}

void ChunkBlock::paint(Vertex* v, int x, int y, int z, int axis, float t) const {
    const std::uint8_t *low = colour_at(x, y, z),
                       *high = colour_at(x + (axis == 0), y + (axis == 1), z + (axis == 2));
    if (low && high) {
        for (int k = 0; k < 3; ++k)
            v->rgb[k] = static_cast<std::uint8_t>((1 - t) * low[k] + t * high[k] + 0.5f);
        return;
    }
    const std::uint8_t* one = low ? low : high ? high : nearest_colour(x, y, z, axis, t);
    if (one)
        for (int k = 0; k < 3; ++k) v->rgb[k] = one[k];
}

const std::uint8_t* ChunkBlock::colour_at(int x, int y, int z) const {
    const std::uint32_t slot = neighbours_.slot[Neighbourhood::place(x, y, z)];
    if (slot == kNoChunk) return nullptr;
    const ChunkColour* chunk = field_.colour(slot);
    if (!chunk) return nullptr;
    const std::uint8_t* colour = chunk->rgbn[Neighbourhood::voxel(x, y, z)];
    return colour[3] == 0 ? nullptr : colour;
}

// Colour is kept within two voxels of the surface along the ray, but on silhouettes surface passes between
// voxels that lie farther from it. The nearest of the voxels within two of the vertex then lends its colour;
// of several, the first by (z, y, x).
const std::uint8_t* ChunkBlock::nearest_colour(int x, int y, int z, int axis, float t) const {
    constexpr int kReach = 2;
    const std::uint8_t* nearest = nullptr;
    float least = static_cast<float>(kReach * kReach);
    const int last[3] = {kReach + (axis == 0), kReach + (axis == 1), kReach + (axis == 2)};
    for (int dz = -kReach; dz <= last[2]; ++dz)
        for (int dy = -kReach; dy <= last[1]; ++dy)
            for (int dx = -kReach; dx <= last[0]; ++dx) {
                float d[3] = {static_cast<float>(dx), static_cast<float>(dy), static_cast<float>(dz)};
                d[axis] -= t;
                const float distance = (d[0] * d[0] + d[1] * d[1]) + d[2] * d[2];
                if (!(nearest ? distance < least : distance <= least)) continue;
                const std::uint8_t* colour = colour_at(x + dx, y + dy, z + dz);
                if (!colour) continue;
                nearest = colour;
                least = distance;
            }
    return nearest;
}

}  // namespace burin
