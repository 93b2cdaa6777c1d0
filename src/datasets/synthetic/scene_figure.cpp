// SPDX-License-Identifier: MIT
// A standing person on a turntable, as seen in the person's own frame: the cameras go around. The body is one
// blend of capsules and ellipsoids. The person faces +y; the turntable's surface is z = 0.
#include <cmath>
#include <utility>

#include "datasets/synthetic/builder.h"

namespace burin::synthetic {
namespace {

struct Clothes {
    int skin, face, hair, shirt, trousers, shoe;
};

// Where an arm ends: the wrist and the direction the forearm points in.
struct ArmEnd {
    Vec3d wrist, along;
};

ArmEnd add_arm(SceneBuilder& b, double s, double scale, double spread, double bend, const Clothes& c) {
    const auto at = [&](double x, double y, double z) { return Vec3d{s * x * scale, y * scale, z * scale}; };
    const Vec3d shoulder = at(0.19, -0.01, 1.43);
    const Vec3d elbow = at(0.19 + 0.28 * sine(spread), -0.02, 1.43 - 0.28 * cosine(spread));
    const Vec3d wrist = elbow + at(0.25 * sine(0.8 * spread) * cosine(bend), 0.25 * sine(bend),
                                   -0.25 * cosine(bend) * cosine(0.8 * spread));
    b.limb(shoulder, 0.062 * scale, elbow, 0.046 * scale, c.shirt);
    b.limb(elbow, 0.046 * scale, elbow + (wrist - elbow) * 0.35, 0.044 * scale, c.shirt);
    b.limb(elbow + (wrist - elbow) * 0.3, 0.04 * scale, wrist, 0.029 * scale, c.skin);
    return {wrist, normalised(wrist - elbow)};
}

// A blend of its own, narrow enough for fingers to stay apart.
void add_hand(SceneBuilder& b, const ArmEnd& arm, double scale, const Clothes& c) {
    b.new_blend(0.008 * scale);
    const Vec3d along = arm.along, palm = arm.wrist + along * (0.055 * scale);
    const Vec3d across = normalised(Vec3d{0, 1, 0} - along * along.y);  // from the little finger to the thumb
    b.limb(arm.wrist - along * (0.03 * scale), 0.027 * scale, palm, 0.028 * scale, c.skin);
    const Vec3d flat = cross(along, across);
    Mat3d R;
    for (int i = 0; i < 3; ++i) R(i, 0) = flat[i], R(i, 1) = across[i], R(i, 2) = along[i];
    if (R.determinant() < 0)
        for (int i = 0; i < 3; ++i) R(i, 0) = -R(i, 0);
    b.add(Shape::ellipsoid, palm + along * (0.01 * scale), Vec3d{0.02, 0.044, 0.055} * scale, c.skin, 0, R);
    for (int i = 0; i < 4; ++i) {
        const double place = (i - 1.5) * 0.021, reach = 0.118 - 0.006 * std::fabs(i - 2.2);
        b.limb(palm + across * (place * scale) + along * (0.035 * scale), 0.0098 * scale,
               palm + across * (1.35 * place * scale) + along * (reach * scale), 0.008 * scale, c.skin);
    }
    b.limb(palm + across * (0.025 * scale), 0.014 * scale,
           palm + across * (0.068 * scale) + along * (0.045 * scale), 0.0105 * scale, c.skin);
}

void add_leg(SceneBuilder& b, double s, double scale, double stance, const Clothes& c) {
    const auto at = [&](double x, double y, double z) { return Vec3d{s * x * scale, y * scale, z * scale}; };
    const Vec3d hip = at(0.1, 0, 0.9), knee = at(0.1 + 0.4 * stance, 0.03, 0.49),
                ankle = at(0.1 + 0.75 * stance, -0.02, 0.08);
    b.limb(hip, 0.095 * scale, knee, 0.062 * scale, c.trousers);
    b.add(Shape::ellipsoid, (hip + knee) * 0.5 + at(0.005, -0.005, 0.06), Vec3d{0.088, 0.098, 0.2} * scale,
          c.trousers);
    b.limb(knee, 0.06 * scale, ankle, 0.052 * scale, c.trousers);
    b.add(Shape::ellipsoid, (knee + ankle) * 0.5 + at(0, -0.03, 0.07), Vec3d{0.055, 0.06, 0.14} * scale,
          c.trousers);
    b.limb({ankle.x, -0.05 * scale, 0.042 * scale}, 0.044 * scale,
           {ankle.x + s * 0.025 * scale, 0.12 * scale, 0.034 * scale}, 0.037 * scale, c.shoe);
    b.limb(ankle, 0.04 * scale, {ankle.x, -0.03 * scale, 0.05 * scale}, 0.044 * scale, c.shoe);
}

void add_head(SceneBuilder& b, double scale, double turn, const Clothes& c) {
    const Vec3d centre{0, 0.012 * scale, 1.66 * scale};
    const Mat3d R = rotation_about(2, turn);
    const auto at = [&](double x, double y, double z) { return centre + R * (Vec3d{x, y, z} * scale); };
    b.add(Shape::ellipsoid, centre, Vec3d{0.078, 0.096, 0.115} * scale, c.face, 0, R);
    b.add(Shape::ellipsoid, at(0, 0.025, -0.055), Vec3d{0.058, 0.068, 0.068} * scale, c.face, 0, R);
    b.limb(at(0, 0.092, 0.012), 0.008 * scale, at(0, 0.112, -0.022), 0.0135 * scale, c.skin);  // nose
    for (double s : {-1.0, 1.0})
        b.add(Shape::ellipsoid, at(s * 0.08, -0.008, -0.01), Vec3d{0.011, 0.02, 0.03} * scale, c.skin, 0, R);
    b.add(Shape::ellipsoid, at(0, -0.022, 0.035), Vec3d{0.087, 0.092, 0.096} * scale, c.hair, 0, R);
    b.add(Shape::ellipsoid, at(0, -0.055, -0.02), Vec3d{0.07, 0.05, 0.08} * scale, c.hair, 0, R);
}

}  // namespace

SceneData figure_scene(std::uint64_t seed) {
    SceneBuilder b("figure", seed);
    b.object(kFloor);
    const int deck = b.material(Texture::checker, {0.5f, 0.5f, 0.48f}, {0.18f, 0.2f, 0.24f}, 0.09);
    b.add(Shape::cylinder, {0, 0, -0.03}, {0.45, 0, 0.03}, deck);
    b.object(kNone);
    b.add(Shape::cylinder, {0, 0, -0.09}, {0.36, 0, 0.035},
          b.material(Texture::plain, {0.08f, 0.08f, 0.09f}, {}));

    const double scale = b.random.in(0.92, 1.06), girth = b.random.in(0.9, 1.15);
    const double skin_light = b.random.in(0.35, 1);
    const Vec3f skin = linear_colour(235, 190, 160) * static_cast<float>(skin_light);
    const Vec3f hair = linear_colour(120, 80, 45) * static_cast<float>(b.random.in(0.15, 1.2));
    const Vec3f shirt = b.bright_colour(), accent = b.pale_colour(), trousers = b.bright_colour() * 0.5f;
    const Texture weaves[3] = {Texture::hoops, Texture::mottled, Texture::fabric};
    const Texture weave = weaves[b.random.below(3)];
    Clothes c{};
    c.skin = b.material(Texture::mottled, skin, skin * 0.85f, 0.03);
    c.face = b.material(Texture::face, skin, hair, 0.115 * scale);
    c.hair = b.material(Texture::mottled, hair, hair * 0.4f, 0.012);
    c.shirt = b.material(weave, shirt, accent, weave == Texture::fabric ? 0.012 : 0.055);
    c.trousers = b.material(Texture::fabric, trousers, trousers * 0.6f + Vec3f{0.05f, 0.05f, 0.08f}, 0.012);
    c.shoe = b.material(Texture::plain, {0.12f, 0.08f, 0.06f}, {});

    b.object(kNone);
    b.new_blend(0.03 * scale);
    const auto at = [&](double x, double y, double z) { return Vec3d{x * scale, y * scale, z * scale}; };
    // Trunk: pelvis, belly, chest, shoulders, neck.
    b.add(Shape::ellipsoid, at(0, -0.005, 0.93), Vec3d{0.165 * girth, 0.115 * girth, 0.12} * scale,
          c.trousers);
    b.add(Shape::ellipsoid, at(0, 0.01, 1.1), Vec3d{0.145 * girth, 0.105 * girth, 0.15} * scale, c.shirt);
    b.add(Shape::ellipsoid, at(0, 0.0, 1.28), Vec3d{0.17 * girth, 0.118 * girth, 0.19} * scale, c.shirt);
    b.limb(at(-0.15, -0.015, 1.42), 0.062 * scale, at(0.15, -0.015, 1.42), 0.062 * scale, c.shirt);
    b.limb(at(0, -0.015, 1.42), 0.058 * scale, at(0, 0.0, 1.58), 0.052 * scale, c.skin);
    const double left = b.random.in(0.28, 0.6), right = b.random.in(0.28, 0.6);
    const double bend_left = b.random.in(0.05, 0.9), bend_right = b.random.in(0.05, 0.9);
    const ArmEnd left_arm = add_arm(b, -1, scale, left, bend_left, c);
    const ArmEnd right_arm = add_arm(b, 1, scale, right, bend_right, c);
    const double stance = b.random.in(0.06, 0.16);
    add_leg(b, -1, scale, stance, c);
    add_leg(b, 1, scale, stance, c);
    add_head(b, scale, b.random.in(-0.35, 0.35), c);
    add_hand(b, left_arm, scale, c);
    add_hand(b, right_arm, scale, c);
    b.end_blend();

    const double around = b.random.in(0, 2 * kPi);
    for (int i = 0; i < 3; ++i) {
        const double a = around + 2 * kPi * i / 3;
        b.light({1.7 * cosine(a), 1.7 * sine(a), 1.2 + 0.4 * i},
                i == 0   ? Vec3f{1.0f, 0.9f, 0.75f}
                : i == 1 ? Vec3f{0.8f, 0.9f, 1.0f}
                         : Vec3f{0.95f, 1.0f, 0.95f},
                i == 0 ? 1.1 : 0.6, 1.3);
    }
    b.data.ambient = {
        {0.33f, 0.33f, 0.34f}, {0.18f, 0.17f, 0.17f}, 0.3, 0.7, static_cast<std::uint32_t>(b.random.bits())};
    b.data.exposure = 1.25;
    b.data.occlusion_reach = 0.06;
    b.data.bounds = {{-0.95, -0.75, -0.13}, {0.95, 0.75, 1.97}};
    b.data.mesh_bounds = b.data.bounds;
    b.data.mesh_resolution = 0.001;
    b.data.min_plane_area = 0.02;
    b.data.cell = 0.04;
    return std::move(b.data);
}

}  // namespace burin::synthetic
