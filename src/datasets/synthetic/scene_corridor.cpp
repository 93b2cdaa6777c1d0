// SPDX-License-Identifier: MIT
// A corridor 2 m wide and 2.6 m high that runs once around a block: outer walls 20 x 12 m, inner block 16 x 8
// m, centred on the origin. The middle 1.2 m stay free for walking.
#include <utility>

#include "datasets/synthetic/furniture.h"

namespace burin::synthetic {
namespace {

constexpr double kOuterX = 10, kOuterY = 6, kInnerX = 8, kInnerY = 4, kHeight = 2.6;  // metres

// Something on the floor or on the wall at `p` (on the wall); `yaw` turns +y to the wall's inward normal `n`.
void add_fitting(SceneBuilder& b, Vec3d p, Vec3d n, double yaw) {
    const auto off = [&](double gap) { return p + n * gap; };
    switch (b.random.below(9)) {
        case 0:
        case 1:
            return add_door(b, p, yaw, 0.9, 2.05);
        case 2: {
            const double width = b.random.in(0.5, 1.1), height = b.random.in(0.4, 0.8);
            return add_picture(b, {p.x, p.y, b.random.in(1.4, 1.6)}, yaw, width, height);
        }
        case 3: {  // pillar half in the wall
            b.object(kNone, p, yaw);
            const int stone = b.material(Texture::mottled, b.pale_colour(), {0.3f, 0.3f, 0.3f}, 0.2);
            if (b.random.below(2))
                b.box({-0.16, -0.2, -0.01}, {0.16, 0.16, kHeight + 0.01}, stone);
            else
                b.add(Shape::cylinder, {0, 0.05, 0.5 * kHeight}, {0.17, 0, 0.5 * kHeight + 0.01}, stone);
            return;
        }
        case 4: {
            const double radius = b.random.in(0.13, 0.17), height = b.random.in(0.35, 0.6);
            return add_bin(b, off(0.2), radius, height);
        }
        case 5: {
            const double wide = b.random.in(0.3, 0.55), tall = b.random.in(0.2, 0.5);
            add_carton(b, off(0.22), yaw + b.random.in(-0.2, 0.2), {wide, 0.32, tall});
            add_carton(b, off(0.2) + Vec3d{0, 0, tall - 0.001}, yaw + b.random.in(-0.3, 0.3),
                       {0.6 * wide, 0.24, 0.2});
            return;
        }
        case 6: {  // bench
            b.object(kSeat, p, yaw);
            const int wood = b.random_wood(), iron = b.material(Texture::plain, {0.12f, 0.12f, 0.13f}, {});
            b.box({-0.7, 0.02, 0.4}, {0.7, 0.36, 0.44}, wood);
            for (double s : {-1.0, 1.0})
                b.box({s * 0.58 - 0.03, 0.05, -0.004}, {s * 0.58 + 0.03, 0.33, 0.41}, iron);
            return;
        }
        case 7:
            return add_plant(b, off(0.27), b.random.in(0.7, 1.0));
        default: {  // fire extinguisher below a board
            b.object(kNone, p, yaw);
            const int red = b.material(Texture::plain, {0.55f, 0.03f, 0.03f}, {}),
                      black = b.material(Texture::plain, {0.04f, 0.04f, 0.04f}, {});
            b.limb({0, 0.1, 0.5}, 0.075, {0, 0.1, 0.9}, 0.07, red);
            b.limb({0, 0.1, 0.9}, 0.025, {0, 0.1, 1.02}, 0.02, black);
            b.limb({0, 0.1, 1.0}, 0.014, {0.08, 0.12, 1.03}, 0.012, black);
            const int board = b.two_tone(Texture::picture, 0.1, 0.15, 0.2);
            b.box({-0.15, -0.01, 1.3}, {0.15, 0.02, 1.7}, board);
        }
    }
}

}  // namespace

SceneData corridor_scene(std::uint64_t seed) {
    SceneBuilder b("corridor", seed);
    const Vec3f paint = b.pale_colour(), ornament = b.bright_colour(), tone = b.pale_colour();
    b.object(kFloor);
    b.plane({}, {0, 0, 1}, {1, 0, 0}, kOuterX, kOuterY,
            b.material(Texture::tiles, tone, {0.2f, 0.2f, 0.2f}, 0.5));
    b.object(kCeiling);
    b.plane({0, 0, kHeight}, {0, 0, -1}, {1, 0, 0}, kOuterX, kOuterY,
            b.material(Texture::tiles, {0.7f, 0.7f, 0.68f}, {0.45f, 0.45f, 0.44f}, 0.6));
    const Vec3d inward[4] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}};
    for (int i = 0; i < 4; ++i) {
        b.object(kWall);
        const Vec3f own = b.pale_colour();
        const Vec3f shade = (paint + own) * static_cast<float>(b.random.in(0.4, 0.5));
        const double far = i < 2 ? kOuterX : kOuterY, half = i < 2 ? kOuterY : kOuterX;
        b.plane({-far * inward[i].x, -far * inward[i].y, 0.5 * kHeight}, inward[i],
                cross(Vec3d{0, 0, 1}, inward[i]), half, 0.5 * kHeight,
                b.material(i & 1 ? Texture::wallpaper : Texture::mottled, shade,
                           shade * 0.6f + ornament * 0.2f, i & 1 ? 0.2 : 0.7));
    }
    b.object(kWall);
    b.add(Shape::box, {0, 0, 0.5 * kHeight}, {kInnerX, kInnerY, 0.5 * kHeight + 0.005},
          b.material(Texture::mottled, b.pale_colour(), paint * 0.55f, 0.5));

    // Fittings every 1.9 m or so on both walls of all four sides; corners stay free.
    for (int i = 0; i < 4; ++i)
        for (int inner = 0; inner < 2; ++inner) {
            const double half = (i < 2 ? kInnerY : kInnerX) - 0.3;
            const Vec3d n = inner ? inward[i] * -1.0 : inward[i];
            const double far = inner ? (i < 2 ? kInnerX : kInnerY) : (i < 2 ? kOuterX : kOuterY);
            const Vec3d base{-far * inward[i].x, -far * inward[i].y, 0}, u = cross(Vec3d{0, 0, 1}, n);
            const double yaw = n.x > 0 ? -0.5 * kPi : n.x < 0 ? 0.5 * kPi : n.y < 0 ? kPi : 0.0;
            for (double s = -half + b.random.in(0.4, 1.2); s < half - 0.5; s += b.random.in(1.5, 2.3)) {
                add_fitting(b, base + u * s, n, yaw);
            }
        }
    // Lamps along the ceiling, and their light.
    const int shade = b.material(Texture::plain, {0.9f, 0.9f, 0.86f}, {});
    const auto lamp = [&](Vec3d p, bool along_x) {
        b.object(kNone, p);
        b.box({along_x ? -0.6 : -0.12, along_x ? -0.12 : -0.6, -0.05},
              {along_x ? 0.6 : 0.12, along_x ? 0.12 : 0.6, 0.02}, shade, 0.01);
        const double warm = b.random.in(0, 1);
        b.light({p.x, p.y, kHeight - 0.35},
                Vec3f{1.0f, 0.93f, 0.8f} * static_cast<float>(warm) +
                    Vec3f{0.8f, 0.93f, 1.0f} * static_cast<float>(1 - warm),
                b.random.in(0.7, 1.2), 1.0);
    };
    for (double x = -7.5; x < 8; x += 5)
        for (double s : {-1.0, 1.0}) lamp({x, s * 5, kHeight}, true);
    for (double y = -2.5; y < 3; y += 5)
        for (double s : {-1.0, 1.0}) lamp({s * 9, y, kHeight}, false);
    b.data.ambient = {
        {0.34f, 0.34f, 0.35f}, {0.2f, 0.19f, 0.18f}, 0.3, 2.0, static_cast<std::uint32_t>(b.random.bits())};
    b.data.exposure = 1.15;
    b.data.bounds = {{-kOuterX - 0.01, -kOuterY - 0.01, -0.01},
                     {kOuterX + 0.01, kOuterY + 0.01, kHeight + 0.01}};
    b.data.mesh_bounds = {{-kOuterX - 0.03, -kOuterY - 0.03, -0.03},
                          {kOuterX + 0.03, kOuterY + 0.03, kHeight + 0.03}};
    b.data.mesh_resolution = 0.01;
    b.data.cell = 0.25;
    return std::move(b.data);
}

}  // namespace burin::synthetic
