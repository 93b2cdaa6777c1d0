// SPDX-License-Identifier: MIT
// The extent of a plane against oracles that look at every cell by itself: closing, hull, components,
// completion.
#include <gtest/gtest.h>

#include <numeric>

#include "plane_grids.h"
#include "planes/grid_fill.h"

namespace burin {
namespace {

std::vector<std::string> closed(Grid grid, int radius, std::uint64_t* count = nullptr) {
    std::vector<std::uint64_t> scratch(closing_words(grid.width, grid.height, radius) + 1, 77);
    const std::uint64_t n = close_seen(grid, radius, scratch.data());
    EXPECT_EQ(scratch.back(), 77u) << "beyond its scratch";
    if (count) *count = n;
    return grid.rows();
}

struct Hull {
    Hull(Grid& grid, CellMask mask, const std::vector<CellPoint>& points = {})
        : spans(2 * static_cast<std::size_t>(grid.height)) {
        std::vector<std::int32_t> scratch(static_cast<std::size_t>(grid.height));
        counts = convex_hull(grid, mask, points.data(), static_cast<std::uint32_t>(points.size()),
                             spans.data(), scratch.data());
    }
    bool has(int u, int v) const {
        const auto s = 2 * static_cast<std::size_t>(v);
        return u >= spans[s] && u <= spans[s + 1];
    }
    std::vector<std::int32_t> spans;
    HullCounts counts;
};

TEST(PlaneExtent, ClosingDrawsNothingTowardsTheBorderAndNothingOverBlockedCells) {
    using Rows = std::vector<std::string>;
    EXPECT_EQ(closed(Grid(Rows{".#..#."}), 1), (Rows{".####."}));
    EXPECT_EQ(closed(Grid(Rows{".#...#"}), 1), (Rows{".#...#"}));
    EXPECT_EQ(closed(Grid(Rows{".#...#"}), 2), (Rows{".#####"}));
    EXPECT_EQ(closed(Grid(Rows{"#.x.o#"}), 2), (Rows{"##x#o#"}));
    EXPECT_EQ(closed(Grid(Rows{"...", ".#.", "..."}), 8), (Rows{"...", ".#.", "..."}));
    EXPECT_EQ(closed(Grid(Rows{"###", "#.#", "###"}), 1), (Rows{"###", "###", "###"}));
    EXPECT_EQ(closed(Grid(0, 0), 3), Rows{});
}

TEST(PlaneExtent, ClosingIsWhatTheDefinitionSaysForEveryCell) {
    Rng rng(1);
    for (int round = 0; round < kGrids / 4; ++round) {
        const Grid grid = random_grid(rng, round % 2 ? 30 : 140);
        const int r = 1 + rng.below(kMaxClosingRadius);
        // The two steps on a plane that reaches 2 r beyond the grid.
        const int w = grid.width + 4 * r, h = grid.height + 4 * r;
        std::vector<char> near(static_cast<std::size_t>(w) * h);
        for (int v = 0; v < grid.height; ++v)
            for (int u = 0; u < grid.width; ++u)
                if (grid.kind(u, v) == kCellSeen)
                    for (int y = v + r; y <= v + 3 * r; ++y)
                        std::fill_n(near.begin() + static_cast<std::ptrdiff_t>(y) * w + u + r, 2 * r + 1, 1);
        Grid expected = grid;
        for (int v = 0; v < grid.height; ++v)
            for (int u = 0; u < grid.width; ++u) {
                if (grid.kind(u, v) != kCellUnknown) continue;
                bool all = true;
                for (int y = v + r; y <= v + 3 * r && all; ++y)
                    for (int x = u + r; x <= u + 3 * r && all; ++x)
                        all = near[static_cast<std::size_t>(y) * w + x];
                if (all) expected.at(u, v) = kCellSeen;
            }
        std::uint64_t count = 0;
        ASSERT_EQ(closed(grid, r, &count), expected.rows()) << round;
        EXPECT_EQ(static_cast<std::int64_t>(count), expected.count(kSeenMask) - grid.count(kSeenMask));
        EXPECT_EQ(closed(expected, r), expected.rows()) << "a second closing";
    }
}

TEST(PlaneExtent, HullHoldsTheCellsWhoseCentresLieInATriangleOfOthers) {
    Rng rng(2);
    for (int round = 0; round < kGrids / 4; ++round) {
        Grid grid(1 + rng.below(14), 1 + rng.below(14));
        std::vector<CellPoint> corners, extra;
        for (int i = rng.below(7); i > 0; --i) {
            corners.push_back({rng.below(grid.width), rng.below(grid.height)});
            grid.at(corners.back().u, corners.back().v) = rng.below(3) ? kCellSeen : kCellFilled;
            if (rng.below(3) == 0) {
                extra.push_back(corners.back());
                grid.at(extra.back().u, extra.back().v) = kCellBlocked;
            }
        }
        for (const CellPoint p : {CellPoint{-1, 0}, {0, -1}, {grid.width, 0}, {0, grid.height}})
            extra.push_back(p);
        const Hull hull(grid, kSeenMask | mask_of(kCellFilled), extra);
        EXPECT_EQ(hull.counts.points_outside, 4u);
        std::uint64_t cells = 0;
        for (int v = 0; v < grid.height; ++v)
            for (int u = 0; u < grid.width; ++u) {
                const auto cross = [&](CellPoint a, CellPoint b) {
                    return (b.u - a.u) * (v - a.v) - (b.v - a.v) * (u - a.u);
                };
                bool in = false;
                for (const CellPoint a : corners)
                    for (const CellPoint b : corners)
                        for (const CellPoint c : corners) {
                            const auto [low, high] = std::minmax({cross(a, b), cross(b, c), cross(c, a)});
                            const auto within = [](int x, int p, int q, int s) {
                                return x >= std::min({p, q, s}) && x <= std::max({p, q, s});
                            };
                            in = in || ((low >= 0 || high <= 0) && within(u, a.u, b.u, c.u) &&
                                        within(v, a.v, b.v, c.v));
                        }
                ASSERT_EQ(hull.has(u, v), in) << round << ": " << u << " " << v;
                cells += in;
            }
        EXPECT_EQ(hull.counts.cells, cells);
    }
}

TEST(PlaneExtent, HullOfOnlyExtraPointsAndOfAWideGrid) {
    Grid wide(1000, 3);
    const Hull hull(wide, kSeenMask, {{5, 0}, {900, 2}});
    EXPECT_FALSE(hull.has(452, 1));  // the line passes between two centres
    wide.at(999, 1) = kCellSeen;
    const Hull wider(wide, kSeenMask, {{5, 0}, {900, 2}});
    EXPECT_FALSE(wider.has(452, 1));
    EXPECT_TRUE(wider.has(453, 1));
    EXPECT_TRUE(wider.has(999, 1));
    EXPECT_EQ(Hull(wide, mask_of(kCellFilled)).counts.cells, 0u);
}

TEST(PlaneExtent, ComponentsAreThoseOfAFlood) {
    Rng rng(3);
    for (int round = 0; round < kGrids; ++round) {
        Grid grid = random_grid(rng, round % 2 ? 12 : 150);
        const auto mask = static_cast<CellMask>(1 + rng.below(15));
        const Hull hull(grid, kSeenMask);
        const bool spans = rng.below(2);
        const std::vector<std::int32_t> spans_of = spans ? hull.spans : std::vector<std::int32_t>{};
        const Parts parts(grid, mask, spans_of);
        std::vector<CellRun> runs(max_runs(grid.width, grid.height) + 1);
        const ComponentCounts counts =
            find_components(grid, mask, spans ? hull.spans.data() : nullptr, runs.data(), runs.size() - 1);
        ASSERT_LE(counts.runs, max_runs(grid.width, grid.height));
        ASSERT_EQ(counts.components + 1, parts.sizes.size()) << round;
        EXPECT_EQ(counts.largest, *std::max_element(parts.sizes.begin(), parts.sizes.end()));
        std::vector<std::uint32_t> root_of_part(parts.sizes.size(), ~0u);
        std::size_t cells = 0;
        for (std::size_t i = 0; i < counts.runs; ++i)
            for (int u = runs[i].first; u <= runs[i].last; ++u, ++cells) {
                const int part = parts.part[static_cast<std::size_t>(runs[i].row) * grid.width + u];
                ASSERT_GT(part, 0);
                std::uint32_t& root = root_of_part[static_cast<std::size_t>(part)];
                if (root == ~0u) root = static_cast<std::uint32_t>(i);
                ASSERT_EQ(runs[i].root, root) << round;
                ASSERT_EQ(runs[root].cells, parts.sizes[static_cast<std::size_t>(part)]);
            }
        EXPECT_EQ(cells, std::accumulate(parts.sizes.begin(), parts.sizes.end(), std::size_t{0}));
        // One run too few: the need is told, and nothing removed.
        if (counts.runs == 0 || spans) continue;
        const Grid before = grid;
        const auto tight = remove_small_components(grid, mask, 1 << 30, runs.data(), counts.runs - 1);
        EXPECT_EQ(tight.runs, counts.runs);
        EXPECT_EQ(tight.removed, 0u);
        EXPECT_EQ(grid.cells, before.cells);
        const std::uint32_t min_cells = 1 + static_cast<std::uint32_t>(rng.below(40));
        const auto removed = remove_small_components(grid, mask, min_cells, runs.data(), counts.runs);
        std::uint64_t gone = 0;
        for (std::size_t i = 0; i < grid.cells.size(); ++i) {
            const bool small =
                parts.part[i] && parts.sizes[static_cast<std::size_t>(parts.part[i])] < min_cells;
            ASSERT_EQ(grid.cells[i], small ? 0 : before.cells[i]);
            gone += small;
        }
        EXPECT_EQ(removed.removed_cells, gone);
        EXPECT_EQ(removed.removed, std::count_if(parts.sizes.begin() + 1, parts.sizes.end(),
                                                 [&](std::size_t size) { return size < min_cells; }));
    }
}

std::vector<std::string> filled(Grid& grid, const FillOptions& options = {}, FillCounts* counts = nullptr) {
    const auto rows = static_cast<std::size_t>(grid.height);
    std::vector<std::int32_t> spans(2 * rows), chain(rows);
    std::vector<CellRun> runs(max_runs(grid.width, grid.height));
    const FillCounts got =
        fill_missing(grid, options, {spans.data(), chain.data(), runs.data(), runs.size()});
    if (counts) *counts = got;
    return grid.rows();
}

TEST(PlaneFill, DrawnShapes) {
    using Rows = std::vector<std::string>;
    Grid hole(Rows{"####", "#..#", "#.x#", "####"});
    EXPECT_EQ(filled(hole), (Rows{"####", "#oo#", "#ox#", "####"}));
    // An L: what lies beyond its hull stays; behind a blocked wall nothing is filled.
    Grid ell(Rows{"#...", "#...", "#...", "####"});
    EXPECT_EQ(filled(ell), (Rows{"#...", "#o..", "#oo.", "####"}));
    Grid wall(Rows{"#.x..#", "#.x..x", "#.x..x", "#xxxx#"});
    FillCounts counts;
    EXPECT_EQ(filled(wall, {}, &counts), (Rows{"#oxoo#", "#oxoox", "#oxoox", "#xxxx#"}));
    EXPECT_EQ(counts.filled_regions, 2u);
    Grid shut(Rows{"#.x..x", "#.x..x", "#.x..x", "#xxxx#"});
    const CellPoint corner = {5, 3};
    EXPECT_EQ(filled(shut, {&corner, 1, 0}, &counts), (Rows{"#ox..x", "#ox..x", "#ox..x", "#xxxx#"}));
    EXPECT_EQ(counts.unreached_cells, 6u);
    // The left region has 3 of 8 sides at seen cells, and 5 at blocked ones and at the border.
    EXPECT_EQ(filled(shut, {&corner, 1, 0.375f}, &counts)[0], "#ox..x");
    EXPECT_EQ(filled(shut, {&corner, 1, 0.376f}, &counts)[0], "#.x..x");
    EXPECT_EQ(counts.refused_cells, 3u);
    // Out to an extra point.
    Grid strip(Rows{"..#...."});
    const CellPoint ends[] = {{5, 0}, {9, 0}};
    EXPECT_EQ(filled(strip, {ends, 2, 0}, &counts), (Rows{"..#ooo."}));
    EXPECT_EQ(counts.hull.points_outside, 1u);
    EXPECT_EQ(filled(strip), (Rows{"..#...."})) << "what an earlier call filled";
    Grid empty(0, 0), unseen(5, 4), full(Rows{"##", "##"});
    EXPECT_EQ(filled(empty), Rows{});
    EXPECT_EQ(filled(unseen, {&corner, 1, 0}), Grid(5, 4).rows());
    EXPECT_EQ(filled(full), (Rows{"##", "##"}));
}

TEST(PlaneFill, IsAFloodFromSeenCells) {
    Rng rng(4);
    std::uint64_t all_filled = 0, all_refused = 0, all_unreached = 0;
    for (int round = 0; round < kGrids; ++round) {
        Grid grid = random_grid(rng, round % 2 ? 14 : 100);
        std::vector<CellPoint> points;
        for (int i = rng.below(3); i > 0; --i)
            points.push_back({rng.below(grid.width), rng.below(grid.height)});
        FillOptions options{points.data(), static_cast<std::uint32_t>(points.size()), 0};
        if (rng.below(2)) options.least_border_share = static_cast<float>(rng.uniform(0, 1));
        Grid expected = grid;
        std::replace(expected.cells.begin(), expected.cells.end(), std::uint8_t{kCellFilled},
                     std::uint8_t{kCellUnknown});
        const Hull hull(expected, kSeenMask, points);
        const Parts parts(expected, mask_of(kCellUnknown), hull.spans);
        const auto part = [&](int u, int v) {
            return expected.is(u, v, 15) ? parts.part[static_cast<std::size_t>(v) * grid.width + u] : 0;
        };
        std::vector<int> border(parts.sizes.size()), seen(parts.sizes.size());
        for (int v = 0; v < grid.height; ++v)
            for (int u = 0; u < grid.width; ++u)
                for (int d = 1; d < 9; d += 2) {
                    const int x = u + d % 3 - 1, y = v + d / 3 - 1;
                    const auto p = static_cast<std::size_t>(part(u, v));
                    border[p] += part(x, y) != part(u, v);
                    seen[p] += expected.kind(x, y) == kCellSeen;
                }
        std::uint64_t refused = 0, unreached = 0;
        for (std::size_t i = 0; i < grid.cells.size(); ++i) {
            const auto p = static_cast<std::size_t>(parts.part[i]);
            if (p == 0) continue;
            const bool reached = seen[p] > 0;
            const bool enough = seen[p] >= static_cast<double>(options.least_border_share) * border[p];
            if (reached && enough) expected.cells[i] = kCellFilled;
            refused += reached && !enough;
            unreached += !reached;
        }
        FillCounts counts;
        ASSERT_EQ(filled(grid, options, &counts), expected.rows()) << round;
        EXPECT_EQ(static_cast<std::int64_t>(counts.filled_cells), expected.count(mask_of(kCellFilled)));
        EXPECT_EQ(counts.refused_cells, refused);
        EXPECT_EQ(counts.unreached_cells, unreached);
        EXPECT_EQ(counts.filled_regions + counts.refused_regions,
                  std::count_if(seen.begin() + 1, seen.end(), [](int n) { return n > 0; }));
        all_filled += counts.filled_cells;
        all_refused += refused;
        all_unreached += unreached;
        // Too few runs: told, and nothing filled.
        std::vector<std::int32_t> spans(2 * grid.cells.size()), chain(grid.cells.size());
        std::vector<CellRun> runs(counts.runs);
        if (counts.runs == 0) continue;
        const FillCounts tight =
            fill_missing(grid, options, {spans.data(), chain.data(), runs.data(), counts.runs - 1});
        EXPECT_EQ(tight.runs, counts.runs);
        EXPECT_EQ(grid.count(mask_of(kCellFilled)), 0);
    }
    EXPECT_GT(std::min({all_filled, all_refused, all_unreached}), 50u) << "grids that try nothing";
}

std::vector<std::string> filled_between(Grid& grid, int longest) {
    std::vector<std::uint8_t> scratch(grid.cells.size() + 1, 77);
    fill_between(grid, longest, scratch.data());
    EXPECT_EQ(scratch.back(), 77) << "a byte a cell";
    return grid.rows();
}

TEST(PlaneFill, BetweenWhatWasSeen) {
    using Rows = std::vector<std::string>;
    Grid hole(Rows{"####", "#..#", "#..#", "####"});
    EXPECT_EQ(filled_between(hole, 9), (Rows{"####", "#oo#", "#oo#", "####"}));
    // The arms of an L are drawn together no further than a diagonal goes.
    Grid ell(Rows{"#....", "#....", "#....", "#...."});
    EXPECT_EQ(filled_between(ell, 9), (Rows{"#....", "#....", "#....", "#...."}));
    Grid angle(Rows{"#....", "#....", "#####"});
    EXPECT_EQ(filled_between(angle, 9), (Rows{"#....", "#o...", "#####"}));
    Grid near_angle(Rows{"#....", "#....", "#....", "#....", "#####"});
    EXPECT_EQ(filled_between(near_angle, 2), (Rows{"#....", "#....", "#....", "#o...", "#####"}));
    Grid long_gap(Rows{"#.....#"});
    EXPECT_EQ(filled_between(long_gap, 4), (Rows{"#.....#"}));
    EXPECT_EQ(filled_between(long_gap, 5), (Rows{"#ooooo#"}));
    // Where another plane meets it, one run is not enough, two are.
    Grid meets(Rows{"#..+"});
    EXPECT_EQ(filled_between(meets, 9), (Rows{"#..+"}));
    Grid corner(Rows{"..+", "#.+", "##+"});
    EXPECT_EQ(filled_between(corner, 9), (Rows{"..+", "#o+", "##+"})) << "a row, and a diagonal";
    Grid only_meets(Rows{"+++", "+.+", "+++"});
    EXPECT_EQ(filled_between(only_meets, 9), (Rows{"+++", "+.+", "+++"}));
    // What was seen empty ends a run.
    Grid blocked(Rows{"#..x..#"});
    EXPECT_EQ(filled_between(blocked, 9), (Rows{"#..x..#"}));
    // What was filled before counts as seen.
    Grid again(Rows{"o..#"});
    EXPECT_EQ(filled_between(again, 9), (Rows{"ooo#"}));
    Grid empty(0, 0), unseen(5, 4);
    EXPECT_EQ(filled_between(empty, 9), Rows{});
    EXPECT_EQ(filled_between(unseen, 9), Grid(5, 4).rows());
}

// Every cell by itself: what its four lines end at.
TEST(PlaneFill, BetweenIsASumOverFourLines) {
    Rng rng(6);
    std::int64_t all = 0;
    for (int round = 0; round < kGrids; ++round) {
        Grid grid = random_grid(rng, round % 2 ? 14 : 70);
        const int longest = 1 + rng.below(40);
        Grid expected = grid;
        for (int v = 0; v < grid.height; ++v)
            for (int u = 0; u < grid.width; ++u) {
                if (grid.kind(u, v) != kCellUnknown) continue;
                double told = 0;
                const int step[4][2] = {{1, 0}, {0, 1}, {1, 1}, {-1, 1}};
                for (const auto& d : step) {
                    int length = 1, ends[2];
                    for (int side = 0; side < 2; ++side) {
                        int x = u, y = v;
                        do {
                            x += side ? d[0] : -d[0];
                            y += side ? d[1] : -d[1];
                            ++length;
                        } while (grid.is(x, y, mask_of(kCellUnknown)));
                        --length;
                        const bool in = x >= 0 && y >= 0 && x < grid.width && y < grid.height;
                        ends[side] = in ? grid.kind(x, y) : int{kCellBlocked};
                    }
                    if (length > (d[0] != 0 && d[1] != 0 ? longest * 5 / 7 : longest)) continue;
                    const auto seen = [](int kind) { return kind == kCellSeen || kind == kCellFilled; };
                    if (seen(ends[0]) && seen(ends[1])) told += 1;
                    if ((seen(ends[0]) && ends[1] == kCellMeets) || (seen(ends[1]) && ends[0] == kCellMeets))
                        told += 0.5;
                }
                if (told >= 1) expected.at(u, v) = kCellFilled;
            }
        const std::int64_t before = grid.count(mask_of(kCellFilled));
        ASSERT_EQ(filled_between(grid, longest), expected.rows()) << round;
        all += grid.count(mask_of(kCellFilled)) - before;
    }
    EXPECT_GT(all, 100);
}

}  // namespace
}  // namespace burin
