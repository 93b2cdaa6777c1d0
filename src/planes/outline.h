// SPDX-License-Identifier: MIT
// Outline of a region of cells: closed rings along the corners of cells, exact or simplified.
#pragma once

#include "planes/cell_grid.h"

namespace burin {

// A closed ring: its last point joins its first, which is not repeated. The region lies at its left: islands
// run counter-clockwise (u right, v up), holes clockwise.
struct OutlineRing {
    std::uint32_t first = 0, count = 0;  // points
    bool hole = false;
    std::int64_t cells = 0;  // enclosed, with whatever lies inside; exact, also of a simplified ring
};

struct Outline {                  // caller's memory
    CellPoint* points = nullptr;  // corners of cells
    std::uint64_t point_capacity = 0;
    OutlineRing* rings = nullptr;
    std::uint64_t ring_capacity = 0;
};

struct OutlineCounts {
    std::uint64_t points = 0, rings = 0;  // needed
    std::uint64_t longest = 0;            // points of the longest ring
};

struct OutlineOptions {
    CellMask mask = mask_of(kCellSeen);
    // Rings that enclose fewer cells are dropped, and with a ring everything inside it: a hole that is closed
    // takes the islands in it along. 0 keeps all.
    std::int64_t min_island_cells = 0, min_hole_cells = 0;
};

// Bytes that trace_outline() needs.
constexpr std::size_t outline_bytes(int width, int height) {
    return (static_cast<std::size_t>(width) + 2) * (static_cast<std::size_t>(height) + 2);
}

// The exact rings, one point where a ring turns. Cells belong together through their sides: two that touch at
// a corner only are two islands, and the rings meet in a point there. Rings come in the order of their lowest
// cells, the leftmost of the lowest row first, and begin with its low left corner.
// Returns what is needed. A ring whose points or place do not fit is left out, with all that follow, so when
// the counts are above the capacities, give more and call again; with no capacities the pointers may be null.
// scratch: outline_bytes(width, height).
OutlineCounts trace_outline(const CellGrid& grid, const OutlineOptions& options, const Outline& out,
                            std::uint8_t* scratch);

// Simplifies exact rings in place (the counts must have fitted the capacities), by Douglas & Peucker (1973)
// with a tolerance in cells: no point that is left out is further than that from the side that replaces it.
// Every ring keeps three points at least and its direction; one that would lose its direction or its area
// stays exact. A side can come to cross another where the region is narrower than twice the tolerance; areas
// and the even-odd rule hold for such rings too. Ring starts move, since points close up. Returns the new
// counts. scratch: counts.longest bytes.
OutlineCounts simplify_outline(const Outline& outline, const OutlineCounts& counts, double tolerance,
                               std::uint8_t* scratch);

// Twice the area in cells, above 0 when counter-clockwise.
std::int64_t twice_area(const CellPoint* points, std::uint32_t count);
// Of all rings: islands less holes.
std::int64_t twice_area(const Outline& outline, const OutlineCounts& counts);

// Even-odd over all rings. The centre of cell (u, v) is (u + 0.5, v + 0.5). A point on a side counts as on
// the side's right (towards +u). Costs a pass over all points: for many questions see fill_rings().
bool in_rings(const Outline& outline, const OutlineCounts& counts, double u, double v);

// The same for all cells at once, in integers: cells whose centres lie in the rings become `inside`, the
// others kCellUnknown. Rings may reach beyond the grid. Costs about a pass over the cells.
void fill_rings(const Outline& outline, const OutlineCounts& counts, const CellGrid& grid, Cell inside);

}  // namespace burin
