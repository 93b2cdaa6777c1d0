// SPDX-License-Identifier: MIT
#include "mesh/chunk_block.h"

#include <algorithm>

#include "simd/tsdf.h"

namespace burin {
namespace {

// Vertices keep this share of an edge between themselves and its ends, so that the vertices of the three
// edges that meet in a voxel never coincide, however close to zero its distance: no duplicate vertices, no
// degenerate triangles. 1/256 of a 5 mm voxel is 20 micrometres, and 1/100 float steps at 40 m.
constexpr float kEndMargin = 1.0f / 256.0f;

// No stored distance is below -32767: averages stay between the readings, and those begin there.
constexpr std::int16_t kUnseen = simd::kUnseen;

}  // namespace

ChunkBlock::ChunkBlock(const Volume& volume, const Neighbourhood& neighbours, int z_first, int z_last)
    : volume_(volume), neighbours_(neighbours) {
    const auto value = [](const ChunkGeometry& g, int voxel) {
        return g.weight[voxel] == 0 ? kUnseen : g.sdf[voxel];
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
                            if (dx < 0) out[0] = kUnseen;
                            if (dx == 0) std::fill_n(out, 8, kUnseen);
                            if (dx > 0) out[0] = out[1] = kUnseen;
                            continue;
                        }
                        const ChunkGeometry& g = volume.geometry(slot);
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

// Central differences in stored units per voxel, one-sided where a neighbour was never seen.
Vec3f ChunkBlock::gradient(int here) const {
    Vec3f g;
    const int step[3] = {1, kSide, kSide * kSide};
    for (int r = 0; r < 3; ++r) {
        const int low = sdf_[here - step[r]], high = sdf_[here + step[r]];
        if (low != kUnseen && high != kUnseen)
            g[r] = 0.5f * static_cast<float>(high - low);
        else if (high != kUnseen)
            g[r] = static_cast<float>(high - sdf_[here]);
        else if (low != kUnseen)
            g[r] = static_cast<float>(sdf_[here] - low);
    }
    return g;
}

ChunkBlock::Vertex ChunkBlock::vertex(int x, int y, int z, int axis, bool with_normal,
                                      bool with_colour) const {
    const int x1 = x + (axis == 0), y1 = y + (axis == 1), z1 = z + (axis == 2);
    const int here = index(x, y, z), there = index(x1, y1, z1);
    const float a = static_cast<float>(sdf_[here]), b = static_cast<float>(sdf_[there]);
    const float t = std::clamp(a / (a - b), kEndMargin, 1.0f - kEndMargin);
    Vertex v;
    const Vec3i c = neighbours_.chunk;
    const double voxel_m = volume_.voxel_m();
    double p[3] = {c.x * 8.0 + x + 0.5, c.y * 8.0 + y + 0.5, c.z * 8.0 + z + 0.5};
    p[axis] += t;
    v.position = {static_cast<float>(p[0] * voxel_m), static_cast<float>(p[1] * voxel_m),
                  static_cast<float>(p[2] * voxel_m)};
    if (with_normal) {
        const Vec3f g = gradient(here) * (1 - t) + gradient(there) * t;
        v.normal = normalised(g);
        if (v.normal == Vec3f{}) v.normal[axis] = b > a ? 1.0f : -1.0f;
    }

    v.rgb[0] = v.rgb[1] = v.rgb[2] = 255;
    if (!with_colour || !volume_.has_colour()) return v;
    const std::uint8_t *low = colour_at(x, y, z), *high = colour_at(x1, y1, z1);
    if (low && high) {
        for (int k = 0; k < 3; ++k)
            v.rgb[k] = static_cast<std::uint8_t>((1 - t) * low[k] + t * high[k] + 0.5f);
        return v;
    }
    const std::uint8_t* one = low ? low : high ? high : nearest_colour(x, y, z, axis, t);
    if (one)
        for (int k = 0; k < 3; ++k) v.rgb[k] = one[k];
    return v;
}

const std::uint8_t* ChunkBlock::colour_at(int x, int y, int z) const {
    const std::uint32_t slot = neighbours_.slot[Neighbourhood::place(x, y, z)];
    if (slot == kNoChunk) return nullptr;
    const std::uint8_t* colour = volume_.colour(slot).rgbn[Neighbourhood::voxel(x, y, z)];
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
