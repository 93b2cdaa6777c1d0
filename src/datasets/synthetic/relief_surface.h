// SPDX-License-Identifier: MIT
// A carved height field: the uniform cubic B-spline surface over a grid of control heights. Defining the
// surface by its control grid makes it exact, twice continuously differentiable, cheap to evaluate, and gives
// a proven bound on its slope (a B-spline's derivative is a convex combination of control differences over
// the spacing).
#pragma once

#include <vector>

namespace burin::synthetic {

class ReliefSurface {
  public:
    // columns x rows control heights (metres), row by row, `spacing` metres apart; control point (i, j) sits
    // at x = (i - (columns - 1) / 2) * spacing, y likewise. At least 4 x 4.
    ReliefSurface(int columns, int rows, double spacing, std::vector<float> control);

    // Height (metres) over (x, y) and its slopes; beyond the grid the border row is continued.
    double height(double x, double y, double* slope_x, double* slope_y) const;
    double height_max() const { return height_max_; }  // an upper bound
    // (z - height) times this has gradient at most 1: 1 / sqrt(1 + steepest slope^2).
    double distance_scale() const { return scale_; }

  private:
    int columns_, rows_;
    double spacing_;
    double height_max_ = 0, scale_ = 1;
    std::vector<float> control_;
};

}  // namespace burin::synthetic
