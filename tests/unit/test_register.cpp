// SPDX-License-Identifier: MIT
// Registration against ray casting: two cameras look at planes and a box before them; what each sees is
// known.
#include "capture/register.h"

#include <gtest/gtest.h>

#include <cmath>

#include "scene_helpers.h"
#include "simd/targets.h"

namespace burin {
namespace {

constexpr double kUnit_m = 0.0005;

// A wall that leans, and a box of 0.4 m before it, in coordinates of the depth camera.
struct World {
    double lean = 0.3, wall_m = 2.0, box_m = 1.2, box_half_m = 0.2;
    bool box = true;
    // Distance along `ray` (z = 1 is not needed) from `origin`; 0 when it meets nothing.
    double cast(Vec3d origin, Vec3d ray, bool* on_box = nullptr) const {
        if (on_box) *on_box = false;
        if (box && ray.z > 1e-9) {
            const double s = (box_m - origin.z) / ray.z;
            const Vec3d p = origin + ray * s;
            if (s > 0 && std::fabs(p.x) < box_half_m && std::fabs(p.y) < box_half_m) {
                if (on_box) *on_box = true;
                return s;
            }
        }
        // z = wall + lean x
        const double down = ray.z - lean * ray.x;
        return down > 1e-9 ? (wall_m + lean * origin.x - origin.z) / down : 0.0;
    }
};

Image<std::uint16_t> render(const World& world, const Camera& camera, const Se3& T_world_camera) {
    Image<std::uint16_t> image(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
            const Vec3d ray = unproject(camera, {static_cast<double>(x), static_cast<double>(y)});
            const double z = world.cast(T_world_camera.t, T_world_camera.R * ray);
            image.view().at(x, y) = static_cast<std::uint16_t>(std::lround(z / kUnit_m));
        }
    return image;
}

struct Compared {
    int same = 0, holes = 0, wrong = 0, pixels = 0;
};
// Where the colour camera's depth is known on both sides (no edge within two pixels) and the depth camera
// sees it.
Compared compare(const World& world, const Camera& depth, const Camera& colour, const Se3& T_colour_depth,
                 View<const std::uint16_t> got, double tolerance_m) {
    Compared c;
    const Se3 T_depth_colour = T_colour_depth.inverse();
    const Image<std::uint16_t> truth = render(world, colour, T_depth_colour);
    for (int y = 2; y < colour.height - 2; ++y)
        for (int x = 2; x < colour.width - 2; ++x) {
            const double z = truth.view().at(x, y) * kUnit_m;
            bool edge = false;
            for (int dy = -2; dy <= 2; ++dy)
                for (int dx = -2; dx <= 2; ++dx)
                    edge |= std::fabs(truth.view().at(x + dx, y + dy) * kUnit_m - z) > 0.1;
            // Seen by the depth camera: inside its image, nothing before it.
            const Vec3d p =
                T_depth_colour * (unproject(colour, {static_cast<double>(x), static_cast<double>(y)}) * z);
            if (p.z <= 0 || edge) continue;
            const Pixel at = project(depth, p);
            if (at.u < 2 || at.v < 2 || at.u > depth.width - 3 || at.v > depth.height - 3) continue;
            bool hidden = false;
            for (double du : {-2.0, 0.0, 2.0}) {
                const Vec3d ray = unproject(depth, {at.u + du, at.v});
                hidden |= world.cast({}, ray) < p.z - 0.1 || world.cast({}, ray) > p.z + 0.1;
            }
            if (hidden) continue;
            ++c.pixels;
            const int there = got.at(x, y);
            if (there == 0)
                ++c.holes;
            else if (std::fabs(there * kUnit_m - z) < tolerance_m)
                ++c.same;
            else
                ++c.wrong;
        }
    return c;
}

const Camera kDepth{160, 120, 146, 146, 79.5, 59.5};
Se3 extrinsic() {
    Se3 T;
    T.R = rotation_from_vector({0.01, -0.02, 0.015});
    T.t = {-0.05, 0.004, 0.006};
    return T;
}

TEST(Register, GivesWhatTheColourCameraSees) {
    const World world;
    Camera distorted = kDepth;
    distorted.k1 = -0.15, distorted.p1 = 0.002;
    Camera lens{200, 150, 170, 170, 98, 76};
    lens.k1 = 0.1, lens.k2 = -0.15, lens.p2 = 0.001;
    const struct {
        Camera depth, colour;
    } kPairs[] = {
        {kDepth, {160, 120, 131, 131, 80, 60}},    // smaller
        {kDepth, {160, 120, 150, 150, 78, 61}},    // the same size
        {kDepth, {320, 240, 300, 300, 160, 119}},  // twice as large
        {kDepth, {480, 270, 470, 465, 240, 135}},  // thrice
        {kDepth, {64, 48, 55, 55, 31.5, 23.5}},    // less than half
        {distorted, {160, 120, 150, 150, 78, 61}}, {kDepth, lens}, {distorted, lens},
    };
    for (const auto& pair : kPairs) {
        const Image<std::uint16_t> depth = render(world, pair.depth, {});
        ImageRegistration r;
        ASSERT_TRUE(r.configure(pair.depth, kUnit_m, pair.colour, extrinsic()).ok());
        Image<std::uint16_t> out(pair.colour.width, pair.colour.height, 1, 7);
        ASSERT_TRUE(r.depth_to_colour(depth.view(), out.view()).ok());
        // A depth pixel's value stands for all that it covers: half a pixel of the lean.
        const Compared c = compare(world, pair.depth, pair.colour, extrinsic(), out.view(), 0.012);
        EXPECT_GT(c.pixels, pair.colour.width * pair.colour.height / 4) << pair.colour.width;
        EXPECT_EQ(c.holes, 0) << pair.colour.width << " of " << c.pixels;
        EXPECT_EQ(c.wrong, 0) << pair.colour.width << " of " << c.pixels;
    }
}

TEST(Register, ASurfaceThatLeansStaysWhole) {
    World world;
    world.box = false;
    world.lean = 0.95;    // 43.5 degrees
    world.wall_m = 1.25;  // 0.82 m at the left of the image, where neighbours part most
    for (const double side : {-0.05, 0.05}) {
        Se3 T;
        T.t = {side, 0, 0};
        for (const Camera& colour : {kDepth, Camera{320, 240, 292, 292, 159.5, 119.5}}) {
            ImageRegistration r;
            ASSERT_TRUE(r.configure(kDepth, kUnit_m, colour, T).ok());
            Image<std::uint16_t> out(colour.width, colour.height);
            ASSERT_TRUE(r.depth_to_colour(render(world, kDepth, {}).view(), out.view()).ok());
            const Compared c = compare(world, kDepth, colour, T, out.view(), 0.03);
            EXPECT_GT(c.pixels, colour.width * colour.height / 3);
            EXPECT_EQ(c.holes, 0) << side << " of " << c.pixels;
            EXPECT_EQ(c.wrong, 0) << side << " of " << c.pixels;
        }
    }
}

TEST(Register, NothingThatCannotBeSeen) {
    // Behind the box, as the depth camera sees it, the colour camera sees wall that no depth pixel fell on.
    const World world;
    const Camera colour{160, 120, 146, 146, 79.5, 59.5};
    Se3 aside;
    aside.t = {-0.15, 0, 0};  // the colour camera stands 0.15 m to the right
    ImageRegistration r;
    ASSERT_TRUE(r.configure(kDepth, kUnit_m, colour, aside).ok());
    const Image<std::uint16_t> depth = render(world, kDepth, {});
    Image<std::uint16_t> out(colour.width, colour.height);
    ASSERT_TRUE(r.depth_to_colour(depth.view(), out.view()).ok());
    int empty = 0;
    for (int x = 1; x < colour.width - 1; ++x) empty += out.view().at(x, 60) == 0;
    // Parallax between 1.2 m and some 2 m: 146 px * 0.15 m * (1/1.2 - 1/2); and what lies beside the image.
    EXPECT_NEAR(empty, 7 + 11, 5);
    // The box's own columns have the box's depth, wherever wall came to lie under it.
    const int middle = static_cast<int>(std::lround(79.5 - 146 * 0.15 / 1.2));
    EXPECT_NEAR(out.view().at(middle, 60) * kUnit_m, 1.2, 0.001);
}

TEST(Register, ColourWhereTheColourCameraSeesTheSamePoint) {
    const World world;
    const Camera colour{320, 240, 292, 292, 159.5, 119.5};
    Se3 aside;
    aside.t = {-0.15, 0, 0};
    // The box red, the wall green, by what the colour camera sees.
    Image<std::uint8_t> rgb(colour.width, colour.height, 3);
    const Se3 back = aside.inverse();
    for (int y = 0; y < colour.height; ++y)
        for (int x = 0; x < colour.width; ++x) {
            bool box = false;
            world.cast(back.t, back.R * unproject(colour, {static_cast<double>(x), static_cast<double>(y)}),
                       &box);
            rgb.view().at(x, y, box ? 0 : 1) = 200;
        }
    const Image<std::uint16_t> depth = render(world, kDepth, {});
    ImageRegistration r;
    ASSERT_TRUE(r.configure(kDepth, kUnit_m, colour, aside).ok());
    Image<std::uint16_t> registered(colour.width, colour.height);
    Image<std::uint8_t> out(kDepth.width, kDepth.height, 3, 7), mask(kDepth.width, kDepth.height, 1, 7);
    ASSERT_TRUE(r.depth_to_colour(depth.view(), registered.view()).ok());
    ASSERT_TRUE(r.colour_to_depth(rgb.view(), depth.view(), registered.view(), out.view(), mask.view()).ok());
    int seen = 0, hidden = 0, wrong = 0;
    for (int y = 2; y < kDepth.height - 2; ++y)
        for (int x = 2; x < kDepth.width - 2; ++x) {
            bool box = false;
            const Vec3d ray = unproject(kDepth, {static_cast<double>(x), static_cast<double>(y)});
            const Vec3d p = ray * world.cast({}, ray, &box);
            bool edge = false;
            for (int dx = -2; dx <= 2; ++dx)
                edge |= std::abs(depth.view().at(x + dx, y) - depth.view().at(x, y)) > 100 ||
                        std::abs(depth.view().at(x, y + (dx > 0) - (dx < 0)) - depth.view().at(x, y)) > 100;
            if (edge) continue;
            const Vec3d from_colour = p - back.t;
            const double reach = world.cast(back.t, from_colour);
            const Pixel at = project(colour, aside * p);
            const bool inside = at.u > 1 && at.v > 1 && at.u < colour.width - 2 && at.v < colour.height - 2;
            if (inside && reach < 0.9) {  // the box stands before it
                ++hidden;
                if (mask.view().at(x, y) != 0) ++wrong;
            } else if (inside && mask.view().at(x, y) == 255) {
                ++seen;
                if (out.view().at(x, y, box ? 0 : 1) != 200) ++wrong;
            } else if (!inside && (at.u < -1 || at.u > colour.width)) {
                EXPECT_EQ(mask.view().at(x, y), 0);
            }
        }
    EXPECT_GT(seen, 12000);
    EXPECT_GT(hidden, 150);
    // The rim of the box as the colour image has it is a pixel wide.
    EXPECT_LT(wrong, 60);
}

TEST(Register, SameBytesOnEveryTarget) {
    Rng rng(310);
    Camera lens{200, 150, 170, 170, 98, 76};
    lens.k1 = 0.1, lens.k2 = -0.15, lens.p2 = 0.001;
    Camera odd{131, 77, 110, 110, 65, 38};
    odd.k1 = -0.1;
    Image<std::uint16_t> noise(odd.width, odd.height);
    for (auto& d : noise.pixels)
        d = static_cast<std::uint16_t>(rng.below(8) ? 500 + rng.below(6000) : rng.below(65536));
    Image<std::uint8_t> rgb(lens.width, lens.height, 3);
    for (auto& v : rgb.pixels) v = static_cast<std::uint8_t>(rng.below(256));
    std::vector<std::uint16_t> first;
    std::vector<std::uint8_t> first_colours;
    for (const std::string& target : simd::target_names()) {
        ASSERT_TRUE(simd::select_target(target));
        ImageRegistration r;
        ASSERT_TRUE(r.configure(odd, kUnit_m, lens, extrinsic()).ok());
        Image<std::uint16_t> out(lens.width, lens.height);
        Image<std::uint8_t> colours(odd.width, odd.height, 3), mask(odd.width, odd.height);
        ASSERT_TRUE(r.depth_to_colour(noise.view(), out.view()).ok());
        ASSERT_TRUE(
            r.colour_to_depth(rgb.view(), noise.view(), out.view(), colours.view(), mask.view()).ok());
        if (first.empty()) {
            first = out.pixels;
            first_colours = colours.pixels;
        }
        EXPECT_EQ(out.pixels, first) << target;
        EXPECT_EQ(colours.pixels, first_colours) << target;
    }
    ASSERT_TRUE(simd::select_target(""));
}

TEST(Register, StridedImagesAndBadOnes) {
    const World world;
    const Camera colour{160, 120, 150, 150, 78, 61};
    ImageRegistration r;
    Image<std::uint16_t> depth = render(world, kDepth, {}), out(colour.width, colour.height),
                         wide(200, colour.height, 1, 7);
    EXPECT_EQ(r.depth_to_colour(depth.view(), out.view()).code(), Code::state);
    ASSERT_TRUE(r.configure(kDepth, kUnit_m, colour, extrinsic()).ok());
    ASSERT_TRUE(r.depth_to_colour(depth.view(), out.view()).ok());
    ASSERT_TRUE(r.depth_to_colour(depth.view(), {wide.pixels.data(), colour.width, colour.height, 200}).ok());
    for (int y = 0; y < colour.height; ++y)
        for (int x = 0; x < 200; ++x)
            ASSERT_EQ(wide.view().at(x, y), x < colour.width ? out.view().at(x, y) : 7);
    EXPECT_EQ(r.depth_to_colour(out.view(), wide.view()).code(), Code::invalid_argument);
    Camera bad = colour;
    bad.fx = 0;
    EXPECT_FALSE(r.configure(kDepth, kUnit_m, bad, {}).ok());
    EXPECT_FALSE(r.configured());
    EXPECT_FALSE(r.configure(kDepth, 0, colour, {}).ok());
    Se3 nowhere;
    nowhere.t.x = NAN;
    EXPECT_FALSE(r.configure(kDepth, kUnit_m, colour, nowhere).ok());
    // Turned away: nothing of the depth image is in view.
    Se3 back;
    back.R = {{-1, 0, 0, 0, 1, 0, 0, 0, -1}};
    ASSERT_TRUE(r.configure(kDepth, kUnit_m, colour, back).ok());
    ASSERT_TRUE(r.depth_to_colour(depth.view(), out.view()).ok());
    for (const std::uint16_t d : out.pixels) ASSERT_EQ(d, 0);
}

}  // namespace
}  // namespace burin
