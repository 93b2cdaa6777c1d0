// SPDX-License-Identifier: MIT
#include "mesh/chunk_block.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "core/marching_cubes_table.h"
#include "simd/classify.h"
#include "simd/tsdf.h"

namespace burin {
namespace {

// Vertices keep this share of an edge between themselves and its ends, so that the vertices of the three
// edges that meet in a voxel never coincide, however close to zero its distance: no duplicate vertices, no
// degenerate triangles. 1/256 of a 5 mm voxel is 20 micrometres, and 1/100 float steps at 40 m.
constexpr float kEndMargin = 1.0f / 256.0f;

}  // namespace

ChunkBlock::ChunkBlock(const Volume& volume, std::uint32_t slot, const MeshOptions& options)
    : volume_(volume), neighbours_(volume, unpack_key(volume.key(slot))) {
    const long min_weight = std::lround(options.min_weight * simd::kWeightOne);
    classify(static_cast<std::uint16_t>(std::clamp(min_weight, 1L, 65535L)));
    empty_ = !find_active();
    if (empty_) return;
    gather<std::int16_t>([](const ChunkGeometry& g) { return &g.sdf[0]; }, sdf_);
    const float jump = options.max_jump_voxels * volume.voxel_m() / volume.units_to_m();
    drop_jumps(static_cast<int>(std::min(jump, 70000.0f)));
}

void ChunkBlock::gather_weights() {
    gather<std::uint16_t>([](const ChunkGeometry& g) { return &g.weight[0]; }, weight_);
}

// Bits of all rows at -1..8. Along x a row takes bit 7 of the chunk before, eight bits of its own chunk, and
// bit 0 of the chunk after.
void ChunkBlock::classify(std::uint16_t min_weight) {
    std::memset(known_, 0, sizeof known_);
    std::memset(inside_, 0, sizeof inside_);
    for (int dz = -1; dz <= 1; ++dz)
        for (int dy = -1; dy <= 1; ++dy) {
            // Rows of this column of chunks: y in y0 .. y0 + ny - 1 and so for z.
            const int y0 = dy < 0 ? -1 : 8 * dy, ny = dy == 0 ? 8 : 1, z0 = dz < 0 ? -1 : 8 * dz,
                      nz = dz == 0 ? 8 : 1;
            for (int dx = -1; dx <= 1; ++dx) {
                const std::uint32_t slot = neighbours_.slot[(dz + 1) * 9 + (dy + 1) * 3 + dx + 1];
                if (slot == kNoChunk) continue;
                const ChunkGeometry& g = volume_.geometry(slot);
                std::uint8_t known[64], inside[64];
                const int first = (z0 & 7) * 8 + (y0 & 7);
                if (dx == 0) {
                    simd::classify_rows(g.sdf, g.weight, first, ny == 1 ? 8 : 1, ny * nz, min_weight, known,
                                        inside);
                } else {  // one voxel a row
                    const int x = dx < 0 ? 7 : 0;
                    for (int i = 0; i < ny * nz; ++i) {
                        const int v = 8 * (first + i * (ny == 1 ? 8 : 1)) + x;
                        known[i] = static_cast<std::uint8_t>((g.weight[v] >= min_weight) << x);
                        inside[i] = static_cast<std::uint8_t>((g.sdf[v] < 0) << x);
                    }
                }
                for (int i = 0; i < ny * nz; ++i) {
                    const int y = y0 + 1 + (ny == 1 ? 0 : i % 8), z = z0 + 1 + (ny == 1 ? i : i / 8);
                    const int shift = dx < 0 ? -7 : dx == 0 ? 1 : 9;
                    const auto place = [shift](int bits) {
                        return static_cast<std::uint16_t>(shift < 0 ? bits >> 7 : bits << shift);
                    };
                    known_[z][y] = static_cast<std::uint16_t>(known_[z][y] | place(known[i]));
                    inside_[z][y] = static_cast<std::uint16_t>(inside_[z][y] | place(inside[i]));
                }
            }
        }
}

bool ChunkBlock::find_active() {
    unsigned any = 0;
    for (int z = 0; z < 9; ++z)
        for (int y = 0; y < 9; ++y) {
            const unsigned known = known_[z][y] & known_[z][y + 1] & known_[z + 1][y] & known_[z + 1][y + 1];
            const unsigned all =
                inside_[z][y] & inside_[z][y + 1] & inside_[z + 1][y] & inside_[z + 1][y + 1];
            const unsigned some =
                inside_[z][y] | inside_[z][y + 1] | inside_[z + 1][y] | inside_[z + 1][y + 1];
            const unsigned active = (known & known >> 1) & (some | some >> 1) & ~(all & all >> 1) & 0x1ff;
            active_[z * 9 + y] = static_cast<std::uint16_t>(active);
            any |= active;
        }
    return any != 0;
}

// Copies one field of all voxels at -1..9.
template <class T>
void ChunkBlock::gather(const T* (*field)(const ChunkGeometry&), T* to) const {
    static const T kNothing[8] = {};
    for (int z = -1; z <= 9; ++z)
        for (int y = -1; y <= 9; ++y) {
            const int place = Neighbourhood::place(0, y, z), row = Neighbourhood::voxel(0, y, z);
            const auto row_of = [&](int dx) {
                const std::uint32_t slot = neighbours_.slot[place + dx];
                return slot == kNoChunk ? kNothing : field(volume_.geometry(slot)) + row;
            };
            T* out = to + index(-1, y, z);
            out[0] = row_of(-1)[7];
            std::memcpy(out + 1, row_of(0), 8 * sizeof(T));
            std::memcpy(out + 9, row_of(1), 2 * sizeof(T));
        }
}

void ChunkBlock::drop_jumps(int max_jump) {
    for (int z = -1; z <= 7; ++z)
        for (int y = -1; y <= 7; ++y) {
            std::uint16_t& active = active_[(z + 1) * 9 + y + 1];
            for (unsigned left = active; left != 0; left &= left - 1) {
                const int x = std::countr_zero(left) - 1;
                for (const CubeEdge& edge : kCubeEdges) {
                    const int ax = x + (edge.corner & 1), ay = y + (edge.corner >> 1 & 1),
                              az = z + (edge.corner >> 2);
                    const int a = sdf(ax, ay, az),
                              b = sdf(ax + (edge.axis == 0), ay + (edge.axis == 1), az + (edge.axis == 2));
                    if ((a < 0) != (b < 0) && std::abs(a - b) > max_jump) {
                        active = static_cast<std::uint16_t>(active & ~(1 << (x + 1)));
                        break;
                    }
                }
            }
        }
}

int ChunkBlock::configuration(int x, int y, int z) const {
    const int shift = x + 1;
    return (inside_[z + 1][y + 1] >> shift & 3) | (inside_[z + 1][y + 2] >> shift & 3) << 2 |
           (inside_[z + 2][y + 1] >> shift & 3) << 4 | (inside_[z + 2][y + 2] >> shift & 3) << 6;
}

// Central differences in stored units per voxel, one-sided where a neighbour was never seen.
Vec3f ChunkBlock::gradient(int x, int y, int z) const {
    Vec3f g;
    const int here = index(x, y, z);
    const int step[3] = {1, kSide, kSide * kSide};
    for (int r = 0; r < 3; ++r) {
        const int low = here - step[r], high = here + step[r];
        if (weight_[low] > 0 && weight_[high] > 0)
            g[r] = 0.5f * static_cast<float>(sdf_[high] - sdf_[low]);
        else if (weight_[high] > 0)
            g[r] = static_cast<float>(sdf_[high] - sdf_[here]);
        else if (weight_[low] > 0)
            g[r] = static_cast<float>(sdf_[here] - sdf_[low]);
    }
    return g;
}

ChunkBlock::Vertex ChunkBlock::vertex(int x, int y, int z, int axis) const {
    const int x1 = x + (axis == 0), y1 = y + (axis == 1), z1 = z + (axis == 2);
    const float a = static_cast<float>(sdf(x, y, z)), b = static_cast<float>(sdf(x1, y1, z1));
    const float t = std::clamp(a / (a - b), kEndMargin, 1.0f - kEndMargin);
    Vertex v;
    const Vec3i c = neighbours_.chunk;
    const double voxel_m = volume_.voxel_m();
    double p[3] = {c.x * 8.0 + x + 0.5, c.y * 8.0 + y + 0.5, c.z * 8.0 + z + 0.5};
    p[axis] += t;
    v.position = {static_cast<float>(p[0] * voxel_m), static_cast<float>(p[1] * voxel_m),
                  static_cast<float>(p[2] * voxel_m)};
    const Vec3f g = gradient(x, y, z) * (1 - t) + gradient(x1, y1, z1) * t;
    v.normal = normalised(g);
    if (v.normal == Vec3f{}) v.normal[axis] = b > a ? 1.0f : -1.0f;

    v.rgb[0] = v.rgb[1] = v.rgb[2] = 255;
    if (!volume_.has_colour()) return v;
    const std::uint8_t* colours[2] = {};
    const int ends[2][3] = {{x, y, z}, {x1, y1, z1}};
    for (int e = 0; e < 2; ++e) {
        const std::uint32_t slot = neighbours_.slot[Neighbourhood::place(ends[e][0], ends[e][1], ends[e][2])];
        colours[e] = volume_.colour(slot).rgbn[Neighbourhood::voxel(ends[e][0], ends[e][1], ends[e][2])];
        if (colours[e][3] == 0) colours[e] = nullptr;
    }
    for (int k = 0; k < 3; ++k) {
        if (colours[0] && colours[1])
            v.rgb[k] = static_cast<std::uint8_t>((1 - t) * colours[0][k] + t * colours[1][k] + 0.5f);
        else if (colours[0] || colours[1])
            v.rgb[k] = (colours[0] ? colours[0] : colours[1])[k];
    }
    return v;
}

}  // namespace burin
