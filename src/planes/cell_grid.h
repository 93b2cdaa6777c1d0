// SPDX-License-Identifier: MIT
// The extent of a plane: a dense grid of square cells in the plane, and what is done to it in whole passes.
// Everything here is integers in the caller's memory, and one thread's work.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

namespace burin {

enum Cell : std::uint8_t {
    kCellUnknown = 0,
    kCellSeen = 1,
    kCellBlocked = 2,  // known to be no part of the plane: free space, or another surface in front
    kCellFilled = 3,   // not seen, completed by fill_missing() or fill_between()
    kCellMeets = 4,    // the plane ends here, at another that was seen
};

// A set of kinds of cells: bit k is kind k.
using CellMask = std::uint8_t;
constexpr CellMask mask_of(Cell kind) { return static_cast<CellMask>(1u << kind); }

// Row v is at cells + v * width, column u in it. At most 2^30 cells, so that twice an area, and a product of
// two sides, have 32 bits. A grid of no cells is valid.
struct CellGrid {
    std::uint8_t* cells = nullptr;  // width * height
    int width = 0, height = 0;

    std::uint8_t* row(int v) const { return cells + static_cast<std::size_t>(v) * width; }
};

// A cell, or with the outline a corner of cells: corner (u, v) is the low corner of cell (u, v).
struct CellPoint {
    std::int32_t u = 0, v = 0;
};

// ---- Closing

constexpr int kMaxClosingRadius =
    8;  // the largest gap that is closed has 16 cells; bits move less than a word

// Words that close_seen() needs.
constexpr std::size_t closing_words(int width, int height, int radius) {
    return (static_cast<std::size_t>(width) + 2u * static_cast<unsigned>(radius) + 63) / 64 *
           (static_cast<std::size_t>(height) + 2u * static_cast<unsigned>(radius));
}

// Morphological closing of the seen cells by a square of 2 * radius + 1 cells, radius 1..kMaxClosingRadius:
// an unknown cell becomes seen when every such square that covers it holds a seen cell. Blocked and filled
// cells stay as they are, and count as not seen; they do not keep seen cells at their two sides apart.
// At the border the grid counts as a piece of an endless plane whose other cells are unknown: nothing is
// drawn towards the border, and in a larger grid the same cells are closed. A second closing changes nothing.
// Returns how many cells became seen.
// scratch: closing_words(width, height, radius) words.
std::uint64_t close_seen(const CellGrid& grid, int radius, std::uint64_t* scratch);

// ---- Convex hull

struct HullCounts {
    std::uint64_t cells = 0;           // in the hull
    std::uint32_t points_outside = 0;  // of the extra points: outside the grid and left out
};

// Convex hull of the cells of `mask` and of `count` extra cells (may be null when 0): a cell belongs to it
// when its centre lies within the hull of their centres. Row v of the hull is columns spans[2 * v] ..
// spans[2 * v + 1], both included; it has none when the first is above the last. Extra points outside the
// grid are counted and left out, since the row that they would draw the hull to does not exist.
// spans: 2 * height. scratch: height.
HullCounts convex_hull(const CellGrid& grid, CellMask mask, const CellPoint* points, std::uint32_t count,
                       std::int32_t* spans, std::int32_t* scratch);

// ---- Connected components

// A maximal run of cells along a row, and the component (4-connected) that it belongs to.
struct CellRun {
    std::int32_t row, first, last;  // columns, both included
    std::uint32_t root;             // the component's first run
    std::uint32_t cells;            // of the component, at its first run; 0 at others
    // Sides of cells on the component's boundary, and those of them that touch seen cells; at its first run,
    // and only after fill_missing().
    std::uint32_t border, seen_border;
};

// What find_components() can need at most: every second cell of every row.
constexpr std::uint64_t max_runs(int width, int height) {
    return static_cast<std::uint64_t>(height) * ((static_cast<std::uint64_t>(width) + 1) / 2);
}

struct ComponentCounts {
    std::uint64_t runs = 0;        // needed; above the capacity nothing else was done
    std::uint32_t components = 0;  // all that follows is 0 then
    std::uint32_t largest = 0;     // cells
    std::uint32_t removed = 0;     // components
    std::uint64_t removed_cells = 0;
};

// Components of the cells of `mask`, of those within spans (as of convex_hull) where spans is not null. Two
// passes with union-find over runs; a component's root is its first run in row order, so the result has no
// order to depend on.
// runs: capacity; max_runs(width, height) always suffices, runs as counted by a first call (with capacity 0
// it may be null) always do for the same grid.
ComponentCounts find_components(const CellGrid& grid, CellMask mask, const std::int32_t* spans, CellRun* runs,
                                std::uint64_t capacity);

// Cells of components smaller than min_cells become unknown. runs: as find_components; above the capacity the
// grid is left as it is.
ComponentCounts remove_small_components(const CellGrid& grid, CellMask mask, std::uint32_t min_cells,
                                        CellRun* runs, std::uint64_t capacity);

// ---- Eight cells at once

static_assert(std::endian::native == std::endian::little, "byte i of a word is cell i of eight");

// Byte i is 1 where byte i of `eight` (kinds 0..4) is of the mask.
constexpr std::uint64_t cells_of(std::uint64_t eight, CellMask mask) {
    constexpr std::uint64_t kOnes = 0x0101010101010101u;
    const auto all = [mask](int kind) { return std::uint64_t{0} - (mask >> kind & 1u); };
    const std::uint64_t low = eight & kOnes, high = eight >> 1 & kOnes;
    const std::uint64_t not_low = low ^ kOnes, not_high = high ^ kOnes, four = eight >> 2 & kOnes;
    return (four & all(4)) | ((four ^ kOnes) & ((not_high & ((not_low & all(0)) | (low & all(1)))) |
                                                (high & ((not_low & all(2)) | (low & all(3))))));
}

// Bit i is set where cell i of n, 1..64, is of the mask.
inline std::uint64_t cell_bits(const std::uint8_t* cells, int n, CellMask mask) {
    // Of the product of eight bytes of 0 or 1, the highest byte is their bits: byte i moves by 56 - 7 * i.
    constexpr std::uint64_t kGather = 0x0102040810204080u;
    std::uint64_t bits = 0;
    for (int i = 0; i < n; i += 8) {
        std::uint64_t eight = 0;
        const int here = n - i < 8 ? n - i : 8;
        std::memcpy(&eight, cells + i, here == 8 ? 8u : static_cast<std::size_t>(here));
        const std::uint64_t eight_bits = cells_of(eight, mask) * kGather >> 56;
        bits |= (here == 8 ? eight_bits : eight_bits & ((1u << here) - 1)) << i;
    }
    return bits;
}

// Calls run(first, last) for every maximal run of cells of the mask within columns first .. last of a row,
// from left to right.
template <class Run>
void for_each_run(const std::uint8_t* row, int first, int last, CellMask mask, Run&& run) {
    int start = -1;
    for (int u = first; u <= last; u += 64) {
        const int n = last - u + 1 < 64 ? last - u + 1 : 64;
        const std::uint64_t bits = cell_bits(row + u, n, mask);
        for (int i = 0; i < n;) {
            if (start < 0) {
                if (bits >> i == 0) break;
                i += std::countr_zero(bits >> i);
                start = u + i;
            }
            if (~bits >> i == 0) break;  // on to the end of the word
            i += std::countr_zero(~bits >> i);
            if (i >= n) break;
            run(start, u + i - 1);
            start = -1;
        }
    }
    if (start >= 0) run(start, last);
}

}  // namespace burin
