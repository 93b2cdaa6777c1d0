// SPDX-License-Identifier: MIT
#include "planes/outline.h"

#include <algorithm>

namespace burin {
namespace {

// What a byte of the scratch grid says: of its cell, and of the ring along the cell's left side.
enum Mark : std::uint8_t {
    kInside = 1,
    kTraced = 2,         // a ring was traced along that side
    kHole = 4,           // and it is a hole
    kDropped = 8,        // and it is dropped, or lies in one that is
    kParentDropped = 16  // the ring around it is dropped
};

struct Step {
    int du, dv;
};
constexpr Step kSteps[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};  // right, up, left, down: a left turn is + 1

struct RingSize {
    std::int64_t cells = 0;  // signed area
    std::uint64_t points = 0;
};

// The region with a rim of one cell all around, so that no step asks for the border.
struct Tracer {
    std::uint8_t* marks;
    std::ptrdiff_t stride;

    std::ptrdiff_t index(int u, int v) const { return (v + 1) * stride + u + 1; }

    // Walks the ring that leaves corner (u, v) in the given direction, with the region at its left. Where the
    // region touches itself at a corner it turns left, staying with its own cell. Calls point(u, v) at every
    // turn, and side(byte) for every vertical side, with the byte of the cell at its right. A ring must begin
    // where it turns.
    template <class Point, class Side>
    RingSize walk(int u, int v, int direction, Point&& point, Side&& side) const {
        // A corner's own byte is that of the cell up and right of it; seen from there, the cells ahead of the
        // four directions.
        const std::ptrdiff_t ahead_left[4] = {0, -1, -1 - stride, -stride};
        const std::ptrdiff_t ahead_right[4] = {-stride, 0, -1, -1 - stride};
        const std::ptrdiff_t moves[4] = {1, stride, -1, -stride};
        RingSize size;
        std::uint8_t* at = marks + index(u, v);
        std::uint8_t* const start = at;
        const int start_direction = direction;
        int came = -1;
        do {
            if (direction != came) {
                point(u, v);
                ++size.points;
                came = direction;
            }
            if (direction == 1) {
                side(*at);
                size.cells += u;  // area = integral of u dv
            }
            at += moves[direction];
            u += kSteps[direction].du;
            v += kSteps[direction].dv;
            if (direction == 3) {
                side(*at);
                size.cells -= u;
            }
            if (!(at[ahead_left[direction]] & kInside))
                direction = (direction + 1) & 3;
            else if (at[ahead_right[direction]] & kInside)
                direction = (direction + 3) & 3;
        } while (at != start || direction != start_direction);
        return size;
    }
};

}  // namespace

OutlineCounts trace_outline(const CellGrid& grid, const OutlineOptions& options, const Outline& out,
                            std::uint8_t* scratch) {
    OutlineCounts counts;
    const int width = grid.width, height = grid.height;
    if (width <= 0 || height <= 0) return counts;
    const Tracer tracer{scratch, width + 2};
    std::memset(scratch, 0, outline_bytes(width, height));
    for (int v = 0; v < height; ++v) {
        const std::uint8_t* cells = grid.row(v);
        std::uint8_t* marks = scratch + tracer.index(0, v);
        for (int u = 0; u < width; u += 8) {
            const auto here = static_cast<std::size_t>(std::min(8, width - u));
            std::uint64_t eight = 0;
            std::memcpy(&eight, cells + u, here);
            eight = cells_of(eight, options.mask);
            std::memcpy(marks + u, &eight, here);
        }
    }
    bool fits = true;
    std::uint64_t written = 0;
    for (int v = 0; v < height; ++v) {
        const std::uint8_t* row = scratch + tracer.index(0, v);
        std::uint8_t last = 0;  // the ring along the nearest side to the left
        for (int u = 0; u <= width; ++u) {
            if (!((row[u] ^ row[u - 1]) & kInside)) continue;
            if (row[u] & kTraced) {
                last = row[u];
                continue;
            }
            // An island's lowest left side has its cell at the right, a hole's at the left; at its low end
            // both turn: the island to the right, the hole upwards. What the ring lies in follows from the
            // ring to the left as in Suzuki & Abe 1985, table 1: of the same kind they are siblings, else
            // that one is around this one.
            const bool hole = !(row[u] & kInside);
            const bool sibling = (last & kTraced) && hole == ((last & kHole) != 0);
            const bool parent_dropped = last & (sibling ? kParentDropped : kDropped);
            const int direction = hole ? 1 : 0;
            const RingSize size = tracer.walk(
                u, v, direction, [](int, int) {}, [](std::uint8_t&) {});
            const std::int64_t cells = hole ? -size.cells : size.cells;
            const bool dropped =
                parent_dropped || cells < (hole ? options.min_hole_cells : options.min_island_cells);
            const int mark = kTraced | (hole ? kHole : 0) | (dropped ? kDropped : 0) |
                             (parent_dropped ? kParentDropped : 0);
            fits = fits && (dropped || (counts.rings < out.ring_capacity &&
                                        written + size.points <= out.point_capacity));
            const bool write = fits && !dropped;
            if (write)
                out.rings[counts.rings] = {static_cast<std::uint32_t>(written),
                                           static_cast<std::uint32_t>(size.points), hole, cells};
            tracer.walk(
                u, v, direction,
                [&](int pu, int pv) {
                    if (write) out.points[written++] = {pu, pv};
                },
                [&](std::uint8_t& side) { side = static_cast<std::uint8_t>(side | mark); });
            if (!dropped) {
                ++counts.rings;
                counts.points += size.points;
                counts.longest = std::max(counts.longest, size.points);
            }
            last = row[u];
        }
    }
    return counts;
}

std::int64_t twice_area(const CellPoint* points, std::uint32_t count) {
    std::int64_t twice = 0;
    for (std::uint32_t i = 0, before = count - 1; i < count; before = i++)
        twice += std::int64_t{points[before].u} * points[i].v - std::int64_t{points[i].u} * points[before].v;
    return twice;
}

std::int64_t twice_area(const Outline& outline, const OutlineCounts& counts) {
    std::int64_t twice = 0;
    for (std::uint64_t r = 0; r < counts.rings; ++r)
        twice += twice_area(outline.points + outline.rings[r].first, outline.rings[r].count);
    return twice;
}

bool in_rings(const Outline& outline, const OutlineCounts& counts, double u, double v) {
    bool inside = false;
    for (std::uint64_t r = 0; r < counts.rings; ++r) {
        const CellPoint* points = outline.points + outline.rings[r].first;
        const std::uint32_t count = outline.rings[r].count;
        for (std::uint32_t i = 0, before = count - 1; i < count; before = i++) {
            CellPoint a = points[before], b = points[i];
            if ((a.v <= v) == (b.v <= v)) continue;
            if (a.v > b.v) std::swap(a, b);
            // The side crosses the height of the point at or left of it.
            if ((u - a.u) * (b.v - a.v) >= (v - a.v) * (b.u - a.u)) inside = !inside;
        }
    }
    return inside;
}

void fill_rings(const Outline& outline, const OutlineCounts& counts, const CellGrid& grid, Cell inside) {
    const int width = grid.width, height = grid.height;
    if (width <= 0 || height <= 0) return;
    std::memset(grid.cells, 0, static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    // First a 1 toggled in every cell that is the first with its centre at or right of a side; then along the
    // row, whatever has an odd number of them up to it is inside.
    for (std::uint64_t r = 0; r < counts.rings; ++r) {
        const CellPoint* points = outline.points + outline.rings[r].first;
        const std::uint32_t count = outline.rings[r].count;
        for (std::uint32_t i = 0, before = count - 1; i < count; before = i++) {
            CellPoint a = points[before], b = points[i];
            if (a.v == b.v) continue;
            if (a.v > b.v) std::swap(a, b);
            const std::int64_t du = b.u - a.u, dv = b.v - a.v;
            for (int v = std::max(a.v, 0); v < std::min(b.v, height); ++v) {
                // u + 1/2 >= a.u + du * (v + 1/2 - a.v) / dv, rounded up to whole u.
                const std::int64_t over = du * (2 * (v - a.v) + 1) - dv, under = 2 * dv;
                const std::int64_t u = a.u + over / under + (over % under > 0 ? 1 : 0);
                if (u < width) grid.row(v)[std::max<std::int64_t>(u, 0)] ^= 1;
            }
        }
    }
    for (int v = 0; v < height; ++v) {
        std::uint8_t* row = grid.row(v);
        std::uint8_t odd = 0;
        for (int u = 0; u < width; ++u) {
            odd ^= row[u];
            row[u] = odd ? inside : kCellUnknown;
        }
    }
}

}  // namespace burin
