// SPDX-License-Identifier: MIT
// Grids of cells for tests of a plane's extent: drawn ones, random ones, and their components by a flood.
// Drawn grids have their highest row first, as v points up: '.' unknown, '#' seen, 'x' blocked, 'o' filled,
// '+' another plane meets it.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "emulated.h"
#include "planes/cell_grid.h"
#include "scene_helpers.h"

namespace burin {

constexpr CellMask kSeenMask = mask_of(kCellSeen);
constexpr int kGrids = sized(400, 40);  // random grids a test; some milliseconds each at most
inline const std::string kKinds = ".#xo+";

struct Grid {
    Grid(int w, int h) : width(w), height(h), cells(static_cast<std::size_t>(w) * h) {}
    explicit Grid(const std::vector<std::string>& rows)
        : Grid(rows.empty() ? 0 : static_cast<int>(rows[0].size()), static_cast<int>(rows.size())) {
        for (int v = 0; v < height; ++v)
            for (int u = 0; u < width; ++u)
                at(u, v) = static_cast<std::uint8_t>(
                    kKinds.find(rows[static_cast<std::size_t>(height - 1 - v)][static_cast<std::size_t>(u)]));
    }
    std::uint8_t& at(int u, int v) { return cells[static_cast<std::size_t>(v) * width + u]; }
    // Beyond the border all is unknown.
    int kind(int u, int v) const {
        const bool in = u >= 0 && u < width && v >= 0 && v < height;
        return in ? cells[static_cast<std::size_t>(v) * width + u] : 0;
    }
    bool is(int u, int v, CellMask mask) const {
        return u >= 0 && u < width && v >= 0 && v < height && mask >> kind(u, v) & 1;
    }
    std::vector<std::string> rows() const {
        std::vector<std::string> out(static_cast<std::size_t>(height));
        for (int v = height; v-- > 0;)
            for (int u = 0; u < width; ++u)
                out[static_cast<std::size_t>(height - 1 - v)] += kKinds[static_cast<std::size_t>(kind(u, v))];
        return out;
    }
    std::int64_t count(CellMask mask) const {
        return std::count_if(cells.begin(), cells.end(), [&](int c) { return mask >> c & 1; });
    }
    operator CellGrid() { return {cells.data(), width, height}; }

    int width, height;
    std::vector<std::uint8_t> cells;
};

// Sides 1 .. `side`; patches of one kind, so that there is something to close, to enclose and to surround.
inline Grid random_grid(Rng& rng, int side) {
    Grid grid(1 + rng.below(side), 1 + rng.below(side));
    const double share = rng.uniform(0, 1), other = rng.uniform(0, 0.4);
    for (std::uint8_t& cell : grid.cells) {
        if (rng.uniform(0, 1) < share) cell = kCellSeen;
        if (rng.uniform(0, 1) < other) cell = static_cast<std::uint8_t>(rng.below(5));
    }
    for (int patch = rng.below(6); patch > 0; --patch) {
        const int u = rng.below(grid.width), v = rng.below(grid.height), size = 1 + rng.below(side / 2);
        const auto kind = static_cast<std::uint8_t>(rng.below(8) < 5 ? rng.below(2) : rng.below(5));
        for (int y = v; y < std::min(v + size, grid.height); ++y)
            for (int x = u; x < std::min(u + size, grid.width); ++x) grid.at(x, y) = kind;
    }
    return grid;
}

// Component (from 1) of every cell of the mask within the spans, 0 elsewhere; over corners too on request.
struct Parts {
    Parts(const Grid& grid, CellMask mask, const std::vector<std::int32_t>& spans = {}, bool corners = false)
        : part(grid.cells.size()), sizes(1) {
        const auto member = [&](int u, int v) {
            if (!grid.is(u, v, mask)) return false;
            const auto s = 2 * static_cast<std::size_t>(v);
            return spans.empty() || (u >= spans[s] && u <= spans[s + 1]);
        };
        const auto of = [&](int u, int v) -> int& {
            return part[static_cast<std::size_t>(v) * grid.width + u];
        };
        for (int v = 0; v < grid.height; ++v)
            for (int u = 0; u < grid.width; ++u) {
                if (!member(u, v) || of(u, v)) continue;
                const int name = static_cast<int>(sizes.size());
                std::vector<CellPoint> queue = {{u, v}};
                of(u, v) = name;
                for (std::size_t i = 0; i < queue.size(); ++i)
                    for (int d = 0; d < 9; ++d) {
                        const int x = queue[i].u + d % 3 - 1, y = queue[i].v + d / 3 - 1;
                        if ((!corners && d % 2 == 0) || !member(x, y) || of(x, y)) continue;
                        of(x, y) = name;
                        queue.push_back({x, y});
                    }
                sizes.push_back(queue.size());
            }
    }
    std::vector<int> part;
    std::vector<std::size_t> sizes;  // of part 0: none
};

}  // namespace burin
