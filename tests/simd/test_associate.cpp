// SPDX-License-Identifier: MIT
// Projective association: every target against the specification, and the specification against a search of
// its own in double.
#include "simd/associate.h"

#include "kernel_test.h"

namespace burin {
namespace {

using namespace simd;

class Associate : public KernelTest {};

struct Grid {
    SurfaceGrid view;
    std::vector<float> point[3], normal[3];

    // A slanted, wavy wall, holes in it.
    Grid(Rng& rng, int width, int height, bool adversarial) {
        const Camera camera = test_camera(width, height);
        view.width = width;
        view.height = height;
        view.fx = static_cast<float>(camera.fx);
        view.fy = static_cast<float>(camera.fy);
        view.cx = static_cast<float>(camera.cx);
        view.cy = static_cast<float>(camera.cy);
        const auto cells = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
        for (int k = 0; k < 3; ++k) {
            point[k] = tight<float>(cells, 0);
            normal[k] = tight<float>(cells, 0);
            view.point[k] = point[k].data();
            view.normal[k] = normal[k].data();
        }
        for (std::size_t i = 0; i < cells; ++i) {
            const int u = static_cast<int>(i) % width, v = static_cast<int>(i) / width;
            const Vec3d ray = unproject(camera, {static_cast<double>(u), static_cast<double>(v)});
            const Vec3d p = ray * (1.5 + 0.3 * ray.x + 0.02 * rng.normal());
            const Vec3d n = normalised(Vec3d{0.2 + 0.2 * rng.normal(), 0.2 * rng.normal(), -1});
            const bool hole = rng.below(8) == 0;
            for (int k = 0; k < 3; ++k) {
                point[k][i] = hole ? NAN : static_cast<float>(p[k]);
                normal[k][i] = hole ? NAN : static_cast<float>(n[k]);
                if (adversarial && rng.below(8) == 0) point[k][i] = awkward(rng);
                if (adversarial && rng.below(8) == 0) normal[k][i] = awkward(rng);
            }
        }
    }
    static float awkward(Rng& rng) {
        return awkward_floats()[static_cast<std::size_t>(
            rng.below(static_cast<int>(awkward_floats().size())))];
    }
};

struct Points {
    std::vector<float> axis[6];
    int count;

