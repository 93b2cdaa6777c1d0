// SPDX-License-Identifier: MIT
#include "mesh/chunk_block.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "core/marching_cubes_table.h"
#include "simd/tsdf.h"

namespace burin {
namespace {

// Vertices keep this share of an edge between themselves and its ends, so that the vertices of the three
// edges that meet in a voxel never coincide, however close to zero its distance: no duplicate vertices, no
// degenerate triangles. 1/256 of a 5 mm voxel is 20 micrometres, and 1/100 float steps at 40 m.
constexpr float kEndMargin = 1.0f / 256.0f;

// Bits -1..9 of a row of voxels.
using Row = std::uint16_t;

}  // namespace

ChunkBlock::ChunkBlock(const Volume& volume, std::uint32_t slot, const MeshOptions& options)
    : volume_(volume), neighbours_(volume, unpack_key(volume.key(slot))) {
    const int min_weight = std::max(1, static_cast<int>(std::lround(options.min_weight * simd::kWeightOne)));
    for (int z = -1; z <= 9; ++z)
        for (int y = -1; y <= 9; ++y)
            for (int cx = -1; cx <= 1;
                 ++cx) {  // the row crosses three chunks: voxel 7, voxels 0..7, voxels 0 and 1
                const std::uint32_t from = neighbours_.slot[Neighbourhood::place(8 * cx, y, z)];
                const int x0 = cx < 0 ? -1 : 8 * cx, x1 = cx < 0 ? -1 : cx == 0 ? 7 : 9;
                if (from == kNoChunk) {
                    for (int x = x0; x <= x1; ++x) {
                        sdf_[index(x, y, z)] = 0;
                        known_[index(x, y, z)] = seen_[index(x, y, z)] = false;
                    }
                    continue;
                }
                const ChunkGeometry& g = volume.geometry(from);
                for (int x = x0; x <= x1; ++x) {
                    const int v = Neighbourhood::voxel(x, y, z);
                    sdf_[index(x, y, z)] = g.sdf[v];
                    known_[index(x, y, z)] = g.weight[v] >= min_weight;
                    seen_[index(x, y, z)] = g.weight[v] > 0;
                }
            }
    const float jump = options.max_jump_voxels * volume.voxel_m() / volume.units_to_m();
    find_active(static_cast<int>(std::min(jump, 70000.0f)));
}

void ChunkBlock::find_active(int max_jump) {
    Row known[10][10], inside[10][10];  // rows at y, z in -1..8
    for (int z = -1; z <= 8; ++z)
        for (int y = -1; y <= 8; ++y) {
            Row k = 0, s = 0;
            for (int x = -1; x <= 8; ++x) {
                k = static_cast<Row>(k | known_[index(x, y, z)] << (x + 1));
                s = static_cast<Row>(s | (sdf_[index(x, y, z)] < 0) << (x + 1));
            }
            known[z + 1][y + 1] = k;
            inside[z + 1][y + 1] = s;
        }
    for (int z = -1; z <= 7; ++z)
        for (int y = -1; y <= 7; ++y) {
            const auto four = [&](const Row rows[10][10], bool all) {
                const Row a = rows[z + 1][y + 1], b = rows[z + 1][y + 2], c = rows[z + 2][y + 1],
                          d = rows[z + 2][y + 2];
                const Row both = all ? static_cast<Row>(a & b & c & d) : static_cast<Row>(a | b | c | d);
                return all ? static_cast<Row>(both & both >> 1) : static_cast<Row>(both | both >> 1);
            };
            Row active =
                static_cast<Row>(four(known, true) & four(inside, false) & ~four(inside, true) & 0x1ff);
            for (Row left = active; left != 0; left = static_cast<Row>(left & (left - 1))) {
                const int x = std::countr_zero(left) - 1;
                for (const CubeEdge& edge : kCubeEdges) {
                    const int ax = x + (edge.corner & 1), ay = y + (edge.corner >> 1 & 1),
                              az = z + (edge.corner >> 2);
                    const int a = sdf(ax, ay, az),
                              b = sdf(ax + (edge.axis == 0), ay + (edge.axis == 1), az + (edge.axis == 2));
                    if ((a < 0) != (b < 0) && std::abs(a - b) > max_jump) {
                        active = static_cast<Row>(active & ~(1 << (x + 1)));
                        break;
                    }
                }
            }
            active_[(z + 1) * 9 + y + 1] = active;
        }
}

int ChunkBlock::configuration(int x, int y, int z) const {
    int bits = 0;
    for (int i = 0; i < 8; ++i) bits |= (sdf(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2)) < 0) << i;
    return bits;
}

// Central differences in stored units per voxel, one-sided where a neighbour was never seen.
Vec3f ChunkBlock::gradient(int x, int y, int z) const {
    Vec3f g;
    const int here = index(x, y, z);
    const int step[3] = {1, kSide, kSide * kSide};
    for (int r = 0; r < 3; ++r) {
        const int low = here - step[r], high = here + step[r];
        if (seen_[low] && seen_[high])
            g[r] = 0.5f * static_cast<float>(sdf_[high] - sdf_[low]);
        else if (seen_[high])
            g[r] = static_cast<float>(sdf_[high] - sdf_[here]);
        else if (seen_[low])
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
