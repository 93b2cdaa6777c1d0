// SPDX-License-Identifier: MIT
// Filters of depth images: bilateral, removal of edges, pyramid, normals.
#include <gtest/gtest.h>

#include "depth/filters.h"
#include "scene_helpers.h"

namespace burin {
namespace {

DepthOptions options(bool bilateral, bool edge_removal) {
    DepthOptions o;
    o.max_width = 160;
    o.max_height = 120;
    o.bilateral = bilateral;
    o.edge_removal = edge_removal;
    return o;
}

TEST(Bilateral, HalvesNoiseAndKeepsEdges) {
    // A step from 1.0 to 1.5 m under the sensor's own noise (some 2 mm at 1 m).
    Rng rng(5);
    Image<float> raw(160, 120);
    const auto truth = [](int x) { return x < 80 ? 1.0 : 1.5; };
    for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 160; ++x)
            raw.view().at(x, y) = static_cast<float>(
                truth(x) + rng.normal() * static_cast<double>(axial_noise_m(static_cast<float>(truth(x)))));
    TestDepth plain(options(false, false)), filtered(options(true, false));
    plain.prepare(frame_of(raw, test_camera(), {}));
    filtered.prepare(frame_of(raw, test_camera(), {}));
    const auto rms = [&](const TestDepth& depth, int x0, int x1) {
        double sum = 0;
        for (int y = 2; y < 118; ++y)
            for (int x = x0; x < x1; ++x) sum += std::pow(depth.metres(x, y) - truth(x), 2);
        return std::sqrt(sum / (116 * (x1 - x0)));
    };
    for (const int x0 : {10, 90}) EXPECT_LT(rms(filtered, x0, x0 + 60), 0.5 * rms(plain, x0, x0 + 60));
    // Beside the edge half of the window is left, and nothing of the other side comes in.
    EXPECT_LT(rms(filtered, 78, 82), 0.65 * rms(plain, 78, 82));
    for (int y = 0; y < 120; ++y)
        for (int x = 78; x < 82; ++x) EXPECT_NEAR(filtered.metres(x, y), truth(x), 0.02);
}

TEST(Bilateral, NeitherInventsNorDropsDepth) {
    Rng rng(6);
    Image<float> raw(97, 61);
    for (float& d : raw.pixels) d = rng.below(3) ? static_cast<float>(rng.uniform(0.3, 3.9)) : 0.0f;
    TestDepth depth(options(true, false));
    const DepthImage& image = depth.prepare(frame_of(raw, test_camera(97, 61), {}));
    for (int y = 0; y < 61; ++y)
        for (int x = 0; x < 97; ++x) ASSERT_EQ(image.at(x, y) != 0, raw.view().at(x, y) != 0);
}

TEST(Bilateral, AgreesWithThePlainFormula) {
    // Up to the borders, with holes; exp(-t) as (1 - t / 8)^8, see filters.cpp.
    Rng rng(7);
    Image<float> raw(41, 33);
    for (float& d : raw.pixels) d = rng.below(6) ? static_cast<float>(1.5 + 0.01 * rng.normal()) : 0.0f;
    TestDepth plain(options(false, false)), filtered(options(true, false));
    const DepthImage& in = plain.prepare(frame_of(raw, test_camera(41, 33), {}));
    filtered.prepare(frame_of(raw, test_camera(41, 33), {}));
    for (int y = 0; y < 33; ++y)
        for (int x = 0; x < 41; ++x) {
            if (in.at(x, y) == 0) continue;
            const double sigma =
                3 * static_cast<double>(axial_noise_m(static_cast<float>(plain.metres(x, y))));
            double sum = 0, total = 0;
            for (int v = std::max(0, y - 2); v <= std::min(32, y + 2); ++v)
                for (int u = std::max(0, x - 2); u <= std::min(40, x + 2); ++u) {
                    if (in.at(u, v) == 0) continue;
                    const double d = plain.metres(u, v) - plain.metres(x, y),
                                 r2 = (u - x) * (u - x) + (v - y) * (v - y);
                    const double w = std::pow(std::max(0.0, 1 - d * d / (2 * sigma * sigma) / 8), 8) *
                                     std::exp(-r2 / (2 * 1.5 * 1.5));
                    sum += w * d;
                    total += w;
                }
            ASSERT_NEAR(filtered.metres(x, y), plain.metres(x, y) + sum / total, 4.0 / 65534)
                << x << ' ' << y;
        }
}

TEST(Bilateral, LeavesAPlaneAlone) {
    const AnalyticScene plane{{{normalised(Vec3d{0.5, 0, -1}), -1.0}}, {}};
    const Image<float> raw = plane.depth(test_camera(), {});
    TestDepth depth(options(true, false));
    depth.prepare(frame_of(raw, test_camera(), {}));
    for (int y = 3; y < 117; ++y)
        for (int x = 3; x < 157; ++x)
            if (raw.view().at(x, y) > 0.3f && raw.view().at(x, y) < 3.0f) {
                ASSERT_NEAR(depth.metres(x, y), static_cast<double>(raw.view().at(x, y)), 0.002);
            }
}

TEST(EdgeRemoval, DropsTheRimAndNothingElse) {
    Image<std::uint16_t> raw(20, 12, 1, 2000);
    for (int y = 3; y < 9; ++y)
        for (int x = 5; x < 15; ++x) raw.view().at(x, y) = 1000;
    raw.view().at(1, 1) = 0;  // a hole is no edge
    TestDepth depth(options(false, true));
    const DepthImage& image = depth.prepare(frame_of(raw, 0.001, test_camera(20, 12), {}));
    for (int y = 0; y < 12; ++y)
        for (int x = 0; x < 20; ++x) {
            const auto inside = [](int u, int v) { return u >= 5 && u < 15 && v >= 3 && v < 9; };
            const bool rim = inside(x, y) != inside(x + 1, y) || inside(x, y) != inside(x - 1, y) ||
                             inside(x, y) != inside(x, y + 1) || inside(x, y) != inside(x, y - 1);
            EXPECT_EQ(image.at(x, y), rim ? 0 : raw.view().at(x, y)) << x << ' ' << y;
        }
}

TEST(EdgeRemoval, ThenBilateral) {
    Image<float> raw(20, 12, 1, 2.0f);
    for (int y = 0; y < 12; ++y)
        for (int x = 0; x < 10; ++x) raw.view().at(x, y) = 1.0f;
    TestDepth depth(options(true, true));
    const DepthImage& image = depth.prepare(frame_of(raw, test_camera(20, 12), {}));
    for (int y = 0; y < 12; ++y)
        for (int x = 0; x < 20; ++x) {
            if (x == 9 || x == 10) {
                EXPECT_EQ(image.at(x, y), 0);
            } else {
                EXPECT_NEAR(depth.metres(x, y), x < 10 ? 1.0 : 2.0, 1e-4);
            }
        }
}

TEST(Pyramid, MeansOfWhatBelongsTogether) {
    Image<std::uint16_t> raw(6, 4);
    raw.pixels = {1000, 1002, 1000, 3000, 0,    0,     //
                  1004, 1006, 3000, 3000, 0,    0,     //
                  0,    1500, 2000, 2010, 3999, 3998,  //
                  0,    0,    0,    2020, 3997, 3999};
    TestDepth depth(options(false, false));
    const DepthImage& image = depth.prepare(frame_of(raw, 0.001, test_camera(6, 4), {}));
    std::vector<std::uint16_t> out((3 + 2) * (2 + 2));
    const DepthImage half = half_sample(image, out.data());
    const int expected[2][3] = {{1003, 1000, 0}, {1500, 2010, 3998}};
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 3; ++x) EXPECT_EQ(half.at(x, y), expected[y][x]) << x << ' ' << y;
    EXPECT_EQ(half.valid, 5u);
}

