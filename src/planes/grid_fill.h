// SPDX-License-Identifier: MIT
// Completion within the plane: which of the cells that nobody saw belong to it.
#pragma once

#include "planes/cell_grid.h"

namespace burin {

struct FillOptions {
    // Cells that the hull is drawn out to, for instance where the plane meets others; may be null when 0.
    const CellPoint* hull_points = nullptr;
    std::uint32_t hull_point_count = 0;
    // 0..1: a region is filled only when at least this share of its boundary touches seen cells. The rest of
    // a boundary is blocked cells, the rim of the hull and the border of the grid: a region that mostly has
    // those is a guess. 0 fills whatever touches a seen cell.
    float least_border_share = 0;
};

struct FillScratch {             // caller's memory; its content is of no use before, and as said after
    std::int32_t* spans;         // 2 * height; holds the hull (see convex_hull) afterwards
    std::int32_t* chain;         // height
    CellRun* runs;               // run_capacity; holds the regions (see find_components) afterwards
    std::uint64_t run_capacity;  // max_runs(width, height) always suffices
};

struct FillCounts {
    std::uint64_t runs = 0;  // needed; above the capacity nothing was filled, and all but the hull's is 0
    HullCounts hull;
    std::uint64_t filled_cells = 0;
    std::uint32_t filled_regions = 0;
    std::uint64_t refused_cells = 0;  // of regions with too small a share
    std::uint32_t refused_regions = 0;
    std::uint64_t unreached_cells = 0;  // unknown, in the hull, but with no way to a seen cell
};

// Unknown cells become filled when they lie in the convex hull of the seen cells and the extra points, and
// are reached from a seen cell through unknown cells of the hull, side by side, without crossing a blocked
// one; and when their region passes least_border_share. Filled cells of an earlier call count as unknown, so
// that filling twice is filling once. A grid without seen cells gets nothing filled.
// Such a flood is a choice among the components of the unknown cells in the hull: those that touch a seen
// cell. So it needs no queue, and its memory is bounded by the runs.
FillCounts fill_missing(const CellGrid& grid, const FillOptions& options, const FillScratch& scratch);

// Unknown cells between seen or filled ones become filled. A run of unknown cells along a row, a column or a
// diagonal, no longer than `longest` cells (of 1.4 cells' length on a diagonal), tells for its cells when
// such cells end it at both sides, and half as much when one of its ends is a cell where another plane meets
// this one; blocked cells and the border of the grid tell nothing. A cell is filled when what tells for it
// adds up to one run. No hull is drawn, so the arms of a room that is an L, or what lies beyond a wall, do
// not come together. Returns how many cells were filled. scratch: a byte a cell.
std::uint64_t fill_between(const CellGrid& grid, int longest, std::uint8_t* scratch);

}  // namespace burin
