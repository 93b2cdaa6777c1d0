// SPDX-License-Identifier: MIT
// The marching cubes table (Lorensen & Cline 1987), generated at compile time from one rule per cube face, so
// that two cells always agree on the face they share and no cracks can open:
//   on a face, every run of inside corners (sdf < 0) is cut off by one segment; on an ambiguous face (inside
//   corners diagonal) the two inside corners are thus always separated.
// The segments of the six faces close into loops, and the loops are cut into triangles without ever using a
// diagonal that lies in a cube face (such a triangle would be doubled by the neighbouring cell).
//
// Corner i of a cell lies at (i & 1, i >> 1 & 1, i >> 2 & 1). Bit i of a configuration is set when corner i
// is inside. Edge e = 4 * axis + k runs along `axis` from kCubeEdges[e].corner.
#pragma once

#include <array>
#include <cstdint>

namespace burin {

struct CubeEdge {
    std::uint8_t corner;  // the end with the smaller coordinate
    std::uint8_t axis;    // 0 x, 1 y, 2 z
};

struct CubeTriangles {
    std::uint8_t count = 0;
    std::uint16_t edges = 0;       // bit e: edge e carries a vertex
    std::uint8_t edge[5][3] = {};  // counter-clockwise seen from outside (sdf > 0)
};

namespace mc_detail {

constexpr std::array<CubeEdge, 12> make_edges() {
    std::array<CubeEdge, 12> edges{};
    for (int axis = 0; axis < 3; ++axis)
        for (int corner = 0, k = 0; corner < 8; ++corner)
            if (!(corner >> axis & 1))
                edges[4 * axis + k++] = {static_cast<std::uint8_t>(corner), static_cast<std::uint8_t>(axis)};
    return edges;
}

constexpr int edge_between(const std::array<CubeEdge, 12>& edges, int a, int b) {
    const int low = a < b ? a : b;
    const int bit = a ^ b;
    const int axis = bit == 1 ? 0 : bit == 2 ? 1 : 2;
    for (int e = 0; e < 12; ++e)
        if (edges[e].corner == low && edges[e].axis == axis) return e;
    return -1;
}

// Bit f set: the edge lies in face f = 2 * axis + side.
constexpr int faces_of(const CubeEdge& edge) {
    int faces = 0;
    for (int axis = 0; axis < 3; ++axis)
        if (axis != edge.axis) faces |= 1 << (2 * axis + (edge.corner >> axis & 1));
    return faces;
}

constexpr std::array<CubeTriangles, 256> make_table() {
    const auto edges = make_edges();
    std::array<CubeTriangles, 256> table{};
    for (int config = 0; config < 256; ++config) {
        int next[12] = {};
        for (int& n : next) n = -1;
        for (int axis = 0; axis < 3; ++axis) {
            for (int side = 0; side < 2; ++side) {
                // The face's corners, counter-clockwise seen from outside the cube.
                const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
                const int ring[4] = {base, base | (side ? u : v), base | u | v, base | (side ? v : u)};
                for (int i = 0; i < 4; ++i) {
                    const bool inside = config >> ring[i] & 1, before = config >> ring[(i + 3) % 4] & 1;
                    if (!inside || before) continue;  // a run of inside corners starts at i
                    int last = i;
                    while (config >> ring[(last + 1) % 4] & 1) ++last;
                    const int enter = edge_between(edges, ring[(i + 3) % 4], ring[i]);
                    const int leave = edge_between(edges, ring[last % 4], ring[(last + 1) % 4]);
                    next[enter] = leave;
                }
            }
        }
        CubeTriangles& out = table[config];
        for (int start = 0; start < 12; ++start) {
            if (next[start] < 0) continue;
            int loop[12] = {}, n = 0;
            for (int e = start; next[e] >= 0;) {
                const int following = next[e];
                out.edges = static_cast<std::uint16_t>(out.edges | 1 << e);
                loop[n++] = e;
                next[e] = -1;
                e = following;
            }
            while (n >= 3) {
                int ear = -1;
                for (int i = 0; i < n && ear < 0; ++i)
                    if (n == 3 ||
                        !(faces_of(edges[loop[(i + n - 1) % n]]) & faces_of(edges[loop[(i + 1) % n]])))
                        ear = i;
                if (ear < 0) return {};  // no such triangulation: the static_assert below would fail
                const int tri[3] = {loop[(ear + n - 1) % n], loop[ear], loop[(ear + 1) % n]};
                for (int i = 0; i < 3; ++i) out.edge[out.count][i] = static_cast<std::uint8_t>(tri[i]);
                ++out.count;
                for (int i = ear; i + 1 < n; ++i) loop[i] = loop[i + 1];
                --n;
            }
        }
    }
    return table;
}

}  // namespace mc_detail

inline constexpr std::array<CubeEdge, 12> kCubeEdges = mc_detail::make_edges();
inline constexpr std::array<CubeTriangles, 256> kMarchingCubes = mc_detail::make_table();
static_assert(kMarchingCubes[1].count == 1 && kMarchingCubes[254].count == 1,
              "a triangulation was not found");

}  // namespace burin
