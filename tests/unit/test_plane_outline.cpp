// SPDX-License-Identifier: MIT
// The outline of a plane's extent: areas and insides by counting cells, rings by flooding their regions.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "plane_grids.h"
#include "planes/outline.h"

namespace burin {
namespace {

struct Rings {
    explicit Rings(Grid& grid, const OutlineOptions& options = {}) {
        std::vector<std::uint8_t> scratch(outline_bytes(grid.width, grid.height) + 1, 77);
        counts = trace_outline(grid, options, {}, scratch.data());
        points.resize(counts.points);
        rings.resize(counts.rings);
        const OutlineCounts again = trace_outline(grid, options, outline(), scratch.data());
        EXPECT_EQ(again.points, counts.points);
        EXPECT_EQ(again.rings, counts.rings);
        EXPECT_EQ(again.longest, counts.longest);
        EXPECT_EQ(scratch.back(), 77) << "beyond its scratch";
    }
    void simplify(double tolerance) {
        std::vector<std::uint8_t> scratch(counts.longest + 1, 77);
        counts = simplify_outline(outline(), counts, tolerance, scratch.data());
        EXPECT_EQ(scratch.back(), 77) << "beyond its scratch";
    }
    Outline outline() { return {points.data(), points.size(), rings.data(), rings.size()}; }
    std::int64_t area_twice(std::size_t r) const {
        return twice_area(points.data() + rings[r].first, rings[r].count);
    }
    // Ring r as text: "island 0,0 2,0 2,2 0,2".
    std::string text(std::size_t r) const {
        std::string text = rings[r].hole ? "hole" : "island";
        for (std::uint32_t i = 0; i < rings[r].count; ++i) {
            const CellPoint p = points[rings[r].first + i];
            text.append(" ").append(std::to_string(p.u)).append(",").append(std::to_string(p.v));
        }
        return text;
    }
    std::vector<std::string> texts() const {
        std::vector<std::string> all;
        for (std::size_t r = 0; r < rings.size(); ++r) all.push_back(text(r));
        return all;
    }
    std::vector<CellPoint> points;
    std::vector<OutlineRing> rings;
    OutlineCounts counts;
};

using Texts = std::vector<std::string>;

TEST(PlaneOutline, DrawnShapes) {
    Grid one(Texts{"#"}), row(Texts{".##.#"}), empty(0, 0), unknown(3, 2);
    EXPECT_EQ(Rings(one).texts(), (Texts{"island 0,0 1,0 1,1 0,1"}));
    EXPECT_EQ(Rings(row).texts(), (Texts{"island 1,0 3,0 3,1 1,1", "island 4,0 5,0 5,1 4,1"}));
    EXPECT_EQ(Rings(empty).texts(), Texts{});
    EXPECT_EQ(Rings(unknown).texts(), Texts{});
    Grid square(Texts{"#####", "#.#.#", "#####"});
    EXPECT_EQ(Rings(square).texts(),
              (Texts{"island 0,0 5,0 5,3 0,3", "hole 1,1 1,2 2,2 2,1", "hole 3,1 3,2 4,2 4,1"}));
    Grid ring_in_ring(Texts{"#####", "#...#", "#.#.#", "#...#", "#####"});
    EXPECT_EQ(Rings(ring_in_ring).texts(),
              (Texts{"island 0,0 5,0 5,5 0,5", "hole 1,1 1,4 4,4 4,1", "island 2,2 3,2 3,3 2,3"}));
    // Cells that touch at a corner are two islands, and two such gaps are one hole.
    Grid diagonal(Texts{".#", "#."});
    EXPECT_EQ(Rings(diagonal).texts(), (Texts{"island 0,0 1,0 1,1 0,1", "island 1,1 2,1 2,2 1,2"}));
    Grid gaps(Texts{"####", "##.#", "#.##", "####"});
    EXPECT_EQ(Rings(gaps).texts(), (Texts{"island 0,0 4,0 4,4 0,4", "hole 1,1 1,2 2,2 2,3 3,3 3,2 2,2 2,1"}));
    // Of filled and seen cells together.
    Grid mixed(Texts{"#ox"});
    EXPECT_EQ(Rings(mixed).texts(), (Texts{"island 0,0 1,0 1,1 0,1"}));
    EXPECT_EQ(Rings(mixed, {kSeenMask | mask_of(kCellFilled), 0, 0}).texts(),
              (Texts{"island 0,0 2,0 2,1 0,1"}));
}

TEST(PlaneOutline, AClosedHoleTakesItsIslandsAlong) {
    Grid grid(Texts{"#######", "#.....#", "#.###.#", "#.#.#.#", "#.###.#", "#.....#", "#######", ".......",
                    "##....."});
    EXPECT_EQ(Rings(grid).rings.size(), 5u);  // encloses 2, 49, 25, 9 and 1 cells
    EXPECT_EQ(Rings(grid, {kSeenMask, 3, 2}).rings.size(), 3u);
    EXPECT_EQ(Rings(grid, {kSeenMask, 10, 0}).rings.size(), 2u);
    EXPECT_EQ(Rings(grid, {kSeenMask, 3, 25}).rings.size(), 3u);
    EXPECT_EQ(Rings(grid, {kSeenMask, 3, 26}).rings.size(), 1u);
    EXPECT_EQ(Rings(grid, {kSeenMask, 50, 0}).rings.size(), 0u);
}

TEST(PlaneOutline, RandomGridsHaveTheRingsTheirCellsSay) {
    Rng rng(5);
    std::size_t holes_seen = 0;
    for (int round = 0; round < kGrids; ++round) {
        Grid grid = random_grid(rng, round % 2 ? 10 : 60);
        const auto mask = static_cast<CellMask>(round % 3 ? kSeenMask : rng.below(16));
        Rings found(grid, {mask, 0, 0});
        // Islands are the components; holes are those of the rest, over corners, but for what is outside.
        Grid rim(grid.width + 2, grid.height + 2);
        for (int v = 0; v < grid.height; ++v)
            for (int u = 0; u < grid.width; ++u) rim.at(u + 1, v + 1) = grid.is(u, v, mask);
        const std::size_t islands = Parts(grid, mask).sizes.size() - 1;
        const std::size_t holes = Parts(rim, mask_of(kCellUnknown), {}, true).sizes.size() - 2;
        ASSERT_EQ(found.rings.size(), islands + holes) << round;
        holes_seen += holes;
        std::uint32_t next = 0;
        std::size_t hole_rings = 0;
        for (std::size_t r = 0; r < found.rings.size(); ++r) {
            const OutlineRing& ring = found.rings[r];
            ASSERT_EQ(ring.first, next);
            next += ring.count;
            hole_rings += ring.hole;
            EXPECT_EQ(found.area_twice(r), ring.hole ? -2 * ring.cells : 2 * ring.cells);
            EXPECT_GT(ring.cells, 0);
            // Every side is straight along u or v, and every point is a turn.
            for (std::uint32_t i = 0; i < ring.count; ++i) {
                const CellPoint a = found.points[ring.first + i];
                const CellPoint b = found.points[ring.first + (i + 1) % ring.count];
                const CellPoint c = found.points[ring.first + (i + 2) % ring.count];
                ASSERT_NE(a.u == b.u, a.v == b.v);
                ASSERT_NE(a.u == b.u, b.u == c.u);
            }
        }
        EXPECT_EQ(next, found.points.size());
        EXPECT_EQ(hole_rings, holes);
        ASSERT_EQ(twice_area(found.outline(), found.counts), 2 * grid.count(mask));
        Grid inside(grid.width, grid.height);
        std::fill(inside.cells.begin(), inside.cells.end(), std::uint8_t{kCellBlocked});
        fill_rings(found.outline(), found.counts, inside, kCellFilled);
        for (int v = 0; v < grid.height; ++v)
            for (int u = 0; u < grid.width; ++u) {
                ASSERT_EQ(inside.kind(u, v), grid.is(u, v, mask) ? kCellFilled : 0);
                if (round % 4) continue;
                ASSERT_EQ(in_rings(found.outline(), found.counts, u + 0.5, v + 0.5), grid.is(u, v, mask));
            }
    }
    EXPECT_GT(holes_seen, 100u);
}

TEST(PlaneOutline, SmallRingsGoWithAllThatIsInThem) {
    Rng rng(6);
    for (int round = 0; round < kGrids / 2; ++round) {
        Grid grid = random_grid(rng, 40);
        Rings all(grid);
        const OutlineOptions options{kSeenMask, rng.below(12), rng.below(30)};
        Texts expected;
        for (std::size_t r = 0; r < all.rings.size(); ++r) {
            const auto small = [&](const OutlineRing& ring) {
                return ring.cells < (ring.hole ? options.min_hole_cells : options.min_island_cells);
            };
            // A ring begins at the corner of the first cell in it.
            const CellPoint cell = all.points[all.rings[r].first];
            bool dropped = false;
            for (OutlineRing& other : all.rings) {
                OutlineCounts just_one;
                just_one.rings = 1;
                dropped = dropped || (small(other) && in_rings({all.points.data(), 0, &other, 1}, just_one,
                                                               cell.u + 0.5, cell.v + 0.5));
            }
            if (!dropped) expected.push_back(all.text(r));
        }
        ASSERT_EQ(Rings(grid, options).texts(), expected) << round;
    }
}

TEST(PlaneOutline, WhatDoesNotFitIsToldAndLeftOut) {
    Rng rng(7);
    for (int round = 0; round < kGrids / 4; ++round) {
        Grid grid = random_grid(rng, 20);
        Rings all(grid);
        if (all.rings.empty()) continue;
        std::vector<CellPoint> points(all.points.size(), CellPoint{-1, -1});
        std::vector<OutlineRing> rings(all.rings.size());
        std::vector<std::uint8_t> scratch(outline_bytes(grid.width, grid.height));
        const std::uint64_t fit = static_cast<std::uint64_t>(rng.below(static_cast<int>(points.size())));
        const OutlineCounts told =
            trace_outline(grid, {}, {points.data(), fit, rings.data(), rings.size()}, scratch.data());
        EXPECT_EQ(told.points, all.points.size());
        EXPECT_EQ(told.rings, all.rings.size());
        std::size_t whole = 0;
        while (all.rings[whole].first + all.rings[whole].count <= fit) ++whole;
        for (std::size_t r = 0; r < rings.size(); ++r)
            EXPECT_EQ(rings[r].count, r < whole ? all.rings[r].count : 0);
        for (std::size_t i = 0; i < points.size(); ++i)
            EXPECT_EQ(points[i].u, i < all.rings[whole].first ? all.points[i].u : -1);
    }
}

// Distance of p from the nearest side of a ring, cells.
double distance(CellPoint p, const CellPoint* ring, std::uint32_t count) {
    double nearest = 1e9;
    for (std::uint32_t i = 0; i < count; ++i) {
        const CellPoint a = ring[i], b = ring[(i + 1) % count];
        const double du = b.u - a.u, dv = b.v - a.v, pu = p.u - a.u, pv = p.v - a.v;
        const double t = std::clamp((du * pu + dv * pv) / std::max(1.0, du * du + dv * dv), 0.0, 1.0);
        nearest = std::min(nearest, std::hypot(pu - t * du, pv - t * dv));
    }
    return nearest;
}

TEST(PlaneOutline, ASlantedRectangleGetsItsFewSidesBack) {
    constexpr int kSide = sized(300, 100);
    Grid grid(kSide, kSide);
    // Sides of 0.8 and 0.4 of the grid, turned by the angle of 3 : 4.
    for (int v = 0; v < kSide; ++v)
        for (int u = 0; u < kSide; ++u) {
            const double x = u + 0.5 - kSide / 2.0, y = v + 0.5 - kSide / 2.0;
            if (std::abs(0.8 * x + 0.6 * y) < 0.4 * kSide && std::abs(0.8 * y - 0.6 * x) < 0.2 * kSide)
                grid.at(u, v) = kCellSeen;
        }
    Rings rings(grid);
    const auto exact = static_cast<double>(twice_area(rings.outline(), rings.counts)) / 2;
    EXPECT_GT(rings.counts.points, 200u);
    rings.simplify(1.5);
    EXPECT_EQ(rings.counts.rings, 1u);
    EXPECT_LE(rings.counts.points, 8u);
    // Half a cell, the mean of a stair, along 2.4 sides.
    EXPECT_NEAR(static_cast<double>(twice_area(rings.outline(), rings.counts)) / 2, exact, 1.2 * kSide);
}

TEST(PlaneOutline, SimplifyingKeepsDirectionsAndStaysWithinTheTolerance) {
    Rng rng(8);
    std::size_t saved = 0;
    for (int round = 0; round < kGrids; ++round) {
        Grid grid = random_grid(rng, round % 2 ? 8 : 50);
        Rings exact(grid), simple = exact;
        const double tolerance = round % 5 == 0 ? 0 : rng.uniform(0, 6);
        simple.simplify(tolerance);
        ASSERT_EQ(simple.counts.rings, exact.counts.rings);
        std::uint64_t next = 0, longest = 0;
        for (std::size_t r = 0; r < exact.rings.size(); ++r) {
            const OutlineRing &was = exact.rings[r], &is = simple.rings[r];
            ASSERT_EQ(is.first, next);
            next += is.count;
            longest = std::max<std::uint64_t>(longest, is.count);
            ASSERT_GE(is.count, 3u);
            ASSERT_EQ(is.hole, was.hole);
            ASSERT_EQ(is.cells, was.cells);
            ASSERT_GT(is.hole ? -simple.area_twice(r) : simple.area_twice(r), 0);
            saved += was.count - is.count;
            // What stays is of the exact ring, in order; what went is near.
            std::uint32_t k = 0;
            for (std::uint32_t i = 0; i < was.count; ++i) {
                const CellPoint p = exact.points[was.first + i];
                if (k < is.count && p.u == simple.points[is.first + k].u &&
                    p.v == simple.points[is.first + k].v)
                    ++k;
                ASSERT_LE(distance(p, simple.points.data() + is.first, is.count), tolerance + 1e-9);
            }
            ASSERT_EQ(k, is.count);
        }
        EXPECT_EQ(simple.counts.points, next);
        EXPECT_EQ(simple.counts.longest, longest);
        if (tolerance == 0) {
            EXPECT_EQ(twice_area(simple.outline(), simple.counts), 2 * grid.count(kSeenMask));
        }
        // fill_rings and in_rings agree on slanted sides.
        Grid inside(grid.width, grid.height);
        fill_rings(simple.outline(), simple.counts, inside, kCellSeen);
        if (round % 4) continue;
        for (int v = 0; v < grid.height; ++v)
            for (int u = 0; u < grid.width; ++u)
                ASSERT_EQ(inside.kind(u, v), in_rings(simple.outline(), simple.counts, u + 0.5, v + 0.5));
    }
    EXPECT_GT(saved, 1000u);
}

TEST(PlaneOutline, ARingThatSimplifyingWouldTurnOverStaysExact) {
    // Thinner than the tolerance: of the sides that are left, those of one bank lie beyond those of the
    // other.
    Grid thin(
        Texts{"...#.", "...#.", "..##.", "...##", "....#", ".##.#", "#####", "##..#", "....#", "....#"});
    Rings rings(thin);
    const Texts exact = rings.texts();
    rings.simplify(2.41);
    EXPECT_EQ(rings.texts(), exact);
    Grid thick(Texts{"######", "######", "#####.", "######", "######"});
    Rings notched(thick);
    notched.simplify(3);
    EXPECT_EQ(notched.texts(), (Texts{"island 0,0 6,0 6,5 0,5"}));
}

TEST(PlaneOutline, RingsMayReachBeyondTheGridTheyAreFilledInto) {
    Grid square(12, 12);
    for (int v = 1; v < 11; ++v)
        for (int u = 1; u < 11; ++u) square.at(u, v) = kCellSeen;
    Rings rings(square);
    for (CellPoint& p : rings.points) p = {p.u - 4, p.v - 4};  // -3 .. 7
    Grid small(5, 9);
    fill_rings(rings.outline(), rings.counts, small, kCellSeen);
    for (int v = 0; v < 9; ++v)
        for (int u = 0; u < 5; ++u) EXPECT_EQ(small.kind(u, v), v < 7);
}

}  // namespace
}  // namespace burin
