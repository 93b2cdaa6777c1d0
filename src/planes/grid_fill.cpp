// SPDX-License-Identifier: MIT
#include "planes/grid_fill.h"

#include <algorithm>

namespace burin {
namespace {

void set_cells(const CellGrid& grid, int v, int first, int last, Cell kind) {
    std::memset(grid.row(v) + first, kind, static_cast<std::size_t>(last) - first + 1);
}

// Cells of the mask among columns first .. last of row v.
std::uint32_t count_cells(const CellGrid& grid, int v, int first, int last, CellMask mask) {
    int cells = 0;
    for (int u = first; u <= last; u += 64)
        cells += std::popcount(cell_bits(grid.row(v) + u, std::min(64, last - u + 1), mask));
    return static_cast<std::uint32_t>(cells);
}

// Adds the sides of a run's cells to the border of its region. Seen cells are in the hull, and an unknown
// neighbour in the hull is of the same region, so there is no border to it.
void add_border(const CellGrid& grid, const std::int32_t* spans, const CellRun& run, CellRun& region) {
    const std::uint8_t* row = grid.row(run.row);
    region.border += 2;  // a run is maximal: both its ends are border
    if (run.first > 0 && row[run.first - 1] == kCellSeen) ++region.seen_border;
    if (run.last + 1 < grid.width && row[run.last + 1] == kCellSeen) ++region.seen_border;
    for (const int v : {run.row - 1, run.row + 1}) {
        const auto length = static_cast<std::uint32_t>(run.last - run.first + 1);
        region.border += length;
        if (v < 0 || v >= grid.height) continue;
        region.seen_border += count_cells(grid, v, run.first, run.last, mask_of(kCellSeen));
        region.border -= count_cells(grid, v, std::max(run.first, spans[2 * v]),
                                     std::min(run.last, spans[2 * v + 1]), mask_of(kCellUnknown));
    }
}

}  // namespace

FillCounts fill_missing(const CellGrid& grid, const FillOptions& options, const FillScratch& scratch) {
    FillCounts counts;
    for (int v = 0; v < grid.height; ++v) {
        for_each_run(grid.row(v), 0, grid.width - 1, mask_of(kCellFilled),
                     [&](int first, int last) { set_cells(grid, v, first, last, kCellUnknown); });
    }
    counts.hull = convex_hull(grid, mask_of(kCellSeen), options.hull_points, options.hull_point_count,
                              scratch.spans, scratch.chain);
    counts.runs =
        find_components(grid, mask_of(kCellUnknown), scratch.spans, scratch.runs, scratch.run_capacity).runs;
    if (counts.runs > scratch.run_capacity) return counts;
    for (std::uint64_t i = 0; i < counts.runs; ++i) {
        const CellRun& run = scratch.runs[i];
        add_border(grid, scratch.spans, run, scratch.runs[run.root]);
    }
    for (std::uint64_t i = 0; i < counts.runs; ++i) {
        const CellRun& run = scratch.runs[i];
        const CellRun& region = scratch.runs[run.root];
        const auto cells = static_cast<std::uint32_t>(run.last - run.first + 1);
        if (region.seen_border == 0) {
            counts.unreached_cells += cells;
        } else if (region.seen_border < static_cast<double>(options.least_border_share) * region.border) {
            counts.refused_cells += cells;
            if (run.root == i) ++counts.refused_regions;
        } else {
            counts.filled_cells += cells;
            if (run.root == i) ++counts.filled_regions;
            set_cells(grid, run.row, run.first, run.last, kCellFilled);
        }
    }
    return counts;
}

namespace {

// Adds what the runs of unknown cells along one line of n cells, `stride` apart, tell for their cells.
void tell_line(const std::uint8_t* cells, std::uint8_t* told, std::ptrdiff_t stride, int n, int longest) {
    const auto worth = [](std::uint8_t cell) {  // of an end
        return cell == kCellSeen || cell == kCellFilled ? 2 : cell == kCellMeets ? 1 : 0;
    };
    int first = -1, before = 0;  // the run's first cell, and what ends it there
    for (int i = 0; i < n; ++i) {
        const std::uint8_t cell = cells[i * stride];
        if (cell == kCellUnknown) {
            if (first < 0) first = i;
            continue;
        }
        const int after = worth(cell);
        if (first >= 0 && i - first <= longest && before > 0 && after > 0 && before + after > 2)
            for (int k = first; k < i; ++k)
                told[k * stride] = static_cast<std::uint8_t>(told[k * stride] + before + after - 2);
        first = -1;
        before = after;
    }
}

}  // namespace

std::uint64_t fill_between(const CellGrid& grid, int longest, std::uint8_t* scratch) {
    const int w = grid.width, h = grid.height;
    if (w <= 0 || h <= 0) return 0;
    const std::size_t size = static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
    std::memset(scratch, 0, size);
    const auto line = [&](int u, int v, int du, int dv) {
        int n = dv == 0 ? w : h - v;
        if (du != 0) n = std::min(n, du > 0 ? w - u : u + 1);
        const std::size_t at =
            static_cast<std::size_t>(v) * static_cast<std::size_t>(w) + static_cast<std::size_t>(u);
        // 5 / 7 of the cells of a row are as long on a diagonal.
        tell_line(grid.cells + at, scratch + at, std::ptrdiff_t{dv} * w + du, n,
                  du != 0 && dv != 0 ? longest * 5 / 7 : longest);
    };
    for (int v = 0; v < h; ++v) line(0, v, 1, 0);
    for (int u = 0; u < w; ++u)
        for (int du = -1; du <= 1; ++du) line(u, 0, du, 1);
    for (int v = 1; v < h; ++v) {
        line(0, v, 1, 1);
        line(w - 1, v, -1, 1);
    }
    std::uint64_t filled = 0;
    for (std::size_t i = 0; i < size; ++i) {
        if (scratch[i] < 2) continue;
        grid.cells[i] = kCellFilled;
        ++filled;
    }
    return filled;
}

}  // namespace burin
