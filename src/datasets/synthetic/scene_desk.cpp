// SPDX-License-Identifier: MIT
// A desk of 1.6 x 0.8 m, its top at z = 0.74, against a wall, with small things on it. The truth mesh covers
// the desk top, what stands on it and the wall right behind.
#include <utility>

#include "datasets/synthetic/furniture.h"

namespace burin::synthetic {
namespace {

constexpr double kTop = 0.74;  // metres

void add_keyboard(SceneBuilder& b, Vec3d position, double yaw) {
    b.object(kNone, position, yaw);
    const int body = b.material(Texture::plain, {0.08f, 0.08f, 0.09f}, {});
    const int caps = b.material(Texture::keys, {0.16f, 0.16f, 0.17f}, {0.02f, 0.02f, 0.02f}, 0.019);
    b.add(Shape::box, {0, 0, 0.008}, {0.21, 0.07, 0.01}, body, 0.006, rotation_about(0, 0.04));
    b.add(Shape::box, {0, 0, 0.018}, {0.2, 0.06, 0.006}, caps, 0.002, rotation_about(0, 0.04));
}

void add_pencil_cup(SceneBuilder& b, Vec3d position) {
    b.object(kNone, position);
    b.lathe({}, {{0.001, 0.003}, {0.036, 0.003}, {0.036, 0.1}}, 0.004, b.random_glaze());
    for (int i = 0; i < 5; ++i) {
        const double a = 2 * kPi * i / 5 + b.random.in(-0.3, 0.3), tall = b.random.in(0.13, 0.17);
        b.limb({0.012 * cosine(a + 2.5), 0.012 * sine(a + 2.5), 0.01}, 0.004,
               {0.034 * cosine(a), 0.034 * sine(a), tall}, 0.004,
               b.material(Texture::plain, b.bright_colour(), {}));
    }
}

void add_desk_lamp(SceneBuilder& b, Vec3d position, double yaw) {
    b.object(kNone, position, yaw);
    const int paint = b.material(Texture::plain, b.bright_colour(), {});
    b.add(Shape::cylinder, {0, 0, 0.01}, {0.08, 0, 0.014}, paint, 0.005);
    b.limb({0, -0.03, 0.015}, 0.008, {0, -0.1, 0.24}, 0.008, paint);
    b.limb({0, -0.1, 0.24}, 0.008, {0, 0.1, 0.4}, 0.008, paint);
    b.add(Shape::frustum, {0, 0.12, 0.375}, {0.07, 0.03, 0.05}, paint, 0, rotation_about(0, 0.4));
}

// The small things; each fits a circle of radius 0.12.
void add_thing(SceneBuilder& b, int kind, Vec3d p) {
    const double yaw = b.random.in(0, 2 * kPi);
    switch (kind) {
        case 0:
            return add_mug(b, p, yaw, 0.003);
        case 1:
            return add_bowl(b, p, b.random.in(0.085, 0.105), 0.004, true);
        case 2:
            return add_books(b, p, yaw, 2 + b.random.below(3));
        case 3:
            return add_vase(b, p, b.random.in(0.18, 0.26));
        case 4:
            return add_pencil_cup(b, p);
        case 5:
            return add_ball(b, p, b.random.in(0.035, 0.05));
        case 6: {
            const double w = b.random.in(0.09, 0.15), d = b.random.in(0.06, 0.1);
            return add_carton(b, p, yaw, {w, d, b.random.in(0.08, 0.18)});
        }
        case 7:  // a roll of tape beside an eraser
            b.object(kNone, p, yaw);
            b.add(Shape::torus, {0, 0, 0.014}, {0.035, 0.015, 0}, b.random_glaze());
            b.box({0.06, -0.02, -0.001}, {0.1, 0.02, 0.018}, b.random_glaze(), 0.004);
            return;
        case 8:
            return add_mug(b, p, yaw, 0.004);
        default:  // a cone, a cylinder and a block of a construction kit
            b.object(kNone, p, yaw);
            b.add(Shape::frustum, {0.04, 0, 0.034}, {0.035, 0.004, 0.035}, b.random_glaze());
            b.add(Shape::cylinder, {-0.045, 0.03, 0.029}, {0.028, 0, 0.03}, b.random_glaze());
            b.add(Shape::box, {-0.03, -0.045, 0.019}, {0.03, 0.025, 0.02}, b.random_glaze(), 0.002);
    }
}

}  // namespace

SceneData desk_scene(std::uint64_t seed) {
    SceneBuilder b("desk", seed);
    const Vec3f paint = b.pale_colour();
    b.object(kFloor);
    b.plane({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 3, 3,
            b.material(Texture::planks, linear_colour(185, 145, 105), linear_colour(110, 75, 45), 0.14));
    b.object(kWall);
    b.plane({0, 0.42, 1.3}, {0, -1, 0}, {1, 0, 0}, 3, 1.3,
            b.material(Texture::wallpaper, paint, paint * 0.6f, 0.11));
    b.object(kTable);
    const int top = b.random_wood(0.018), leg = b.material(Texture::plain, {0.25f, 0.25f, 0.27f}, {});
    b.box({-0.8, -0.4, kTop - 0.03}, {0.8, 0.4, kTop}, top);
    for (double s : {-1.0, 1.0})
        b.box({s * 0.74 - 0.03, -0.36, -0.01}, {s * 0.74 + 0.03, 0.36, kTop - 0.02}, leg);

    const double shift = b.random.in(-0.12, 0.12);
    add_monitor(b, {shift, 0.24, kTop - 0.002}, kPi + b.random.in(-0.15, 0.15), 0.5);
    const double keys_turn = b.random.in(-0.1, 0.1), mouse_turn = b.random.in(-0.3, 0.3);
    add_keyboard(b, {shift + b.random.in(-0.03, 0.03), -0.12, kTop}, keys_turn);
    b.object(kNone, {shift + 0.3, -0.12 + b.random.in(-0.03, 0.03), kTop}, mouse_turn);
    b.add(Shape::ellipsoid, {0, 0, 0.008}, {0.032, 0.055, 0.026},
          b.material(Texture::plain, {0.1f, 0.1f, 0.1f}, {}));
    const double side = b.random.sign();
    add_desk_lamp(b, {side * 0.66, 0.26, kTop - 0.001}, side * 0.6 + kPi);
    add_plant(b, {-side * 0.63, 0.22, kTop - 0.001}, b.random.in(0.3, 0.38));
    b.object(kNone, {shift - 0.05, -0.28, kTop - 0.001}, b.random.in(-0.25, 0.25));  // a sheet under a pencil
    const int sheet =
        b.material(Texture::screen, {0.8f, 0.8f, 0.76f}, {0.75f, 0.75f, 0.7f}, 0.1, 0.105, 0.148);
    b.add(Shape::box, {0, 0, 0.002}, {0.105, 0.148, 0.003}, sheet, 0, rotation_about(2, 0.5 * kPi));
    b.limb({-0.05, 0.02, 0.009}, 0.0045, {0.09, -0.03, 0.009}, 0.0045,
           b.material(Texture::stripes, b.bright_colour(), {0.1f, 0.1f, 0.1f}, 0.01));

    // Ten things shuffled over eight places.
    const Vec3d places[8] = {{-0.62, -0.02, kTop}, {-0.64, -0.28, kTop}, {-0.38, 0.08, kTop},
                             {-0.37, -0.2, kTop},  {0.62, 0.0, kTop},    {0.64, -0.26, kTop},
                             {0.4, 0.12, kTop},    {0.42, -0.27, kTop}};
    int kinds[10] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
    for (int i = 9; i > 0; --i) std::swap(kinds[i], kinds[b.random.below(i + 1)]);
    for (int i = 0; i < 8; ++i)
        add_thing(b, kinds[i], places[i] + Vec3d{b.random.in(-0.03, 0.03), b.random.in(-0.03, 0.03), 0});
    add_picture(b, {side * 0.45, 0.42, b.random.in(1.22, 1.3)}, kPi, 0.34, 0.26);

    const double key = b.random.in(0.8, 1.1), fill = b.random.in(0.25, 0.5);
    b.light({side * 0.62, 0.1, 1.12}, {1.0f, 0.85f, 0.6f}, 1.3, 0.28);
    b.light({-side * b.random.in(0.6, 1.4), -0.7, 1.9}, {0.9f, 0.95f, 1.0f}, key, 1.3);
    b.light({side * 1.2, -b.random.in(0.2, 0.9), 1.6}, {1.0f, 0.95f, 0.9f}, fill, 0.9);
    b.data.ambient = {
        {0.3f, 0.31f, 0.33f}, {0.16f, 0.15f, 0.14f}, 0.35, 0.5, static_cast<std::uint32_t>(b.random.bits())};
    b.data.exposure = 1.0;
    b.data.occlusion_reach = 0.05;
    b.data.bounds = {{-1.0, -0.5, -0.01}, {1.0, 0.44, 1.46}};
    b.data.mesh_bounds = {{-0.81, -0.41, 0.705}, {0.81, 0.44, 1.45}};
    b.data.mesh_resolution = 0.002;
    b.data.min_plane_area = 0.004;
    b.data.cell = 0.04;
    return std::move(b.data);
}

}  // namespace burin::synthetic
