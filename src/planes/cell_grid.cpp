// SPDX-License-Identifier: MIT
#include "planes/cell_grid.h"

#include <algorithm>

namespace burin {
namespace {

// Bit i of the row becomes the union (kAll: the intersection) of bits i .. i + length - 1, in place; beyond
// the row are zeros. Doubling: windows of 1, 2, 4, ... and a last step of what is left.
template <bool kAll>
void widen_row(std::uint64_t* row, std::size_t words, int length) {
    const auto step = [&](int shift) {
        for (std::size_t k = 0; k < words; ++k) {
            const std::uint64_t next = k + 1 < words ? row[k + 1] : 0;
            const std::uint64_t moved = row[k] >> shift | next << (64 - shift);
            row[k] = kAll ? row[k] & moved : row[k] | moved;
        }
    };
    int window = 1;
    for (; 2 * window <= length; window *= 2) step(window);
    if (window < length) step(length - window);
}

// The same along columns: row v from rows v .. v + length - 1.
template <bool kAll>
void widen_columns(std::uint64_t* bits, std::size_t words, std::size_t rows, int length) {
    const auto step = [&](int shift) {
        const std::size_t beyond = static_cast<std::size_t>(shift) * words;
        const std::size_t all = rows * words, both = all > beyond ? all - beyond : 0;
        for (std::size_t k = 0; k < both; ++k)
            bits[k] = kAll ? bits[k] & bits[k + beyond] : bits[k] | bits[k + beyond];
        if (kAll) std::fill(bits + both, bits + all, std::uint64_t{0});
    };
    int window = 1;
    for (; 2 * window <= length; window *= 2) step(window);
    if (window < length) step(length - window);
}

// Rounded up; the divisor is above 0.
std::int64_t divide_up(std::int64_t a, std::int64_t b) { return a / b + (a % b > 0 ? 1 : 0); }

// One side of the hull: the convex chain (Andrew's monotone chain, 1979) through the leftmost cells of the
// rows, and from it the first column of every row between. The right side is the left one mirrored.
struct HullSide {
    std::int32_t* spans;
    int side;  // 0 left, 1 right

