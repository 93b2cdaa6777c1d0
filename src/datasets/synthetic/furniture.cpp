// SPDX-License-Identifier: MIT
// Neighbouring parts overlap by a few millimetres, so that no two faces coincide. Nothing is thinner than
// about 20 mm where it stands in a room, so that a truth mesh of 10 mm cells keeps it.
#include "datasets/synthetic/furniture.h"

#include <algorithm>

namespace burin::synthetic {
namespace {

constexpr double kSink = 0.004;  // how deep things stand in what carries them

}  // namespace

void add_table(SceneBuilder& b, Vec3d position, double yaw, Vec3d size) {
    b.object(kTable, position, yaw);
    const int top = b.random_wood(), leg = b.random_wood();
    const double w = 0.5 * size.x, d = 0.5 * size.y, h = size.z;
    b.box({-w, -d, h - 0.04}, {w, d, h}, top);
    for (double sx : {-1.0, 1.0})
        for (double sy : {-1.0, 1.0})
            b.box({sx * (w - 0.07) - 0.03, sy * (d - 0.07) - 0.03, -kSink},
                  {sx * (w - 0.07) + 0.03, sy * (d - 0.07) + 0.03, h - 0.03}, leg, 0.008);
    b.box({-w + 0.07, -d + 0.05, h - 0.11}, {w - 0.07, -d + 0.08, h - 0.03}, leg);
    b.box({-w + 0.07, d - 0.08, h - 0.11}, {w - 0.07, d - 0.05, h - 0.03}, leg);
}

void add_round_table(SceneBuilder& b, Vec3d position, double radius, double height) {
    b.object(kTable, position, b.random.in(0, 2 * kPi));
    const int wood = b.random_wood();
    b.add(Shape::cylinder, {0, 0, height - 0.018}, {radius, 0, 0.018}, wood, 0.008);
    b.add(Shape::cylinder, {0, 0, 0.5 * height - 0.01}, {0.035, 0, 0.5 * height - 0.01}, wood);
    b.add(Shape::frustum, {0, 0, 0.02}, {0.55 * radius, 0.08, 0.024}, wood);
}

void add_chair(SceneBuilder& b, Vec3d position, double yaw, int fabric) {
    b.object(kSeat, position, yaw);
    const int wood = b.random_wood();
    b.box({-0.21, -0.21, 0.42}, {0.21, 0.21, 0.46}, fabric);
    for (double sx : {-1.0, 1.0}) {
        b.limb({sx * 0.185, 0.19, -kSink}, 0.019, {sx * 0.175, 0.175, 0.43}, 0.021, wood);
        b.limb({sx * 0.185, -0.21, -kSink}, 0.019, {sx * 0.18, -0.195, 0.44}, 0.021, wood);
        b.limb({sx * 0.18, -0.195, 0.44}, 0.021, {sx * 0.175, -0.25, 0.88}, 0.017, wood);
    }
    b.add(Shape::box, {0, -0.235, 0.74}, {0.2, 0.014, 0.12}, fabric, 0.012, rotation_about(0, 0.11));
}

void add_sofa(SceneBuilder& b, Vec3d position, double yaw, double width) {
    b.object(kSeat, position, yaw);
    const int fabric = b.random_fabric(), wood = b.random_wood();
    const double w = 0.5 * width;
    b.box({-w, -0.4, 0.08}, {w, 0.36, 0.3}, fabric, 0.02);
    b.box({-w, -0.42, 0.09}, {w, -0.2, 0.8}, fabric, 0.06);
    for (double s : {-1.0, 1.0}) {
        b.box({s * (w - 0.07) - 0.09, -0.41, 0.085}, {s * (w - 0.07) + 0.09, 0.37, 0.58}, fabric, 0.06);
        b.add(Shape::cylinder, {s * (w - 0.1), 0.28, 0.045}, {0.025, 0, 0.055}, wood);
    }
    const double inner = w - 0.15;
    const int seats = width > 1.6 ? 3 : 2;
    for (int i = 0; i < seats; ++i) {
        const double left = -inner + 2 * inner * i / seats, right = -inner + 2 * inner * (i + 1) / seats;
        b.box({left, -0.22, 0.28}, {right - 0.004, 0.38, 0.43}, fabric, 0.035);
    }
    const int cushions = 2 + b.random.below(2);
    for (int i = 0; i < cushions; ++i) {  // loose cushions leaning against the back
        const double x = (i - 1) * 0.55 * inner + b.random.in(-0.08, 0.08);
        const Mat3d R = rotation_about(2, b.random.in(-0.35, 0.35)) * rotation_about(0, -1.25);
        b.object(kNone, position, yaw);
        b.add(Shape::ellipsoid, {x, -0.1, 0.6}, {0.22, 0.2, 0.08}, b.random_fabric(), 0, R);
    }
}

void add_pouf(SceneBuilder& b, Vec3d position) {
    b.object(kSeat, position, b.random.in(0, 2 * kPi));
    b.add(Shape::cylinder, {0, 0, 0.19}, {0.25, 0, 0.194}, b.random_fabric(), 0.05);
    b.add(Shape::torus, {0, 0, 0.2}, {0.25, 0.02, 0}, b.random_fabric());
}

void add_shelf(SceneBuilder& b, Vec3d position, double yaw, Vec3d size) {
    b.object(kNone, position, yaw);
    const int wood = b.random_wood();
    const double w = 0.5 * size.x, d = 0.5 * size.y, h = size.z;
    const int boards = std::max(2, static_cast<int>(h / 0.37));
    for (double s : {-1.0, 1.0})
        b.box({s * (w - 0.015) - 0.015, -d, -kSink}, {s * (w - 0.015) + 0.015, d, h}, wood);
    b.box({-w + 0.005, -d, 0}, {w - 0.005, -d + 0.02, h - 0.005}, wood);
    for (int i = 0; i <= boards; ++i) {
        const double z = 0.06 + (h - 0.08) * i / boards;
        b.box({-w + 0.01, -d + 0.01, z - 0.02}, {w - 0.01, d - 0.005, z + 0.01}, wood);
    }
    for (int i = 0; i < boards; ++i) {
        const double z = 0.06 + (h - 0.08) * i / boards + 0.006, gap = (h - 0.08) / boards - 0.05;
        if (b.random.below(3) == 0) {
            add_vase(b, position + rotation_about(2, yaw) * Vec3d{b.random.in(-0.5, 0.5) * w, 0.02, z},
                     std::min(0.25, 0.85 * gap));
            continue;
        }
        double x = -w + 0.05;
        const double end = w * b.random.in(0.1, 0.9);
        b.object(kNone, position, yaw);  // one row of books
        while (x < end) {
            const double thick = b.random.in(0.024, 0.05), tall = gap * b.random.in(0.6, 0.92);
            const int cover = b.two_tone(Texture::stripes, 0.07);
            b.add(Shape::box, {x + 0.5 * thick, b.random.in(-0.02, 0.03), z + 0.5 * tall - 0.002},
                  {0.5 * tall, 0.5 * thick, 0.38 * size.y}, cover, 0.003,
                  // the stripes of a cover run across its back: part x points up, part y along the row
                  Mat3d{{0, 1, 0, 0, 0, 1, 1, 0, 0}});
            x += thick + 0.001;
        }
    }
}

void add_sideboard(SceneBuilder& b, Vec3d position, double yaw, Vec3d size) {
    b.object(kNone, position, yaw);
    const int wood = b.random_wood(), front = b.random_wood(),
              metal = b.material(Texture::plain, {0.5f, 0.5f, 0.5f}, {});
    const double w = 0.5 * size.x, d = 0.5 * size.y, h = size.z;
    b.box({-w, -d, h - 0.03}, {w, d, h}, wood);
    b.box({-w + 0.02, -d + 0.01, 0.06}, {w - 0.02, d - 0.03, h - 0.02}, wood);
    b.box({-w + 0.06, -d + 0.05, -kSink}, {w - 0.06, d - 0.08, 0.08}, wood);
    for (int i = 0; i < 3; ++i) {
        const double left = -w + 0.04 + (size.x - 0.08) * i / 3,
                     right = -w + 0.04 + (size.x - 0.08) * (i + 1) / 3;
        b.box({left + 0.01, d - 0.05, 0.09}, {right - 0.01, d - 0.01, h - 0.05}, front, 0.004);
        b.add(Shape::sphere, {0.5 * (left + right), d + 0.003, 0.6 * h}, {0.016, 0, 0}, metal);
    }
}

void add_monitor(SceneBuilder& b, Vec3d position, double yaw, double width) {
    b.object(kNone, position, yaw);
    const double w = 0.5 * width, h = 0.29 * width, base = 0.16 * width;
    const int black = b.material(Texture::plain, {0.03f, 0.03f, 0.035f}, {});
    const int glass = b.two_tone(Texture::screen, 0.1, w - 0.012, h - 0.012);
    b.add(Shape::cylinder, {0, 0, 0.008}, {0.28 * width, 0, 0.012}, black, 0.004);
    b.limb({0, -0.03, 0}, 0.025, {0, -0.03, base + h}, 0.02, black);
    b.box({-w, -0.025, base}, {w, 0.01, base + 2 * h}, black, 0.006);
    b.add(Shape::box, {0, 0.009, base + h}, {w - 0.012, 0.004, h - 0.012}, glass);
}

void add_floor_lamp(SceneBuilder& b, Vec3d position, double height) {
    b.object(kNone, position);
    const int metal = b.material(Texture::plain, {0.3f, 0.28f, 0.25f}, {});
    const int shade = b.material(Texture::fabric, {0.85f, 0.75f, 0.55f}, {0.75f, 0.62f, 0.4f}, 0.02);
    b.add(Shape::frustum, {0, 0, 0.016}, {0.15, 0.13, 0.02}, metal);
    b.add(Shape::cylinder, {0, 0, 0.5 * height}, {0.016, 0, 0.5 * height - 0.02}, metal);
    b.add(Shape::frustum, {0, 0, height - 0.14}, {0.2, 0.13, 0.13}, shade);
}

void add_plant(SceneBuilder& b, Vec3d position, double height) {
    b.object(kNone, position);
    const int clay = b.random_glaze(),
              soil = b.material(Texture::mottled, {0.06f, 0.04f, 0.03f}, {0.12f, 0.08f, 0.05f}, 0.02);
    const int leaf = b.material(Texture::mottled, {0.05f, 0.16f, 0.04f}, {0.2f, 0.35f, 0.08f}, 0.06);
    const double pot = 0.3 * height;
    b.lathe({0, 0, 0}, {{0.001, 0.012}, {0.3 * pot + 0.02, 0.012}, {0.42 * pot + 0.03, pot}}, 0.014, clay);
    b.add(Shape::cylinder, {0, 0, 0.5 * pot}, {0.35 * pot + 0.02, 0, 0.36 * pot}, soil);
    const int stems = 7 + b.random.below(4);
    for (int i = 0; i < stems; ++i) {
        const double a = 2 * kPi * (i + b.random.in(0, 0.6)) / stems, lean = b.random.in(0.15, 0.55);
        const Vec3d tip{cosine(a) * lean * 0.4 * height, sine(a) * lean * 0.4 * height,
                        pot + (1 - 0.5 * lean) * 0.62 * height};
        b.limb({0.02 * cosine(a), 0.02 * sine(a), 0.7 * pot}, 0.011, tip, 0.009, leaf);
        const Vec3d along = normalised(tip - Vec3d{0, 0, 0.6 * pot});
        b.add(Shape::ellipsoid, tip + along * (0.05 * height), {0.05 * height, 0.018, 0.11 * height}, leaf, 0,
              rotation_z_to(along) * rotation_about(2, b.random.in(0, kPi)));
    }
}

void add_bin(SceneBuilder& b, Vec3d position, double radius, double height) {
    b.object(kNone, position, b.random.in(0, 2 * kPi));
    b.lathe({0, 0, 0}, {{0.001, 0.012}, {0.8 * radius, 0.012}, {radius - 0.013, height - 0.013}}, 0.013,
            b.random_glaze());
}

void add_vase(SceneBuilder& b, Vec3d position, double height) {
    b.object(kNone, position, b.random.in(0, 2 * kPi));
    const double belly = b.random.in(0.24, 0.36) * height, neck = b.random.in(0.11, 0.18) * height;
    const double foot = b.random.in(0.14, 0.2) * height, wall = std::max(0.006, 0.045 * height);
    std::vector<ProfilePoint> profile{{0.001, wall - kSink}};
    for (int i = 0; i <= 16; ++i) {  // foot to belly to neck to rim, cosine arcs between them
        const double s = i / 16.0;
        const double r = s < 0.4   ? foot + (belly - foot) * 0.5 * (1 - cosine(kPi * s / 0.4))
                         : s < 0.8 ? neck + (belly - neck) * 0.5 * (1 + cosine(kPi * (s - 0.4) / 0.4))
                                   : neck + 0.3 * neck * 0.5 * (1 - cosine(kPi * (s - 0.8) / 0.4));
        profile.push_back({std::max(r - wall, 0.5 * wall), wall - kSink + (height - 2 * wall) * s});
    }
    b.lathe({}, std::move(profile), wall, b.random_glaze());
}

void add_bowl(SceneBuilder& b, Vec3d position, double radius, double wall, bool fruit) {
    b.object(kNone, position, b.random.in(0, 2 * kPi));
    std::vector<ProfilePoint> profile{{0.001, wall - kSink}};
    for (int i = 0; i <= 10; ++i) {
        const double a = 0.5 * kPi * i / 10;
        profile.push_back(
            {0.3 * radius + (0.7 * radius - wall) * sine(a), wall - kSink + 0.5 * radius * (1 - cosine(a))});
    }
    b.lathe({}, std::move(profile), wall, b.random_glaze());
    if (!fruit) return;
    const double r = 0.3 * radius;
    for (int i = 0; i < 4; ++i) {
        b.object(kNone, position);
        const double a = 2 * kPi * i / 3 + b.random.in(0, 0.4), out = i == 3 ? 0 : 0.42 * radius;
        const int skin = b.two_tone(Texture::mottled, 0.05);
        b.add(Shape::sphere, {out * cosine(a), out * sine(a), 2 * wall + r + (i == 3 ? 1.1 * r : 0)},
              {r, 0, 0}, skin);
    }
}

void add_mug(SceneBuilder& b, Vec3d position, double yaw, double wall) {
    b.object(kNone, position, yaw);
    const int glaze = b.random_glaze();
    const double r = b.random.in(0.038, 0.046), h = b.random.in(0.085, 0.11);
    b.lathe({}, {{0.001, wall}, {r - wall, wall}, {r - wall, h - wall}}, wall, glaze);
    // Half a ring, the other half inside the wall.
    b.add(Shape::torus, {0.98 * r, 0, 0.5 * h}, {0.3 * h, 1.3 * wall, 0}, glaze, 0,
          rotation_about(0, 0.5 * kPi));
}

void add_books(SceneBuilder& b, Vec3d position, double yaw, int count) {
    double z = position.z;
    for (int i = 0; i < count; ++i) {
        const double thick = b.random.in(0.022, 0.045), w = b.random.in(0.08, 0.11),
                     d = b.random.in(0.11, 0.15);
        const double turn = b.random.in(-0.3, 0.3);
        b.object(kNone, {position.x + b.random.in(-0.01, 0.01), position.y, z}, yaw + turn);
        const int cover = b.two_tone(Texture::picture, 0.1, w, d);
        const int pages = b.material(Texture::stripes, {0.75f, 0.72f, 0.62f}, {0.6f, 0.57f, 0.5f}, 0.002);
        b.box({-w, -d, -0.001}, {w, d, 0.004}, cover);
        b.box({-w + 0.004, -d + 0.004, 0.003}, {w - 0.004, d - 0.004, thick - 0.003}, pages);
        b.box({-w, -d, thick - 0.004}, {w, d, thick}, cover);
        b.box({-w, -d, 0}, {-w + 0.006, d, thick - 0.001}, cover);
        z += thick;
    }
}

void add_ball(SceneBuilder& b, Vec3d position, double radius) {
    b.object(kNone, position, b.random.in(0, 2 * kPi));
    const Texture kind = b.random.below(2) ? Texture::checker : Texture::stripes;
    const int skin = b.material(kind, b.bright_colour(), {0.8f, 0.8f, 0.75f}, 0.6 * radius);
    b.add(Shape::sphere, {0, 0, radius - 0.002}, {radius, 0, 0}, skin, 0,
          rotation_about(0, b.random.in(0, 1.5)));
}

void add_carton(SceneBuilder& b, Vec3d position, double yaw, Vec3d size) {
    b.object(kNone, position, yaw);
    const bool print = b.random.below(2);
    const int side =
        print ? b.two_tone(Texture::picture, 0.1, 0.5 * size.x, 0.5 * size.z)
              : b.material(Texture::mottled, linear_colour(190, 150, 105), linear_colour(170, 130, 85), 0.08);
    const int tape = b.material(Texture::plain, linear_colour(215, 190, 140), {});
    b.box({-0.5 * size.x, -0.5 * size.y, -0.002}, {0.5 * size.x, 0.5 * size.y, size.z}, side);
    if (!print)
        b.box({-0.025, -0.5 * size.y - 0.001, 0.7 * size.z}, {0.025, 0.5 * size.y + 0.001, size.z + 0.001},
              tape);
}

void add_picture(SceneBuilder& b, Vec3d position, double yaw, double width, double height) {
    b.object(kNone, position, yaw);
    const double w = 0.5 * width, h = 0.5 * height;
    const int frame = b.random_wood(), canvas = b.two_tone(Texture::picture, 0.1, w, h);
    b.add(Shape::box, {0, 0.01, 0}, {w, 0.015, h}, canvas);
    for (double s : {-1.0, 1.0}) {
        b.box({s * w - 0.02, -0.005, -h - 0.02}, {s * w + 0.02, 0.04, h + 0.02}, frame, 0.005);
        b.box({-w - 0.015, -0.005, s * h - 0.02}, {w + 0.015, 0.039, s * h + 0.02}, frame, 0.005);
    }
}

void add_clock(SceneBuilder& b, Vec3d position, double yaw, double radius) {
    b.object(kNone, position, yaw);
    const int dial = b.material(Texture::mottled, {0.8f, 0.8f, 0.75f}, {0.7f, 0.7f, 0.62f}, 0.05);
    const int black = b.material(Texture::plain, {0.05f, 0.05f, 0.05f}, {});
    const Mat3d face = rotation_about(0, -0.5 * kPi);  // part z to object +y
    b.add(Shape::cylinder, {0, 0.008, 0}, {radius, 0, 0.018}, dial, 0, face);
    b.add(Shape::torus, {0, 0.02, 0}, {radius, 0.018, 0}, b.random_glaze(), 0, face);
    for (double length : {0.55, 0.8}) {
        const double a = b.random.in(0, 2 * kPi);
        b.limb({0, 0.028, 0}, 0.008, {length * radius * sine(a), 0.028, length * radius * cosine(a)}, 0.006,
               black);
    }
}

void add_door(SceneBuilder& b, Vec3d position, double yaw, double width, double height) {
    b.object(kDoor, position, yaw);
    const double w = 0.5 * width;
    const int leaf = b.random_wood(0.02), metal = b.material(Texture::plain, {0.45f, 0.42f, 0.36f}, {});
    b.box({-w, -0.01, -kSink}, {w, 0.02, height}, leaf);
    for (double z : {0.28 * height, 0.72 * height})  // two raised panels
        b.box({-w + 0.14, 0, z - 0.2 * height}, {w - 0.14, 0.032, z + 0.2 * height}, leaf, 0.006);
    b.object(kNone, position, yaw);
    const int frame = b.material(Texture::plain, {0.7f, 0.69f, 0.65f}, {});
    for (double s : {-1.0, 1.0})
        b.box({s * (w + 0.035) - 0.04, -0.01, -kSink}, {s * (w + 0.035) + 0.04, 0.05, height + 0.07}, frame);
    b.box({-w, -0.01, height - 0.005}, {w, 0.049, height + 0.07}, frame);
    b.limb({w - 0.07, 0.01, 1.0}, 0.012, {w - 0.07, 0.075, 1.0}, 0.012, metal);
    b.limb({w - 0.07, 0.075, 1.0}, 0.012, {w - 0.19, 0.075, 1.0}, 0.011, metal);
}

void add_window(SceneBuilder& b, Vec3d position, double yaw, double width, double height) {
    b.object(kWindow, position, yaw);
    const double w = 0.5 * width, h = 0.5 * height;
    const int view =
        b.material(Texture::skyline, linear_colour(110, 160, 220), {0.1f, 0.2f, 0.07f}, 0.1, w, h);
    b.box({-w, -0.01, -h}, {w, 0.012, h}, view);
    b.object(kNone, position, yaw);
    const int frame = b.material(Texture::plain, {0.75f, 0.75f, 0.72f}, {});
    for (double s : {-1.0, 1.0}) {
        b.box({s * w - 0.035, -0.01, -h - 0.03}, {s * w + 0.035, 0.06, h + 0.03}, frame);
        b.box({-w, -0.01, s * h - 0.03}, {w, 0.059, s * h + 0.03}, frame);
    }
    b.box({-0.02, -0.01, -h}, {0.02, 0.05, h}, frame);
    b.box({-w, -0.01, 0.3 * h - 0.018}, {w, 0.048, 0.3 * h + 0.018}, frame);
    b.box({-w - 0.1, -0.01, -h - 0.06}, {w + 0.1, 0.16, -h - 0.025}, frame, 0.006);  // sill
    const int cloth = b.random_fabric();
    for (double s : {-1.0, 1.0})  // drawn curtains: a row of soft folds
        for (int i = 0; i < 4; ++i) {
            const double x = s * (w + 0.02 + 0.075 * i);
            b.limb({x, 0.11, -h - 0.35}, 0.045, {x, 0.11, h + 0.12}, 0.04, cloth);
        }
    b.limb({-w - 0.36, 0.11, h + 0.15}, 0.015, {w + 0.36, 0.11, h + 0.15}, 0.015, b.random_wood());
}

}  // namespace burin::synthetic
