// SPDX-License-Identifier: MIT
#include "eval/plane_raster.h"

#include <algorithm>

namespace burin {
namespace {

struct Point {
    double x = 0, y = 0;
};

// Twice the area of o a b, positive when they turn left.
double turn(Point o, Point a, Point b) { return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x); }

}  // namespace

PlaneRaster::PlaneRaster(Vec3d normal, double offset, const std::vector<Ring>& rings, double cell_m)
    : origin_(normal * -offset), cell_m_(cell_m) {
    // Along the axis least along the normal, so that walls and floors get axis-parallel grids.
    const double x = std::fabs(normal.x), y = std::fabs(normal.y), z = std::fabs(normal.z);
    const Vec3d axis = x <= y && x <= z ? Vec3d{1, 0, 0} : y <= z ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
    u_ = normalised(axis - normal * dot(axis, normal));
    v_ = cross(normal, u_);
    double high_u = -1e300, high_v = -1e300;
    low_u_ = low_v_ = 1e300;
    for (const Ring& ring : rings)
        for (const Vec3d& p : ring) {
            low_u_ = std::min(low_u_, dot(p, u_));
            high_u = std::max(high_u, dot(p, u_));
            low_v_ = std::min(low_v_, dot(p, v_));
            high_v = std::max(high_v, dot(p, v_));
        }
    if (!(high_u > low_u_ && high_v > low_v_)) return;
    constexpr double kMostCells = 1 << 24;  // 16 MB; at 10 mm a hall of 40 m x 40 m
    cell_m_ = std::max(cell_m, std::sqrt((high_u - low_u_) * (high_v - low_v_) / kMostCells));
    // Centred, so that a grid whose cells divide the region has none that stick out.
    width_ = std::max(1, static_cast<int>(std::ceil((high_u - low_u_) / cell_m_ - 1e-6)));
    height_ = std::max(1, static_cast<int>(std::ceil((high_v - low_v_) / cell_m_ - 1e-6)));
    low_u_ = 0.5 * (low_u_ + high_u - width_ * cell_m_);
    low_v_ = 0.5 * (low_v_ + high_v - height_ * cell_m_);
    fill(rings);
}

void PlaneRaster::fill(const std::vector<Ring>& rings) {
    inside_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0);
    // Of every row, where the rings cross the line through its cell centres.
    std::vector<std::vector<double>> crossings(static_cast<std::size_t>(height_));
    for (const Ring& ring : rings)
        for (std::size_t k = 0; k < ring.size(); ++k) {
            Point a = {column(ring[k]), row(ring[k]) - 0.5};
            const Vec3d& next = ring[k + 1 < ring.size() ? k + 1 : 0];
            Point b = {column(next), row(next) - 0.5};
            if (a.y > b.y) std::swap(a, b);
            const int first = std::max(0, static_cast<int>(std::ceil(a.y)));
            for (int j = first; j < height_ && j < b.y; ++j)  // the lower end counts, the upper does not
                crossings[static_cast<std::size_t>(j)].push_back(a.x + (b.x - a.x) * (j - a.y) / (b.y - a.y));
        }
    for (int j = 0; j < height_; ++j) {
        std::vector<double>& row = crossings[static_cast<std::size_t>(j)];
        std::sort(row.begin(), row.end());
        for (std::size_t k = 0; k + 1 < row.size(); k += 2)
            for (int i = std::max(0, static_cast<int>(std::ceil(row[k] - 0.5)));
                 i < width_ && i + 0.5 < row[k + 1]; ++i) {
                inside_[static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) +
                        static_cast<std::size_t>(i)] = 1;
                ++count_;
            }
    }
}

Vec3d PlaneRaster::centre(std::size_t cell) const {
    const auto w = static_cast<std::size_t>(width_);
    const double i = static_cast<double>(cell % w) + 0.5, j = static_cast<double>(cell / w) + 0.5;
    return origin_ + u_ * (low_u_ + i * cell_m_) + v_ * (low_v_ + j * cell_m_);
}

std::vector<std::uint8_t> hull_of_cells(const std::vector<std::uint8_t>& marked, int width, int height) {
    std::vector<std::uint8_t> out(marked.size(), 0);
    const auto at = [&](int i, int j) {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i);
    };
    // The outermost marked cells of every row; their left and right chains (Andrew 1979) bound the hull.
    std::vector<Point> left, right;
    const auto add = [](std::vector<Point>& chain, Point p, double side) {
        while (chain.size() >= 2 && side * turn(chain[chain.size() - 2], chain.back(), p) <= 0)
            chain.pop_back();
        chain.push_back(p);
    };
    for (int j = 0; j < height; ++j) {
        int first = 0, last = width - 1;
        while (first < width && !marked[at(first, j)]) ++first;
        if (first == width) continue;
        while (!marked[at(last, j)]) --last;
        add(left, {static_cast<double>(first), static_cast<double>(j)}, -1);
        add(right, {static_cast<double>(last), static_cast<double>(j)}, 1);
    }
    if (left.empty()) return out;
    const auto along = [](const std::vector<Point>& chain, int j) {
        std::size_t k = 0;
        while (k + 2 < chain.size() && chain[k + 1].y < j) ++k;
        if (chain.size() == 1) return chain[0].x;
        const Point a = chain[k], b = chain[k + 1];
        return a.x + (b.x - a.x) * (j - a.y) / (b.y - a.y);
    };
    for (int j = static_cast<int>(left.front().y); j <= static_cast<int>(left.back().y); ++j) {
        constexpr double kRounding = 1e-9;
        const int first = static_cast<int>(std::ceil(along(left, j) - kRounding)),
                  last = static_cast<int>(std::floor(along(right, j) + kRounding));
        for (int i = first; i <= last; ++i) out[at(i, j)] = 1;
    }
    return out;
}

}  // namespace burin