    std::int64_t at(int v) const { return side == 0 ? spans[2 * v] : -std::int64_t{spans[2 * v + 1]}; }
    // Whether b lies on the line from a to c or beyond it, seen from outside.
    bool within(int a, int b, int c) const { return (at(b) - at(a)) * (c - a) >= (at(c) - at(a)) * (b - a); }
    template <class Has>
    void run(int low, int high, std::int32_t* stack, Has&& has) const {
        int depth = 0;
        for (int v = low; v <= high; ++v) {
            if (!has(v)) continue;
            while (depth >= 2 && within(stack[depth - 2], stack[depth - 1], v)) --depth;
            stack[depth++] = v;
        }
        for (int i = 0; i + 1 < depth; ++i) {
            const int a = stack[i], b = stack[i + 1];
            const std::int64_t from = at(a), over = at(b) - from;
            for (int v = a + 1; v < b; ++v) {
                const std::int64_t u = from + divide_up(over * (v - a), b - a);
                spans[2 * v + side] = static_cast<std::int32_t>(side == 0 ? u : -u);
            }
        }
    }
};

std::uint32_t root_of(CellRun* runs, std::uint32_t i) {
    while (runs[i].root != i) {
        runs[i].root = runs[runs[i].root].root;  // path halving
        i = runs[i].root;
    }
    return i;
}

void join(CellRun* runs, std::uint32_t i, std::uint32_t k) {
    const std::uint32_t a = root_of(runs, i), b = root_of(runs, k);
    if (a < b) runs[b].root = a;
    if (b < a) runs[a].root = b;
}

}  // namespace

std::uint64_t close_seen(const CellGrid& grid, int radius, std::uint64_t* scratch) {
    if (grid.width <= 0 || grid.height <= 0) return 0;
    const int width = grid.width, height = grid.height, length = 2 * radius + 1;
    const std::size_t words = (static_cast<std::size_t>(width) + 2 * radius + 63) / 64;
    const std::size_t rows = static_cast<std::size_t>(height) + 2 * radius;
    // Both windows begin at their bit and look ahead, so the seen cells start out 2 * radius further up, and
    // the closed ones end in their own places. Rows and words beyond hold nothing that dilation reaches.
    std::fill(scratch, scratch + words * rows, std::uint64_t{0});
    const int shift = 2 * radius;
    for (int v = 0; v < height; ++v) {
        std::uint64_t* row = scratch + (static_cast<std::size_t>(v) + shift) * words;
        for (int u = 0; u < width; u += 64) {
            const std::uint64_t bits =
                cell_bits(grid.row(v) + u, std::min(64, width - u), mask_of(kCellSeen));
            const std::size_t k = static_cast<std::size_t>(u) / 64;
            row[k] |= bits << shift;
            if (k + 1 < words) row[k + 1] |= bits >> (64 - shift);
        }
        widen_row<false>(row, words, length);
    }
    widen_columns<false>(scratch, words, rows, length);
    widen_columns<true>(scratch, words, rows, length);
    std::uint64_t closed = 0;
    for (int v = 0; v < height; ++v) {
        std::uint64_t* row = scratch + static_cast<std::size_t>(v) * words;
        widen_row<true>(row, words, length);
        for (int u = 0; u < width; u += 64) {
            std::uint8_t* cells = grid.row(v) + u;
            std::uint64_t bits =
                row[u / 64] & cell_bits(cells, std::min(64, width - u), mask_of(kCellUnknown));
            closed += static_cast<unsigned>(std::popcount(bits));
            for (; bits; bits &= bits - 1) cells[std::countr_zero(bits)] = kCellSeen;
        }
    }
    return closed;
}

HullCounts convex_hull(const CellGrid& grid, CellMask mask, const CellPoint* points, std::uint32_t count,
                       std::int32_t* spans, std::int32_t* scratch) {
    HullCounts counts;
    const int width = grid.width, height = grid.height;
    for (int v = 0; v < height; ++v) {
        std::int32_t first = width, last = -1;
        for (int u = 0; u < width && first == width; u += 64) {
            const std::uint64_t bits = cell_bits(grid.row(v) + u, std::min(64, width - u), mask);
            if (bits) first = u + std::countr_zero(bits);
        }
        for (int end = width; end > first && last < 0; end -= 64) {
            const int begin = std::max(first, end - 64);
            const std::uint64_t bits = cell_bits(grid.row(v) + begin, end - begin, mask);
            if (bits) last = begin + 63 - std::countl_zero(bits);
        }
        spans[2 * v] = first;
        spans[2 * v + 1] = last;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
        const CellPoint p = points[i];
        if (p.u < 0 || p.u >= width || p.v < 0 || p.v >= height) {
            ++counts.points_outside;
            continue;
        }
        spans[2 * p.v] = std::min(spans[2 * p.v], p.u);
        spans[2 * p.v + 1] = std::max(spans[2 * p.v + 1], p.u);
    }
    int low = 0, high = height - 1;
    while (low <= high && spans[2 * low + 1] < 0) ++low;
    while (high > low && spans[2 * high + 1] < 0) --high;
    // An empty row is told by the side that is not yet filled in.
    HullSide{spans, 0}.run(low, high, scratch, [&](int v) { return spans[2 * v] < width; });
    HullSide{spans, 1}.run(low, high, scratch, [&](int v) { return spans[2 * v + 1] >= 0; });
    for (int v = low; v <= high; ++v)
        counts.cells += static_cast<std::uint64_t>(std::max(0, spans[2 * v + 1] - spans[2 * v] + 1));
    return counts;
}

ComponentCounts find_components(const CellGrid& grid, CellMask mask, const std::int32_t* spans, CellRun* runs,
                                std::uint64_t capacity) {
    ComponentCounts counts;
    std::uint64_t below = 0, below_end = 0;  // the runs of the row below
    for (int v = 0; v < grid.height; ++v) {
        const std::uint64_t begin = counts.runs;
        for_each_run(grid.row(v), spans ? spans[2 * v] : 0, spans ? spans[2 * v + 1] : grid.width - 1, mask,
                     [&](std::int32_t first, std::int32_t last) {
                         const std::uint64_t i = counts.runs++;
                         if (i >= capacity) return;
                         runs[i] = {v, first, last, static_cast<std::uint32_t>(i), 0, 0, 0};
                         while (below < below_end && runs[below].last < first) ++below;
                         for (std::uint64_t k = below; k < below_end && runs[k].first <= last; ++k)
                             join(runs, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(k));
                     });
        below = std::min(begin, capacity);
        below_end = std::min(counts.runs, capacity);
    }
    if (counts.runs > capacity) return counts;
    // A root comes before all others of its component, so its own root is final when they ask.
    for (std::uint64_t i = 0; i < counts.runs; ++i) {
        CellRun& run = runs[i];
        run.root = runs[run.root].root;
        CellRun& root = runs[run.root];
        if (&root == &run) ++counts.components;
        root.cells += static_cast<std::uint32_t>(run.last - run.first + 1);
        counts.largest = std::max(counts.largest, root.cells);
    }
    return counts;
}

ComponentCounts remove_small_components(const CellGrid& grid, CellMask mask, std::uint32_t min_cells,
                                        CellRun* runs, std::uint64_t capacity) {
    ComponentCounts counts = find_components(grid, mask, nullptr, runs, capacity);
    if (counts.runs > capacity) return counts;
    for (std::uint64_t i = 0; i < counts.runs; ++i) {
        const CellRun& run = runs[i];
        if (runs[run.root].cells >= min_cells) continue;
        if (run.root == i) ++counts.removed;
        const std::size_t cells = static_cast<std::size_t>(run.last) - run.first + 1;
        counts.removed_cells += cells;
        std::memset(grid.row(run.row) + run.first, kCellUnknown, cells);
    }
    return counts;
}

}  // namespace burin
