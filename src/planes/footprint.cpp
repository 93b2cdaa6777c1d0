// SPDX-License-Identifier: MIT
#include "planes/footprint.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace burin {
namespace {

enum Kind : std::uint8_t { kBare = 0, kCovered = 1, kStanding = 2 };

// Distances by chamfer 3, 4 (Borgefors 1986): 3 a cell, off by 8 % at most; up to 85 cells.
constexpr int kStraight = 3, kSlanted = 4, kDeepest = 255;
// A neck is no wider than half of the narrower of the two things that it joins: two discs that overlap by a
// seventh of their width have such a neck.
constexpr double kNeck = 0.5;
constexpr int kLeastDepth = 3 * kStraight;  // things narrower than 6 cells are not told from noise
// Cells where a part comes down to the plane, of those of its outline: what was seen of its sides. The arm of
// a lamp has none.
constexpr double kStandingShare = 0.2;
// And they lie around its middle, in so many of eight directions: a lamp's head that juts out over its foot
// has some of that foot at one side.
constexpr int kLeastDirections = 4;

int direction(int u, int v) {
    return (u > 0 ? 1 : 0) + (v > 0 ? 2 : 0) + (std::abs(u) > std::abs(v) ? 4 : 0);
}

}  // namespace

bool Footprint::begin(const FootprintMemory& memory, const PlaneExtent& support, const double low[2],
                      const double high[2], double cell_m) {
    const double wide = high[0] - low[0], tall = high[1] - low[1];
    if (memory.cells < 64 || !(wide >= 0 && tall >= 0 && wide < 1e4 && tall < 1e4)) return false;
    for (cell_m_ = cell_m; (wide / cell_m_ + 4) * (tall / cell_m_ + 4) > static_cast<double>(memory.cells);)
        cell_m_ *= 2;
    width_ = static_cast<int>(wide / cell_m_) + 3;
    height_ = static_cast<int>(tall / cell_m_) + 3;
    for (int a = 0; a < 2; ++a) {
        axis_[a] = support.axis[a];
        low_[a] = low[a];
    }
    kinds_ = memory.kinds;
    depths_ = memory.depths;
    parents_ = memory.parents;
    std::memset(kinds_, 0, static_cast<std::size_t>(width_) * height_);
    return true;
}

std::size_t Footprint::cell_at(Vec3d x) const {
    int at[2];
    for (int a = 0; a < 2; ++a) {
        const double cells = (dot(axis_[a], x) - low_[a]) / cell_m_;
        at[a] = 1 + static_cast<int>(std::clamp(cells, 0.0, (a == 0 ? width_ : height_) - 2.001));
    }
    return static_cast<std::size_t>(at[1]) * width_ + at[0];
}

void Footprint::mark(Vec3d x, bool low) {
    std::uint8_t& kind = kinds_[cell_at(x)];
    kind = static_cast<std::uint8_t>(kind | kCovered | (low ? kStanding : 0));
}

// What the covered cells enclose is covered: the inside of a cup, the top of what is higher than the camera.
// Depth kDeepest there, 0 elsewhere.
void Footprint::fill_inside() {
    constexpr std::uint8_t kInside = 1;  // so far
    const int cells = width_ * height_;
    for (int i = 0; i < cells; ++i) depths_[i] = kinds_[i] & kCovered ? kDeepest : kInside;
    depths_[0] = 0;
    // From the rim, by passes to and fro until nothing changes: outlines are no labyrinths.
    for (bool changed = true; changed;) {
        changed = false;
        const auto step = [&](int i, int a, int b) {
            if (depths_[i] != kInside) return;
            if ((a >= 0 && a < cells && depths_[a] == 0) || (b >= 0 && b < cells && depths_[b] == 0)) {
                depths_[i] = 0;
                changed = true;
            }
        };
        for (int i = 0; i < cells; ++i) step(i, i - 1, i - width_);
        for (int i = cells - 1; i >= 0; --i) step(i, i + 1, i + width_);
    }
    for (int i = 0; i < cells; ++i)
        if (depths_[i] == kInside) depths_[i] = kDeepest;
}

void Footprint::measure_depths() {
    const int w = width_, cells = w * height_;
    const auto take = [&](int i, int from, int step) {
        depths_[i] = static_cast<std::uint8_t>(std::min<int>(depths_[i], depths_[from] + step));
    };
    // Covered cells are never on the rim of the grid.
    for (int i = w + 1; i < cells - w - 1; ++i) {
        if (depths_[i] == 0) continue;
        take(i, i - 1, kStraight), take(i, i - w, kStraight);
        take(i, i - w - 1, kSlanted), take(i, i - w + 1, kSlanted);
    }
    for (int i = cells - w - 2; i > w; --i) {
        if (depths_[i] == 0) continue;
        take(i, i + 1, kStraight), take(i, i + w, kStraight);
        take(i, i + w + 1, kSlanted), take(i, i + w - 1, kSlanted);
    }
}

