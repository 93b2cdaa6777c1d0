// SPDX-License-Identifier: MIT
#include "mesh/chunk_cells.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "core/marching_cubes_table.h"
#include "simd/tsdf.h"

namespace burin {

CellRule::CellRule(const SurfaceField& field, const MeshOptions& options) {
    const long min_weight = std::lround(options.min_weight * simd::kWeightOne);
    limits.min_weight = static_cast<std::uint16_t>(std::clamp(min_weight, 1L, 65535L));
    const float jump = options.max_jump_voxels * field.voxel_m() / field.units_to_m();
    max_jump = static_cast<int>(std::min(jump, 70000.0f));
    // a < 0 <= b, b - a > max_jump, b <= 32767 and a >= -32768.
    limits.deep = static_cast<std::int16_t>(std::clamp(32767 - max_jump, -32768, 0));
    limits.high = static_cast<std::int16_t>(std::clamp(max_jump - 32768, -1, 32767));
}

ChunkCells::ChunkCells(const SurfaceField& field, const std::uint32_t upper[8], const CellRule& rule)
    : field_(field), upper_(upper), max_jump_(rule.max_jump) {
    for (int i = 0; i < 8; ++i) {
        if (upper[i] == kNoChunk) {
            bits_[i] = {};
            continue;
        }
        const ChunkGeometry& g = field.geometry(upper[i]);
        simd::classify_chunk(g.sdf, g.weight, i < 4 ? 8 : 1, rule.limits, &bits_[i]);
    }
    for (int z = 0; z < 9; ++z) inside_[z] = plane([](const simd::ChunkBits& b) { return b.inside; }, z);
}

template <class Field>
ChunkCells::Plane ChunkCells::plane(Field field, int z) const {
    const simd::ChunkBits* bits = z < 8 ? bits_ : bits_ + 4;
    z &= 7;
    const std::uint64_t at = field(bits[0])[z], x = field(bits[1])[z], y = field(bits[2])[z],
                        xy = field(bits[3])[z];
    const std::uint64_t up = next_y(at, y);
    return {at, next_x(at, x), up, next_x(up, next_y(x, xy))};
}

bool ChunkCells::find_active(std::uint64_t active[8]) const {
    std::uint64_t any = 0;
    const auto all_of = [](const Plane& p) { return p.at & p.x & p.y & p.xy; };
    const auto some_of = [](const Plane& p) { return p.at | p.x | p.y | p.xy; };
    const auto known_at = [&](int z) {
        return all_of(plane([](const simd::ChunkBits& b) { return b.known; }, z));
    };
    std::uint64_t known = known_at(0), all = all_of(inside_[0]), some = some_of(inside_[0]);
    for (int z = 0; z < 8; ++z) {
        const std::uint64_t known_above = known_at(z + 1), all_above = all_of(inside_[z + 1]),
                            some_above = some_of(inside_[z + 1]);
        active[z] = known & known_above & (some | some_above) & ~(all & all_above);
        any |= active[z];
        known = known_above;
        all = all_above;
        some = some_above;
    }
    if (any == 0) return false;

    // Jumps are rare: only cells with an edge from deep to high are looked at.
    struct Ends {
        Plane deep, high;
    };
    const auto ends_at = [&](int z) {
        return Ends{plane([](const simd::ChunkBits& b) { return b.deep; }, z),
                    plane([](const simd::ChunkBits& b) { return b.high; }, z)};
    };
    const auto within = [](const Ends& e) {  // the four edges in one plane
        const Plane &d = e.deep, &h = e.high;
        return (d.at & (h.x | h.y)) | (h.at & (d.x | d.y)) | (d.xy & (h.x | h.y)) | (h.xy & (d.x | d.y));
    };
    const auto between = [](const Plane& d, const Plane& h) {
        return (d.at & h.at) | (d.x & h.x) | (d.y & h.y) | (d.xy & h.xy);
    };
    Ends low = ends_at(0);
    any = 0;
    for (int z = 0; z < 8; ++z) {
        const Ends above = ends_at(z + 1);
        std::uint64_t left = active[z] & (within(low) | within(above) | between(low.deep, above.high) |
                                          between(above.deep, low.high));
        for (; left != 0; left &= left - 1) {
            const int bit = std::countr_zero(left);
            if (jumps(bit & 7, bit >> 3, z)) active[z] &= ~(std::uint64_t{1} << bit);
        }
        any |= active[z];
        low = above;
    }
    return any != 0;
}

bool ChunkCells::jumps(int x, int y, int z) const {
    int d[8];
    for (int i = 0; i < 8; ++i) {
        const int cx = x + (i & 1), cy = y + (i >> 1 & 1), cz = z + (i >> 2);
        // All corners of an active cell are known, so their chunks exist.
        d[i] = field_.geometry(upper_[(cx >> 3) | (cy >> 3) << 1 | (cz >> 3) << 2])
                   .sdf[Neighbourhood::voxel(cx, cy, cz)];
    }
    for (const CubeEdge& edge : kCubeEdges) {
        const int a = d[edge.corner], b = d[edge.corner | 1 << edge.axis];
        if ((a < 0) != (b < 0) && std::abs(a - b) > max_jump_) return true;
    }
    return false;
}

}  // namespace burin
