// SPDX-License-Identifier: MIT
#include <algorithm>

#include "planes/outline.h"

namespace burin {
namespace {

// Squared distance of p from the segment from a to b, times its squared length (or, of a segment of no
// length, as it is). Corners have at most 31 bits, so differences and products are exact in 64 bits; the last
// product is rounded alike everywhere.
double distance_measure(CellPoint p, CellPoint a, CellPoint b) {
    const std::int64_t du = b.u - a.u, dv = b.v - a.v, pu = p.u - a.u, pv = p.v - a.v;
    const std::int64_t length2 = du * du + dv * dv, along = du * pu + dv * pv;
    const auto distance2 = [](std::int64_t u, std::int64_t v) { return static_cast<double>(u * u + v * v); };
    if (length2 == 0) return distance2(pu, pv);
    if (along <= 0) return distance2(pu, pv) * static_cast<double>(length2);
    if (along >= length2) return distance2(p.u - b.u, p.v - b.v) * static_cast<double>(length2);
    const auto cross = static_cast<double>(du * pv - dv * pu);
    return cross * cross;
}

struct Farthest {
    std::uint32_t index = 0;
    double measure = -1;
};

// Of the points strictly between `first` and `last` (which may be the count: the ring's first point again).
Farthest farthest_between(const CellPoint* points, std::uint32_t count, std::uint32_t first,
                          std::uint32_t last) {
    const CellPoint a = points[first], b = points[last % count];
    Farthest found;
    for (std::uint32_t i = first + 1; i < last; ++i)
        if (const double measure = distance_measure(points[i], a, b); measure > found.measure)
            found = {i, measure};
    return found;
}

// Marks what Douglas & Peucker keep of the chain between two kept points.
void keep_chain(const CellPoint* points, std::uint32_t count, std::uint32_t first, std::uint32_t last,
                double tolerance, std::uint8_t* keep) {
    struct Chain {
        std::uint32_t first, last;
    };
    // The longer half waits, so the chain at hand at least halves with every entry: 32 for 2^32 points.
    Chain waiting[32];
    int depth = 0;
    for (;;) {
        const Farthest far = farthest_between(points, count, first, last);
        const CellPoint a = points[first], b = points[last % count];
        const std::int64_t du = b.u - a.u, dv = b.v - a.v;
        const std::int64_t length2 = du * du + dv * dv;
        const double limit = tolerance * tolerance * static_cast<double>(length2 ? length2 : 1);
        if (far.measure > limit) {
            keep[far.index] = 1;
            const bool low_longer = far.index - first > last - far.index;
            waiting[depth++] = low_longer ? Chain{first, far.index} : Chain{far.index, last};
            (low_longer ? first : last) = far.index;
        } else if (depth > 0) {
            --depth;
            first = waiting[depth].first;
            last = waiting[depth].last;
        } else {
            return;
        }
    }
}

// Sets keep for every point of the ring that stays. Anchors: the first point, the farthest from it, and the
// farthest from the line between the two.
void choose(const CellPoint* points, std::uint32_t count, double tolerance, std::uint8_t* keep) {
    std::fill(keep, keep + count, std::uint8_t{0});
    const std::uint32_t opposite = farthest_between(points, count, 0, count).index;
    const Farthest low = farthest_between(points, count, 0, opposite);
    const Farthest high = farthest_between(points, count, opposite, count);
    const std::uint32_t third = low.measure >= high.measure ? low.index : high.index;
    const std::uint32_t anchors[4] = {0, std::min(opposite, third), std::max(opposite, third), count};
    for (int i = 0; i < 3; ++i) {
        keep[anchors[i]] = 1;
        keep_chain(points, count, anchors[i], anchors[i + 1], tolerance, keep);
    }
}

}  // namespace

OutlineCounts simplify_outline(const Outline& outline, const OutlineCounts& counts, double tolerance,
                               std::uint8_t* scratch) {
    OutlineCounts simple;
    simple.rings = counts.rings;
    for (std::uint64_t r = 0; r < counts.rings; ++r) {
        OutlineRing& ring = outline.rings[r];
        const CellPoint* points = outline.points + ring.first;
        choose(points, ring.count, tolerance, scratch);
        // The area of what would stay, before anything is moved.
        std::int64_t twice = 0;
        std::uint32_t kept = 0, before = 0;
        for (std::uint32_t i = ring.count; i-- > 0;)
            if (scratch[i]) {
                before = i;
                break;
            }
        for (std::uint32_t i = 0; i < ring.count; ++i) {
            if (!scratch[i]) continue;
            const CellPoint a = points[before], b = points[i];
            twice += std::int64_t{a.u} * b.v - std::int64_t{b.u} * a.v;
            before = i;
            ++kept;
        }
        const bool good = kept >= 3 && (ring.hole ? twice < 0 : twice > 0);
        CellPoint* to = outline.points + simple.points;
        std::uint32_t count = 0;
        for (std::uint32_t i = 0; i < ring.count; ++i)
            if (!good || scratch[i]) to[count++] = points[i];
        ring.first = static_cast<std::uint32_t>(simple.points);
        ring.count = count;
        simple.points += count;
        simple.longest = std::max<std::uint64_t>(simple.longest, count);
    }
    return simple;
}

}  // namespace burin