std::uint32_t Footprint::root_of(std::uint32_t cell) {
    while (parents_[cell] != cell) {
        parents_[cell] = parents_[parents_[cell]];
        cell = parents_[cell];
    }
    return cell;
}

// Watershed of the depths (Vincent & Soille 1991), from the deepest cells outwards: a part's root is its
// deepest cell, the first of equals. Where two parts meet, the depth is half of the neck's width.
void Footprint::flood() {
    const int w = width_, cells = w * height_;
    std::fill(parents_, parents_ + cells, kNone);
    const int beside[8] = {-w - 1, -w, -w + 1, -1, 1, w - 1, w, w + 1};
    int deepest = 0;
    for (int i = 0; i < cells; ++i) deepest = std::max<int>(deepest, depths_[i]);
    for (int depth = deepest; depth > 0; --depth)
        for (int i = 0; i < cells; ++i) {
            if (depths_[i] != depth) continue;
            const auto cell = static_cast<std::uint32_t>(i);
            std::uint32_t own = kNone;
            int nearest = 0;
            for (const int step : beside)
                if (parents_[i + step] != kNone && depths_[i + step] > nearest) {
                    nearest = depths_[i + step];
                    own = root_of(static_cast<std::uint32_t>(i + step));
                }
            parents_[i] = own == kNone ? cell : own;
            if (own == kNone) continue;
            for (const int step : beside) {
                if (parents_[i + step] == kNone) continue;
                std::uint32_t a = root_of(cell), b = root_of(static_cast<std::uint32_t>(i + step));
                if (a == b) continue;
                if (depths_[b] > depths_[a] || (depths_[b] == depths_[a] && b < a)) std::swap(a, b);
                if (depths_[b] < kLeastDepth || depth > kNeck * depths_[b]) parents_[b] = a;
            }
        }
}

// A part that does not stand on the plane joins the one that it meets in the widest neck. False: there are
// too many parts for any to be a thing.
bool Footprint::join_what_hangs() {
    const int w = width_, cells = w * height_;
    for (;;) {
        parts_ = 0;
        for (int i = 0; i < cells; ++i)
            if (parents_[i] == static_cast<std::uint32_t>(i)) {
                if (parts_ == kMostParts) return false;
                root_[parts_++] = static_cast<std::uint32_t>(i);
            }
        int rim[kMostParts] = {}, standing[kMostParts] = {}, widest[kMostParts] = {}, other[kMostParts];
        std::uint8_t around[kMostParts] = {};
        const auto number = [&](int i) {
            const std::uint32_t root = root_of(static_cast<std::uint32_t>(i));
            return static_cast<int>(std::lower_bound(root_, root_ + parts_, root) - root_);
        };
        for (int i = 0; i < cells; ++i) {
            if (parents_[i] == kNone) continue;
            const int own = number(i);
            bool edge = false;
            for (const int step : {-w, -1, 1, w}) {
                if (parents_[i + step] == kNone) {
                    edge = true;
                    continue;
                }
                const int neck = std::min(depths_[i], depths_[i + step]), there = number(i + step);
                if (there == own || neck <= widest[own]) continue;
                widest[own] = neck;
                other[own] = there;
            }
            rim[own] += edge;
            if (!(kinds_[i] & kStanding)) continue;
            ++standing[own];
            const int middle = static_cast<int>(root_[own]);
            around[own] = static_cast<std::uint8_t>(around[own] |
                                                    1 << direction(i % w - middle % w, i / w - middle / w));
        }
        int hangs = -1;
        for (int p = 0; p < parts_ && hangs < 0; ++p) {
            const bool stands = standing[p] >= kStandingShare * rim[p] &&
                                std::popcount(around[p]) >= kLeastDirections &&
                                depths_[root_[p]] >= kLeastDepth;
            if (widest[p] > 0 && !stands) hangs = p;
        }
        if (hangs < 0) return true;
        const std::uint32_t a = root_[hangs], b = root_[other[hangs]];
        if (depths_[a] > depths_[b])
            parents_[b] = a;
        else
            parents_[a] = b;
    }
}

int Footprint::split() {
    fill_inside();
    measure_depths();
    flood();
    if (!join_what_hangs()) parts_ = 1;
    return parts_;
}

int Footprint::part_at(Vec3d x) const {
    const std::size_t cell = cell_at(x);
    std::uint32_t root = parents_[cell];
    if (root == kNone) return 0;
    while (parents_[root] != root) root = parents_[root];
    return static_cast<int>(std::lower_bound(root_, root_ + parts_, root) - root_);
}

}  // namespace burin