TEST(Pyramid, HalfTheImageSeesTheSamePlane) {
    const AnalyticScene plane{{{normalised(Vec3d{0.4, 0.3, -1}), -1.2}}, {}};
    TestDepth depth(options(false, false));
    const DepthImage& image = depth.prepare(frame_of(plane.depth(test_camera(), {}), test_camera(), {}));
    std::vector<std::uint16_t> out(82 * 62);
    const DepthImage half = half_sample(image, out.data());
    for (int y = 0; y < half.height; ++y)
        for (int x = 0; x < half.width; ++x) {
            if (half.at(x, y) == 0) continue;
            const double truth =
                plane.trace({}, unproject(half.camera, {static_cast<double>(x), static_cast<double>(y)}));
            ASSERT_NEAR(static_cast<double>(half.at(x, y)) * static_cast<double>(half.unit_m), truth, 0.0015)
                << x << ' ' << y;
        }
}

TEST(Normals, OfATiltedPlane) {
    // Exact but for the quantisation of depth: at the default step of 4 m / 65534 that is 0.2 degrees at this
    // scale.
    for (const Vec3d direction : {Vec3d{0, 0, -1}, Vec3d{0.7, 0.2, -1}, Vec3d{-0.2, 1.2, -1}}) {
        const Vec3d n = normalised(direction);
        const AnalyticScene plane{{{n, -1.2}}, {}};
        TestDepth depth(options(false, false));
        const DepthImage& image = depth.prepare(frame_of(plane.depth(test_camera(), {}), test_camera(), {}));
        std::vector<float> normals(3 * 160 * 120);
        compute_normals(image, normals.data(), depth.jobs);
        int count = 0;
        for (int y = 1; y < 119; ++y)
            for (int x = 1; x < 159; ++x) {
                const float* got = &normals[3 * static_cast<std::size_t>(y * 160 + x)];
                if (image.at(x, y) == 0 || (got[0] == 0 && got[1] == 0 && got[2] == 0)) continue;
                const double cosine = static_cast<double>(got[0]) * n.x + static_cast<double>(got[1]) * n.y +
                                      static_cast<double>(got[2]) * n.z;
                ASSERT_GT(cosine, std::cos(0.5 * M_PI / 180))
                    << x << ' ' << y << ' ' << std::acos(cosine) * 180 / M_PI << " degrees";
                ++count;
            }
        EXPECT_GT(count, 5000);
    }
}

TEST(Normals, NeedSupportOnBothAxes) {
    Image<std::uint16_t> raw(5, 5);
    raw.view().at(2, 2) = 1000;
    raw.view().at(1, 2) = 1000;
    TestDepth depth(options(false, false));
    const DepthImage& image = depth.prepare(frame_of(raw, 0.001, test_camera(5, 5), {}));
    EXPECT_EQ(normal_at(image, 2, 2), Vec3f{});  // nothing above or below
    EXPECT_EQ(normal_at(image, 0, 0), Vec3f{});
}

}  // namespace
}  // namespace burin
