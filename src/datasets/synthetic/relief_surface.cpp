// SPDX-License-Identifier: MIT
#include "datasets/synthetic/relief_surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace burin::synthetic {

ReliefSurface::ReliefSurface(int columns, int rows, double spacing, std::vector<float> control)
    : columns_(columns), rows_(rows), spacing_(spacing), control_(std::move(control)) {
    double steep_x = 0, steep_y = 0;
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            const double h = control_[static_cast<std::size_t>(j) * columns + i];
            height_max_ = std::max(height_max_, h);
            if (i > 0)
                steep_x =
                    std::max(steep_x, std::fabs(h - control_[static_cast<std::size_t>(j) * columns + i - 1]));
            if (j > 0)
                steep_y =
                    std::max(steep_y, std::fabs(h - control_[static_cast<std::size_t>(j - 1) * columns + i]));
        }
    steep_x /= spacing, steep_y /= spacing;
    scale_ = 1 / std::sqrt(1 + steep_x * steep_x + steep_y * steep_y);
}

double ReliefSurface::height(double x, double y, double* slope_x, double* slope_y) const {
    // The four cubic B-spline weights and their derivatives at offset t in [0, 1).
    const auto weights = [](double t, double* w, double* d) {
        const double s = 1 - t;
        w[0] = s * s * s / 6;
        w[1] = (4 - 6 * t * t + 3 * t * t * t) / 6;
        w[2] = (4 - 6 * s * s + 3 * s * s * s) / 6;
        w[3] = t * t * t / 6;
        d[0] = -s * s / 2;
        d[1] = (3 * t - 4) * t / 2;
        d[2] = (4 - 3 * s) * s / 2;
        d[3] = t * t / 2;
    };
    const double u = std::clamp(x / spacing_ + 0.5 * (columns_ - 1), -1.0, static_cast<double>(columns_));
    const double v = std::clamp(y / spacing_ + 0.5 * (rows_ - 1), -1.0, static_cast<double>(rows_));
    const double fu = std::floor(u), fv = std::floor(v);
    double wu[4], du[4], wv[4], dv[4];
    weights(u - fu, wu, du);
    weights(v - fv, wv, dv);
    const int i0 = static_cast<int>(fu) - 1, j0 = static_cast<int>(fv) - 1;
    double h = 0, hx = 0, hy = 0;
    for (int j = 0; j < 4; ++j) {
        const float* row =
            control_.data() + static_cast<std::size_t>(std::clamp(j0 + j, 0, rows_ - 1)) * columns_;
        double sum = 0, slope = 0;
        for (int i = 0; i < 4; ++i) {
            const double c = row[std::clamp(i0 + i, 0, columns_ - 1)];
            sum += wu[i] * c;
            slope += du[i] * c;
        }
        h += wv[j] * sum;
        hx += wv[j] * slope;
        hy += dv[j] * sum;
    }
    *slope_x = hx / spacing_;
    *slope_y = hy / spacing_;
    return h;
}

}  // namespace burin::synthetic
