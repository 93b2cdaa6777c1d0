// SPDX-License-Identifier: MIT
// A planar region with holes as cells of a grid in its plane.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/vec.h"

namespace burin {

using Ring = std::vector<Vec3d>;  // closed outline, metres, world

// Cells whose centre lies inside an odd number of rings. The grid reaches just past the rings.
class PlaneRaster {
  public:
    PlaneRaster() = default;
    // normal . x + offset = 0, normal unit; ring points are taken along the normal onto the plane. Cells of
    // cell_m, or larger where there would be more than 16 million of them.
    PlaneRaster(Vec3d normal, double offset, const std::vector<Ring>& rings, double cell_m);

    int width() const { return width_; }
    int height() const { return height_; }
    double cell_m() const { return cell_m_; }
    double cell_area_m2() const { return cell_m_ * cell_m_; }
    std::size_t size() const { return inside_.size(); }
    bool inside(std::size_t cell) const { return inside_[cell] != 0; }
    double area_m2() const { return static_cast<double>(count_) * cell_area_m2(); }

    // The plane's own coordinates in cells; the centre of cell (i, j) is (i + 0.5, j + 0.5).
    double column(Vec3d p) const { return (dot(p, u_) - low_u_) / cell_m_; }
    double row(Vec3d p) const { return (dot(p, v_) - low_v_) / cell_m_; }
    // The cell under a point, -1 outside the grid.
    std::ptrdiff_t cell_at(Vec3d p) const {
        const double i = std::floor(column(p)), j = std::floor(row(p));
        if (!(i >= 0 && j >= 0 && i < width_ && j < height_)) return -1;
        return static_cast<std::ptrdiff_t>(j) * width_ + static_cast<std::ptrdiff_t>(i);
    }
    bool contains(Vec3d p) const {
        const std::ptrdiff_t cell = cell_at(p);
        return cell >= 0 && inside_[static_cast<std::size_t>(cell)];
    }
    Vec3d centre(std::size_t cell) const;

  private:
    void fill(const std::vector<Ring>& rings);

    Vec3d origin_, u_, v_;  // origin_: the point of the plane nearest to the world's origin
    double low_u_ = 0, low_v_ = 0, cell_m_ = 0;
    int width_ = 0, height_ = 0;
    std::size_t count_ = 0;
    std::vector<std::uint8_t> inside_;
};

// The rim of the convex hull of the marked cells, filled: 1 for cells in it.
std::vector<std::uint8_t> hull_of_cells(const std::vector<std::uint8_t>& marked, int width, int height);

}  // namespace burin
