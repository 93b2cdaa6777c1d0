// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <map>
#include <vector>

#include "core/camera.h"
#include "core/jobs.h"
#include "core/marching_cubes_table.h"
#include "core/se3.h"

namespace burin {
namespace {

TEST(Se3, QuaternionAndMatrixAgree) {
    for (const Quaternion q :
         {Quaternion{0, 0, 0, 1}, Quaternion{1, 0, 0, 0}, Quaternion{0, 1, 0, 0}, Quaternion{0, 0, 1, 0},
          Quaternion{0.5, -0.5, 0.5, -0.5}, Quaternion{0.1, 0.2, 0.3, 0.927}}) {
        const auto T = se3_from_quaternion({1, 2, 3}, q);
        ASSERT_TRUE(T.ok()) << T.status().text();
        EXPECT_NEAR(T->R.determinant(), 1, 1e-12);
        const Quaternion back = quaternion_of(T->R);
        const double same = std::fabs(back.x * q.x + back.y * q.y + back.z * q.z + back.w * q.w);
        EXPECT_NEAR(same, 1, 1e-3);  // the last one is given with three digits
        const Vec3d p = T->inverse() * (*T * Vec3d{0.3, -0.7, 2});
        EXPECT_NEAR(p.x, 0.3, 1e-12);
        EXPECT_NEAR(p.y, -0.7, 1e-12);
        EXPECT_NEAR(p.z, 2, 1e-12);
    }
}

TEST(Se3, RefusesWhatIsNoRigidTransform) {
    const double nan = std::nan("");
    EXPECT_FALSE(se3_from_quaternion({0, 0, nan}, {}).ok());
    EXPECT_FALSE(se3_from_quaternion({}, {0, 0, 0, 0}).ok());
    EXPECT_FALSE(se3_from_quaternion({}, {0, nan, 0, 1}).ok());
    const double scaled[12] = {1.1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    EXPECT_FALSE(se3_from_matrix(scaled, 3).ok());
    const double mirror[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    EXPECT_FALSE(se3_from_matrix(mirror, 3).ok());
    const double last[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2};
    EXPECT_FALSE(se3_from_matrix(last, 4).ok());
}

// Against the C library's functions, which the runtime does not call.
TEST(Se3, ExponentialAndLogarithmOfRotations) {
    const Vec3d axis = normalised(Vec3d{0.3, -0.8, 0.52});
    for (const double angle : {0.0, 1e-12, 1e-7, 1e-3, 0.1, 0.999, 1.5, 2.0, 3.0, 3.14}) {
        const Quaternion q = quaternion_from_vector(axis * angle);
        EXPECT_NEAR(q.w, std::cos(angle / 2), 1e-14) << angle;
        EXPECT_NEAR(q.x, axis.x * std::sin(angle / 2), 1e-14) << angle;
        EXPECT_NEAR(q.y, axis.y * std::sin(angle / 2), 1e-14) << angle;
        const Vec3d back = rotation_vector(rotation_from_vector(axis * angle));
        EXPECT_LT(norm(back - axis * angle), angle < 3.1 ? 1e-14 : 1e-12) << angle;
    }
    // Beyond half a turn: the same rotation by its shorter name. Far beyond: still a rotation.
    EXPECT_LT(norm(rotation_vector(rotation_from_vector(axis * 4)) - axis * (4 - 2 * std::acos(-1.0))),
              1e-13);
    for (const double angle : {50.0, 1e9, 1e200, 1e308})
        EXPECT_NEAR(rotation_from_vector(axis * angle).determinant(), 1, 1e-12) << angle;
    EXPECT_EQ(quaternion_from_vector({std::nan(""), 0, 0}).w, 1);
    EXPECT_EQ(rotation_vector(Mat3d{}), Vec3d{});
}

TEST(Se3, NormalisedIsOrthonormal) {
    Se3 T{rotation_from_vector({0.4, -1.1, 0.7}), {1, 2, 3}};
    const Mat3d exact = T.R;
    for (int i = 0; i < 9; ++i) T.R.m[i] += 1e-6 * (i % 4 - 1.5);
    const Se3 N = normalised(T);
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) EXPECT_NEAR(dot(N.R.column(a), N.R.column(b)), a == b ? 1 : 0, 1e-14);
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(N.R.m[i], exact.m[i], 4e-6);
    EXPECT_EQ(N.t, T.t);
}

TEST(Camera, UnprojectInvertsProjectAlsoWithDistortion) {
    Camera camera{640, 480, 517.3, 516.5, 318.6, 255.3};
    camera.k1 = 0.2624, camera.k2 = -0.9531, camera.p1 = -0.0054, camera.p2 = 0.0026,
    camera.k3 = 1.1633;  // TUM fr1
    for (double v = 0; v < 480; v += 53)
        for (double u = 0; u < 640; u += 53) {
            const Pixel back = project(camera, unproject(camera, {u, v}) * 2.5);
            EXPECT_NEAR(back.u, u, 1e-6);
            EXPECT_NEAR(back.v, v, 1e-6);
        }
}

TEST(Camera, RefusesAbsurdIntrinsics) {
    const Camera good{640, 480, 525, 525, 319.5, 239.5};
    EXPECT_TRUE(check_camera(good, "depth").ok());
    for (const auto& spoil : {+[](Camera& c) { c.width = 0; }, +[](Camera& c) { c.height = 20000; },
                              +[](Camera& c) { c.fx = -525; }, +[](Camera& c) { c.fy = 0; },
                              +[](Camera& c) { c.fx = std::nan(""); }, +[](Camera& c) { c.cx = 1e9; },
                              +[](Camera& c) { c.k1 = INFINITY; }, +[](Camera& c) { c.fx = 1e8; }}) {
        Camera bad = good;
        spoil(bad);
        EXPECT_FALSE(check_camera(bad, "depth").ok());
    }
}

TEST(Jobs, EveryItemOnceOnAnyNumberOfThreads) {
    for (int threads : {1, 2, 5}) {
        Jobs jobs(threads);
        std::vector<std::atomic<int>> hits(1000);
        for (int round = 0; round < 50; ++round)
            jobs.run(1000, [&](int item, int worker) {
                ASSERT_LT(worker, threads);
                hits[static_cast<std::size_t>(item)]++;
            });
        for (const auto& hit : hits) EXPECT_EQ(hit, 50);
    }
}

// Over random signs on a 6x6x6 lattice the surface must be closed: every directed edge of every triangle has
// its opposite exactly as often, and none is used more than once (no doubled faces, no cracks between cells).
TEST(MarchingCubesTable, SurfaceIsClosedAndManifold) {
    std::uint32_t random = 1;
    constexpr int n = 6;
    for (int round = 0; round < 200; ++round) {
        bool inside[n][n][n] = {};
        for (int z = 1; z < n - 1; ++z)
            for (int y = 1; y < n - 1; ++y)
                for (int x = 1; x < n - 1; ++x) {
                    random = random * 1664525u + 1013904223u;
                    inside[z][y][x] = random >> 31;
                }
        std::map<std::pair<int, int>, int> directed;
        for (int z = 0; z + 1 < n; ++z)
            for (int y = 0; y + 1 < n; ++y)
                for (int x = 0; x + 1 < n; ++x) {
                    int config = 0;
                    for (int i = 0; i < 8; ++i)
                        config |= inside[z + (i >> 2 & 1)][y + (i >> 1 & 1)][x + (i & 1)] << i;
                    const CubeTriangles& cell = kMarchingCubes[static_cast<std::size_t>(config)];
                    const auto id = [&](int e) {
                        const int c = kCubeEdges[static_cast<std::size_t>(e)].corner;
                        const int cell_id = ((z + (c >> 2 & 1)) * n + y + (c >> 1 & 1)) * n + x + (c & 1);
                        return cell_id * 3 + kCubeEdges[static_cast<std::size_t>(e)].axis;
                    };
                    for (int t = 0; t < cell.count; ++t)
                        for (int k = 0; k < 3; ++k)
                            directed[{id(cell.edge[t][k]), id(cell.edge[t][(k + 1) % 3])}]++;
                }
        for (const auto& [edge, uses] : directed) {
            EXPECT_EQ(uses, 1);
            EXPECT_EQ((directed[{edge.second, edge.first}]), 1);
        }
    }
}

}  // namespace
}  // namespace burin
