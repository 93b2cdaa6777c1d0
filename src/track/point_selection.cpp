// SPDX-License-Identifier: MIT
#include "track/point_selection.h"

#include <algorithm>
#include <cmath>

#include "depth/filters.h"
#include "track/normal_equations.h"
#include "track/reference_view.h"

namespace burin {
namespace {

constexpr int kCells = TrackPoints::kMostPoints / 4;
constexpr int kRowsPerItem = 8;  // of cells: some 50 us

// Of a cell's points, kept by how much it holds beside the average cell. 4 of 4 from twice the average on, 1
// of 4 below half of it: half of all points on the sequences of docs/tracking.md, with the same errors.
constexpr float kKeepAll = 2.0f, kKeepHalf = 0.5f;

// Brightness of a cell in levels that a block's mean is good to, as in photometric.cpp.
constexpr float kInverseSigmaGrey = 0.5f;

void motion_row(Vec3f p, Vec3f gradient, float* row) {
    const Vec3f arm = cross(p, gradient);
    for (int i = 0; i < 3; ++i) {
        row[i] = gradient[i];
        row[3 + i] = arm[i];
    }
}

// Gradient of the brightness by the point, 1 / metres times levels; zero where a neighbour lacks.
Vec3f brightness_gradient(const TrackLevel& level, const float* grey, int column, int row, Vec3f p) {
    if (column == 0 || row == 0 || column + 1 == level.width || row + 1 == level.height) return {};
    const float* g = grey + row * level.width + column;
    const float left = g[-1], right = g[1], up = g[-level.width], down = g[level.width];
    if (left < 0 || right < 0 || up < 0 || down < 0) return {};
    const float inverse_z = 1.0f / p.z;
    const float du = 0.5f * (right - left) * static_cast<float>(level.camera.fx) * inverse_z;
    const float dv = 0.5f * (down - up) * static_cast<float>(level.camera.fy) * inverse_z;
    return {du, dv, -(du * p.x + dv * p.y) * inverse_z};
}

// The inverse of a symmetric positive definite matrix with a little added to its diagonal, so that there
// always is one: columns by the solver of the normal equations.
bool inverse_of(NormalEquations system, double inverse[6][6]) {
    for (int i = 0; i < 6; ++i) system.A[i][i] += 1e-9 + 1e-6 * system.A[i][i];
    for (int c = 0; c < 6; ++c) {
        for (int i = 0; i < 6; ++i) system.b[i] = i == c ? -1 : 0;
        Twist column;
        if (!system.solve(0, &column)) return false;
        for (int i = 0; i < 3; ++i) {
            inverse[i][c] = column.v[i];
            inverse[3 + i][c] = column.w[i];
        }
    }
    return true;
}

}  // namespace

void PointSelection::place(Arena& arena) {
    leverage_ = arena.allocate<float>(kCells, 64);
    rows_ = arena.allocate<float>(std::size_t{12} * kCells, 64);
}

void PointSelection::select(TrackPoints& points, const PointBrightness* brightness, Jobs& jobs) {
    const TrackLevel& cells = points.level(1);
    const PointGrid grid = grid_of(cells);
    const int count = cells.width * cells.height;
    const auto in_rows = [&](auto&& body) {
        jobs.run((cells.height + kRowsPerItem - 1) / kRowsPerItem, [&](int item, int) {
            const int end = std::min(cells.height, (item + 1) * kRowsPerItem) * cells.width;
            for (int i = item * kRowsPerItem * cells.width; i < end; ++i) body(i);
        });
    };
    in_rows([&](int i) {
        float* row = rows_ + 12 * i;
        std::fill_n(row, 12, 0.0f);
        if (cells.grid_z[i] == 0) return;
        const Vec3f p{cells.grid_x[i], cells.grid_y[i], cells.grid_z[i]};
        motion_row(p, grid_normal(grid, i) * (1.0f / axial_noise_m(p.z)), row);
        if (brightness)
            motion_row(p,
                       brightness_gradient(cells, brightness->grid(1), i % cells.width, i / cells.width, p) *
                           kInverseSigmaGrey,
                       row + 6);
    });
    NormalEquations depth, grey;
    for (int i = 0; i < count; ++i)
        for (int half = 0; half < 2; ++half) {
            const float* j = rows_ + 12 * i + 6 * half;
            double(&A)[6][6] = half == 0 ? depth.A : grey.A;
            for (int r = 0; r < 6; ++r)
                for (int c = 0; c <= r; ++c) A[r][c] += static_cast<double>(j[r]) * static_cast<double>(j[c]);
        }
    double inverse[2][6][6];
    const bool held[2] = {inverse_of(depth, inverse[0]),
                          brightness != nullptr && inverse_of(grey, inverse[1])};
    if (!held[0]) return;
    in_rows([&](int i) {
        double leverage = 0;
        for (int half = 0; half < 2; ++half) {
            if (!held[half]) continue;
            const float* j = rows_ + 12 * i + 6 * half;
            for (int r = 0; r < 6; ++r)
                for (int c = 0; c < 6; ++c)
                    leverage += static_cast<double>(j[r]) * inverse[half][r][c] * static_cast<double>(j[c]);
        }
        leverage_[i] = static_cast<float>(leverage);
    });
    double sum = 0;
    for (int i = 0; i < count; ++i) sum += static_cast<double>(leverage_[i]);
    const float average = static_cast<float>(sum / std::max(cells.count, 1));
    points.thin_finest([&](int column, int row) {
        const int x = column / 2, y = row / 2;
        if (x >= cells.width || y >= cells.height) return true;
        const float leverage = leverage_[y * cells.width + x];
        if (leverage >= kKeepAll * average) return true;
        const int child = (column & 1) + 2 * (row & 1);
        // One of the four by turns, so that no direction of the grid is preferred; half: it and the one
        // across.
        const int turn = (x + 2 * y) & 3;
        if (leverage >= kKeepHalf * average) return child == turn || child == (turn ^ 3);
        return child == turn;
    });
}

}  // namespace burin
