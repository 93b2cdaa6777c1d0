// SPDX-License-Identifier: MIT
#include "planes/extents.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "planes/plane_layer.h"

namespace burin {
namespace {

constexpr int kCloseCells = 2;  // gaps of up to 4 cells: noise, and planes between two layers of voxels
constexpr double kLeastIslandM2 = 0.002;  // 45 x 45 mm: smaller islands are crumbs
constexpr double kLeastHoleM2 = 0.0025;   // 50 x 50 mm: smaller holes are no feature of an outline
constexpr double kTolerance = 1.5;        // cells that a simplified outline may be off
constexpr int kBehindCells = 8;           // depth of the barrier where planes cross
constexpr float kRimShare = 0.3f, kCrumbShare = 0.9f;  // of a hole's boundary that has to be seen
constexpr double kLargeHoleM2 = 4;  // a bed hides so much; larger ones are closed only when nearly enclosed
constexpr float kLargeShare = 0.7f;
constexpr double kMeetingM = 0.3;  // metres: planes that end no farther from where they meet are drawn to it

// A row of wardrobes hides 4 m of a wall; across more nothing is taken to go on.
constexpr double kLongestM = 4;
constexpr int kPasses = 2;  // the second smooths the rims that the first one leaves ragged
// Filling writes voxels up to kFillBehind and kFillBefore layers from the plane (plane_describe.cpp).
constexpr int kFillBehind = 3, kFillBefore = 6;
// Voxels; deeper inside something no surface of it is near, so that its distances may give way.
constexpr float kSureInside = 2.5f;

bool beside_filled(const CellGrid& grid, int u, int v) {
    for (int y = std::max(0, v - 1); y <= std::min(grid.height - 1, v + 1); ++y)
        for (int x = std::max(0, u - 1); x <= std::min(grid.width - 1, u + 1); ++x)
            if (grid.row(y)[x] == kCellFilled) return true;
    return false;
}

}  // namespace

Vec3d ExtentGrid::point(double u, double v) const {
    Vec3d x;
    x[across] = (u0 + u) * cell_m;
    x[along] = (v0 + v) * cell_m;
    x[axis] = -(offset + normal[across] * x[across] + normal[along] * x[along]) / normal[axis];
    return x;
}

std::uint64_t ExtentGrid::seen_cells() const {
    const std::uint8_t *begin = grid.cells, *end = begin + static_cast<std::size_t>(grid.width) * grid.height;
    return static_cast<std::uint64_t>(std::count(begin, end, std::uint8_t{kCellSeen}));
}

double ExtentGrid::cell_area() const { return cell_m * cell_m / std::fabs(normal[axis]); }

void PlaneExtents::place(Arena& arena, const VolumeShape& shape) {
    voxel_m_ = static_cast<double>(shape.voxel_m);
    cells_ = arena.allocate<std::uint8_t>(kCells, 64);
    trace_ = arena.allocate<std::uint8_t>(kCells + 4 * kSide + 8, 64);
    // Closing pads each side by its radius and rows to whole words: for the longest and thinnest grid.
    words_ = arena.allocate<std::uint64_t>(kCells / 64 + 8 * kSide, 64);
    runs_ = arena.allocate<CellRun>(kRuns, 64);
    points_ = arena.allocate<CellPoint>(kPoints, 64);
    rings_ = arena.allocate<OutlineRing>(kRings, 64);
    meetings_ = arena.allocate<CellPoint>(kMeetings, 64);
    spans_ = arena.allocate<std::int32_t>(2 * kSide, 64);
    chain_ = arena.allocate<std::int32_t>(kSide, 64);
}

FootprintMemory PlaneExtents::lend() {
    static_assert(sizeof(CellRun) % sizeof(std::uint32_t) == 0 && kRuns * sizeof(CellRun) / 4 <= kCells);
    return {cells_, trace_, reinterpret_cast<std::uint32_t*>(runs_), kRuns * sizeof(CellRun) / 4};
}

bool PlaneExtents::raster(const Overlay& overlay, const ChunkPlanes* chunks, const PlaneSet& set,
                          std::uint16_t plane, ExtentGrid* out) {
    const GlobalPlane& p = set.at(plane);
    out->normal = p.normal;
    out->offset = p.offset;
    const Axes axes(p.normal);
    out->axis = axes.axis;
    out->across = axes.first;
    out->along = axes.second;
    const auto for_patches = [&](auto&& body) {
        for (std::uint32_t entry = 0; entry < overlay.count(); ++entry)
            for (int i = 0; i < chunks[entry].count; ++i)
                if (chunks[entry].patch[i].plane == plane)
                    body(unpack_key(overlay.key(entry)), chunks[entry].patch[i]);
    };
    std::int32_t low[2] = {INT32_MAX, INT32_MAX}, high[2] = {INT32_MIN, INT32_MIN};  // chunks
    for_patches([&](Vec3i c, const Patch&) {
        low[0] = std::min(low[0], c[out->across]), high[0] = std::max(high[0], c[out->across]);
        low[1] = std::min(low[1], c[out->along]), high[1] = std::max(high[1], c[out->along]);
    });
    if (low[0] > high[0]) return false;
    // Room around it, so that it can be drawn to where it meets others.
    const int margin = 1 + static_cast<int>(kMeetingM / (kChunkSide * voxel_m_));
    const std::int64_t wide = std::int64_t{high[0]} - low[0] + 1 + 2 * margin,
                       tall = std::int64_t{high[1]} - low[1] + 1 + 2 * margin;
    int shift = 0;  // step = 1 << shift
    while (shift < 3 && ((wide * 8 >> shift) * (tall * 8 >> shift) > kCells ||
                         (wide * 8 >> shift) > kSide - 8 || (tall * 8 >> shift) > kSide - 8))
        ++shift;
    if ((wide * 8 >> shift) * (tall * 8 >> shift) > kCells || (wide * 8 >> shift) > kSide - 8 ||
        (tall * 8 >> shift) > kSide - 8)
        return false;  // 800 m^2 at 5 mm
    out->step = 1 << shift;
    out->cell_m = out->step * voxel_m_;
    out->u0 = (low[0] - margin) * 8 >> shift;
    out->v0 = (low[1] - margin) * 8 >> shift;
    out->grid = {cells_, static_cast<int>(wide * 8 >> shift), static_cast<int>(tall * 8 >> shift)};
    std::memset(cells_, kCellUnknown, static_cast<std::size_t>(out->grid.width) * out->grid.height);
    for_patches([&](Vec3i c, const Patch& patch) {
        for (std::uint64_t left = patch.cells; left != 0; left &= left - 1) {
            const int bit = std::countr_zero(left);
            Vec3i x{c.x * 8, c.y * 8, c.z * 8};
            const Axes seen(patch.axis);
            const int a = seen.first, b = seen.second;
            x[a] += bit & 7;
            x[b] += bit >> 3;
            if (patch.axis != out->axis) {
                // Seen along another axis than the plane's: the voxel of the column that the plane passes.
                const double at = -(p.offset + p.normal[a] * (x[a] + 0.5) * voxel_m_ +
                                    p.normal[b] * (x[b] + 0.5) * voxel_m_) /
                                  (p.normal[patch.axis] * voxel_m_);
                if (!(std::fabs(at) < 1e9)) continue;
                x[patch.axis] = static_cast<std::int32_t>(std::floor(at));
            }
            const int u = (x[out->across] >> shift) - out->u0, v = (x[out->along] >> shift) - out->v0;
            if (u >= 0 && v >= 0 && u < out->grid.width && v < out->grid.height)
                out->grid.row(v)[u] = kCellSeen;
        }
    });
    close_seen(out->grid, std::max(1, kCloseCells >> shift), words_);
    const double cell = out->cell_area();
    remove_small_components(out->grid, mask_of(kCellSeen), static_cast<std::uint32_t>(kLeastIslandM2 / cell),
                            runs_, kRuns);
    return true;
}

Outline PlaneExtents::outline(const ExtentGrid& g, CellMask mask, OutlineCounts* counts) {
    const Outline out{points_, kPoints, rings_, kRings};
    OutlineOptions options;
    options.mask = mask;
    options.min_island_cells = static_cast<std::int64_t>(kLeastIslandM2 / g.cell_area());
    options.min_hole_cells = static_cast<std::int64_t>(kLeastHoleM2 / g.cell_area());
    *counts = trace_outline(g.grid, options, out, trace_);
    // Too ragged for the room there is: the largest features only.
    while ((counts->points > kPoints || counts->rings > kRings) && options.min_hole_cells < INT32_MAX) {
        options.min_island_cells = 4 * options.min_island_cells + 4;
        options.min_hole_cells = 4 * options.min_hole_cells + 4;
        *counts = trace_outline(g.grid, options, out, trace_);
    }
    if (counts->points > kPoints || counts->rings > kRings) {
        *counts = {};
        return out;
    }
    *counts = simplify_outline(out, *counts, kTolerance, trace_);
    return out;
}

// Cells whose place on the plane was seen to be empty.
void PlaneExtents::block_empty(const Volume& volume, const ExtentGrid& g) const {
    // Behind a surface nothing was seen, whatever the distances there; in front of it everything was.
    // Seen aslant, a voxel on the plane may read up to three times its half voxel.
    const float empty = 2.5f * volume.voxel_m() / volume.units_to_m();
    ChunkKey last_key = 0;
    std::uint32_t slot = kNoChunk;
    for (int v = 0; v < g.grid.height; ++v)
        for (int u = 0; u < g.grid.width; ++u) {
            std::uint8_t& cell = g.grid.row(v)[u];
            if (cell != kCellUnknown) continue;
            Vec3i at;
            if (!voxel_at(g.point(u + 0.5, v + 0.5), voxel_m_, &at)) continue;
            const ChunkKey key = pack_key(chunk_of_voxel(at));
            if (key != last_key) {
                slot = volume.find(key);
                last_key = key;
            }
            if (slot == kNoChunk) continue;
            const int i = voxel_index(at);
            const ChunkGeometry& chunk = volume.geometry(slot);
            if (chunk.weight[i] > 0 && static_cast<float>(chunk.sdf[i]) > empty) cell = kCellBlocked;
        }
}

// Where another plane crosses this one, and was seen there, this one ends.
void PlaneExtents::block_crossing(const Overlay& overlay, const ChunkPlanes* chunks, const PlaneSet& set,
                                  std::uint16_t plane, const ExtentGrid& g) const {
    const double side = kChunkSide * voxel_m_;
    for (std::uint32_t q = 0; q < set.used(); ++q) {
        const GlobalPlane& other = set.at(q);
        if (q == plane || other.id == 0 || other.area_m2 < kLeastPlaneM2) continue;
        if (std::fabs(dot(other.normal, g.normal)) > 0.5) continue;  // steeper than 60 degrees
        // Along the direction in which the line of both is flatter, one cell a step.
        const Vec3d line = cross(other.normal, g.normal);
        const bool by_u = std::fabs(line[g.across]) >= std::fabs(line[g.along]);
        const int steps = by_u ? g.grid.width : g.grid.height;
        for (int i = 0; i < steps; ++i) {
            // other.normal . point(u, v) + other.offset is linear in u and v.
            const double f0 = other.distance(by_u ? g.point(i + 0.5, 0) : g.point(0, i + 0.5));
            const double f1 = other.distance(by_u ? g.point(i + 0.5, 1) : g.point(1, i + 0.5));
            if (!(std::fabs(f1 - f0) > 0)) continue;
            const double at = -f0 / (f1 - f0);
            if (!(at >= 0 && at < (by_u ? g.grid.height : g.grid.width))) continue;
            const Vec3d x = by_u ? g.point(i + 0.5, at) : g.point(at, i + 0.5);
            const Vec3i c{static_cast<std::int32_t>(std::floor(x.x / side)),
                          static_cast<std::int32_t>(std::floor(x.y / side)),
                          static_cast<std::int32_t>(std::floor(x.z / side))};
            bool seen = false;
            for (int n = 0; n < 27 && !seen; ++n) {
                const Vec3i b{c.x + n % 3 - 1, c.y + n / 3 % 3 - 1, c.z + n / 9 - 1};
                const std::uint32_t entry = chunk_in_range(b) ? overlay.find(pack_key(b)) : kNoChunk;
                if (entry == kNoChunk) continue;
                for (int k = 0; k < chunks[entry].count; ++k)
                    seen = seen || chunks[entry].patch[k].plane == q;
            }
            if (!seen) continue;
            // And some cells behind it: what was seen of this plane may reach a little past the line.
            const int away = f1 > f0 ? -1 : 1;
            for (int d = -1; d < kBehindCells; ++d) {
                const int w = static_cast<int>(at) + d * away;
                if (w < 0 || w >= (by_u ? g.grid.height : g.grid.width)) continue;
                std::uint8_t& cell = by_u ? g.grid.row(w)[i] : g.grid.row(i)[w];
                // From behind it tells nothing.
                if (cell == kCellUnknown || (cell == kCellMeets && d > 0))
                    cell = d > 0 ? kCellBlocked : kCellMeets;
            }
        }
    }
}

// Corners of what was seen that lie close to where the plane meets another are drawn there.
// spans_ holds the hull.
std::uint32_t PlaneExtents::meeting_points(const PlaneSet& set, std::uint16_t plane, const ExtentGrid& g) {
    std::uint32_t count = 0;
    for (std::uint32_t q = 0; q < set.used(); ++q) {
        const GlobalPlane& other = set.at(q);
        if (q == plane || other.id == 0 || other.area_m2 < kLeastPlaneM2) continue;
        const double cosine = dot(other.normal, g.normal);
        if (std::fabs(cosine) > 0.5) continue;
        const Vec3d within = other.normal - g.normal * cosine;  // steepest way to the other, in this plane
        const double slope = dot(within, within);
        for (int v = 0; v < g.grid.height; v += std::max(1, g.grid.height / 64))
            for (int end = 0; end < 2; ++end) {
                if (spans_[2 * v] > spans_[2 * v + 1]) break;
                const Vec3d x = g.point(spans_[2 * v + end] + 0.5, v + 0.5);
                const double distance = other.distance(x);
                if (!(distance > 0 && distance < kMeetingM)) continue;
                const Vec3d foot = x - within * (distance / slope);
                bool beside = true;  // the other was seen thereabouts
                for (int r = 0; r < 3; ++r)
                    beside =
                        beside && foot[r] > other.low[r] - kMeetingM && foot[r] < other.high[r] + kMeetingM;
                const int u = static_cast<int>(std::floor(foot[g.across] / g.cell_m)) - g.u0,
                          w = static_cast<int>(std::floor(foot[g.along] / g.cell_m)) - g.v0;
                if (!beside || u < 0 || w < 0 || u >= g.grid.width || w >= g.grid.height ||
                    count == kMeetings)
                    continue;
                meetings_[count++] = {u, w};
            }
    }
    return count;
}

// What is missing within the hull of what was seen.
void PlaneExtents::fill_hull(const PlaneSet& set, std::uint16_t plane, const ExtentGrid& g,
                             std::uint64_t hull_cells) {
    FillOptions options;
    options.hull_points = meetings_;
    options.hull_point_count = meeting_points(set, plane, g);
    // A plane of which most was seen is completed wherever some of the rim is its own; crumbs only within.
    options.least_border_share = 2 * g.seen_cells() >= hull_cells ? kRimShare : kCrumbShare;
    const FillCounts filled = fill_missing(g.grid, options, {spans_, chain_, runs_, kRuns});
    if (filled.runs > kRuns) return;
    // What is missing at large needs more of a reason.
    const auto large = static_cast<std::uint32_t>(kLargeHoleM2 / g.cell_area());
    for (std::uint64_t r = 0; r < filled.runs; ++r) {
        const CellRun &run = runs_[r], &region = runs_[run.root];
        if (region.cells <= large ||
            static_cast<float>(region.seen_border) >= kLargeShare * static_cast<float>(region.border))
            continue;
        for (int u = run.first; u <= run.last; ++u)
            if (std::uint8_t& cell = g.grid.row(run.row)[u]; cell == kCellFilled) cell = kCellUnknown;
    }
}

// Just behind other surfaces voxels hold distances that nobody measured. Where they are certain to be the
// inside of something thin, or what was measured itself, the plane would give it a back: such cells, and
// those beside them, are not filled.
void PlaneExtents::drop_closed_in(const Volume& volume, const ExtentGrid& g) const {
    const float voxel = volume.voxel_m() / volume.units_to_m();
    ChunkKey last_key = 0;
    std::uint32_t slot = kNoChunk;
    const auto closed_in = [&](Vec3d foot) {
        Vec3i at;
        if (!voxel_at(foot, voxel_m_, &at)) return false;
        const int layer = at[g.axis], up = g.normal[g.axis] > 0 ? 1 : -1;
        for (int k = -kFillBehind; k <= kFillBefore; ++k) {
            at[g.axis] = layer + k * up;
            const ChunkKey key = pack_key(chunk_of_voxel(at));
            if (key != last_key) {
                slot = volume.find(key);
                last_key = key;
            }
            if (slot == kNoChunk) continue;
            const ChunkGeometry& chunk = volume.geometry(slot);
            const int i = voxel_index(at);
            if (chunk.weight[i] == 0) continue;
            const float voxels = static_cast<float>(chunk.sdf[i]) / voxel;
            if (k > 0 ? voxels < 0 && voxels > -kSureInside : k < 0 && voxels > 1) return true;
        }
        return false;
    };
    const int w = g.grid.width, h = g.grid.height;
    std::uint8_t* bad = trace_;
    std::memset(bad, 0, static_cast<std::size_t>(w) * h);
    for (int v = 0; v < h; ++v)
        for (int u = 0; u < w; ++u) {
            if (g.grid.row(v)[u] != kCellFilled && !beside_filled(g.grid, u, v)) continue;
            for (int s = 0; s < g.step * g.step && !bad[static_cast<std::size_t>(v) * w + u]; ++s)
                bad[static_cast<std::size_t>(v) * w + u] =
                    closed_in(g.point(u + (s % g.step + 0.5) / g.step, v + (s / g.step + 0.5) / g.step));
        }
    for (int v = 0; v < h; ++v)
        for (int u = 0; u < w; ++u) {
            if (g.grid.row(v)[u] != kCellFilled) continue;
            bool any = false;
            for (int y = std::max(0, v - 1); y <= std::min(h - 1, v + 1); ++y)
                for (int x = std::max(0, u - 1); x <= std::min(w - 1, u + 1); ++x)
                    any = any || bad[static_cast<std::size_t>(y) * w + x];
            if (any) g.grid.row(v)[u] = kCellUnknown;
        }
}

std::uint64_t PlaneExtents::complete(const Volume& volume, const Overlay& overlay, const ChunkPlanes* chunks,
                                     const PlaneSet& set, std::uint16_t plane, const ExtentGrid& g) {
    const HullCounts hull = convex_hull(g.grid, mask_of(kCellSeen), nullptr, 0, spans_, chain_);
    block_empty(volume, g);
    block_crossing(overlay, chunks, set, plane, g);
    fill_hull(set, plane, g, hull.cells);
    for (int pass = 0; pass < kPasses; ++pass)
        if (fill_between(g.grid, static_cast<int>(kLongestM / g.cell_m), trace_) == 0) break;
    drop_closed_in(volume, g);
    const std::uint8_t *begin = g.grid.cells,
                       *end = begin + static_cast<std::size_t>(g.grid.width) * g.grid.height;
    return static_cast<std::uint64_t>(std::count(begin, end, std::uint8_t{kCellFilled}));
}

}  // namespace burin