    // Near the wall when seen from T, some beside, behind the camera, or on the border of the image.
    Points(Rng& rng, const Grid& grid, const Se3& T_view_camera, int n, bool adversarial) : count(n) {
        for (auto& a : axis) a = tight<float>((static_cast<std::size_t>(n) + 15) / 16 * 16, 0);
        const Se3 back = T_view_camera.inverse();
        for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
            double u = rng.uniform(-2, grid.view.width + 2), v = rng.uniform(-2, grid.view.height + 2);
            if (rng.below(10) == 0) u = rng.below(2) ? -0.5 : grid.view.width - 0.5;
            if (rng.below(10) == 0) v = rng.below(2) ? -0.5 : grid.view.height - 0.5;
            const Vec3d ray{(u - static_cast<double>(grid.view.cx)) / static_cast<double>(grid.view.fx),
                            (v - static_cast<double>(grid.view.cy)) / static_cast<double>(grid.view.fy), 1};
            const double behind = rng.below(20) == 0 ? -1 : 1;
            const Vec3d p = back * (ray * (behind * (1.5 + 0.3 * ray.x + 0.05 * rng.normal())));
            const Vec3d m = T_view_camera.R.transposed() *
                            normalised(Vec3d{0.2 + 0.4 * rng.normal(), 0.4 * rng.normal(), -1});
            const bool bare = rng.below(6) == 0;
            for (int k = 0; k < 3; ++k) {
                axis[k][i] = static_cast<float>(p[k]);
                axis[3 + k][i] = bare ? 0.0f : static_cast<float>(m[k]);
                if (adversarial && rng.below(8) == 0) axis[k][i] = Grid::awkward(rng);
                if (adversarial && rng.below(8) == 0) axis[3 + k][i] = Grid::awkward(rng);
            }
        }
    }
    OrientedPoints view() const {
        return {axis[0].data(), axis[1].data(), axis[2].data(),
                axis[3].data(), axis[4].data(), axis[5].data()};
    }
};

Association gates_of(const Se3& T) {
    Association by;
    for (int i = 0; i < 9; ++i) by.R[i] = static_cast<float>(T.R.m[i]);
    for (int k = 0; k < 3; ++k) by.t[k] = static_cast<float>(T.t[k]);
    by.most_m = 0.1f;
    by.least_cos = 0.8f;
    by.nearest_m = 0.05f;
    return by;
}

struct Found {
    std::vector<float> values = std::vector<float>(4 * kSampleBatch, 7);
    Found(decltype(associate)* kernel, const Grid& grid, const Association& by, const Points& points) {
        float* const g[3] = {at(1), at(2), at(3)};
        kernel(grid.view, by, points.view(), points.count, at(0), g);
    }
    float* at(int row) { return values.data() + row * kSampleBatch; }
};

TEST_P(Associate, FindsWhatTheSpecificationFinds) {
    Rng rng(170);
    long found = 0, none = 0;
    for (int round = 0; round < 1500; ++round) {
        const bool adversarial = round % 2 == 1;
        const int width = round % 10 == 0 ? 1 : 1 + rng.below(40), height = 1 + rng.below(30);
        const Grid grid(rng, width, height, adversarial);
        Se3 T = random_pose(rng, 1);
        const Points points(rng, grid, T, round % (kSampleBatch + 1), adversarial);
        Association by = gates_of(T);
        if (round % 50 == 49) by.R[rng.below(9)] = by.t[rng.below(3)] = Grid::awkward(rng);
        const Found got(associate, grid, by, points), expected(scalar::associate, grid, by, points);
        ASSERT_TRUE(same_bytes(got.values, expected.values)) << "round " << round;
        for (int i = 0; i < kSampleBatch; ++i) {
            const float d = got.values[static_cast<std::size_t>(i)];
            if (d == d) {
                ++found;
                ASSERT_LT(i, points.count);
                ASSERT_LT(std::fabs(d), by.most_m);
            } else if (i < points.count) {
                ++none;
            }
        }
    }
    EXPECT_GT(found, 5000);
    EXPECT_GT(none, 5000);
}

TEST_P(Associate, FindsTheCellAndItsPlane) {
    Rng rng(171);
    int found = 0, unsure = 0;
    for (int round = 0; round < 200; ++round) {
        const Grid grid(rng, 40, 30, false);
        const Se3 T = random_pose(rng, 1);
        const Points points(rng, grid, T, kSampleBatch, false);
        const Association by = gates_of(T);
        Found got(associate, grid, by, points);
        for (int i = 0; i < kSampleBatch; ++i) {
            const auto k = static_cast<std::size_t>(i);
            const Vec3d q = T * Vec3d{points.axis[0][k], points.axis[1][k], points.axis[2][k]};
            const Vec3d n = T.R * Vec3d{points.axis[3][k], points.axis[4][k], points.axis[5][k]};
            const double u = grid.view.fx * q.x / q.z + grid.view.cx,
                         v = grid.view.fy * q.y / q.z + grid.view.cy;
            const double column = std::floor(u + 0.5), row = std::floor(v + 0.5);
            // Which side of a border a rounded number falls is not what this test is about.
            if (std::fabs(u + 0.5 - std::round(u + 0.5)) < 1e-3 ||
                std::fabs(v + 0.5 - std::round(v + 0.5)) < 1e-3) {
                ++unsure;
                continue;
            }
            double expected = NAN, slack = 1;
            Vec3d plane{};
            if (q.z > 0.05 && column >= 0 && column < 40 && row >= 0 && row < 30) {
                const auto cell = static_cast<std::size_t>(row * 40 + column);
                const Vec3d p{grid.point[0][cell], grid.point[1][cell], grid.point[2][cell]};
                plane = {grid.normal[0][cell], grid.normal[1][cell], grid.normal[2][cell]};
                slack = std::min(std::fabs(norm(q - p) - 0.1),
                                 norm(n) > 0 ? std::fabs(dot(plane, n) - 0.8) : 1.0);
                if (norm(q - p) < 0.1 && (norm(n) == 0 || dot(plane, n) > 0.8)) expected = dot(plane, q - p);
            }
            if (slack < 1e-5) continue;
            const float d = got.at(0)[i];
            ASSERT_EQ(d == d, expected == expected) << "round " << round << " point " << i;
            if (d != d) continue;
            ++found;
            ASSERT_NEAR(static_cast<double>(d), expected, 3e-6);
            for (int axis = 0; axis < 3; ++axis)
                ASSERT_EQ(static_cast<double>(got.at(1 + axis)[i]), plane[axis]);
        }
    }
    EXPECT_GT(found, 2000);
    EXPECT_LT(unsure, 4000);
}

BURIN_EVERY_TARGET(Associate);

}  // namespace
}  // namespace burin
