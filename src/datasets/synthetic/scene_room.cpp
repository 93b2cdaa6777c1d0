// SPDX-License-Identifier: MIT
// A furnished living room, 5.2 x 5.8 x 2.6 m, centred on the origin. The four ICL-NUIM living-room
// trajectories, brought into the scene frame by default_T_scene_trajectory (trajectories.cpp), stay inside
// |x| <= 1.16, |y| <= 1.72, 0.9 <= z <= 1.77, but kt0 that goes down to z = 0.53 within 0 <= x <= 0.5.
// Furniture keeps 0.3 m from that: what is higher than 0.6 m stands along the walls, only low things stand in
// the middle, on the side of negative x.
#include <algorithm>
#include <utility>

#include "datasets/synthetic/furniture.h"

namespace burin::synthetic {
namespace {

constexpr double kHalfX = 2.6, kHalfY = 2.9, kHeight = 2.6;  // metres

void add_shell(SceneBuilder& b) {
    const Vec3f paint = b.pale_colour(), ornament = b.bright_colour();
    const int floor_texture = b.random.below(3);
    const Vec3f tile_colour = b.pale_colour();
    b.object(kFloor);
    const int floor =
        floor_texture == 0
            ? b.material(Texture::tiles, tile_colour, {0.25f, 0.24f, 0.22f}, 0.33)
            : b.material(Texture::planks, linear_colour(200, 155, 105), linear_colour(120, 78, 45), 0.14);
    b.plane({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, kHalfX, kHalfY, floor);
    b.object(kCeiling);
    b.plane({0, 0, kHeight}, {0, 0, -1}, {1, 0, 0}, kHalfX, kHalfY,
            b.material(Texture::mottled, {0.72f, 0.72f, 0.7f}, {0.6f, 0.6f, 0.58f}, 0.35));
    const int skirting = b.material(Texture::plain, {0.65f, 0.63f, 0.58f}, {});
    for (int i = 0; i < 4; ++i) {
        const Vec3d n[4] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
        const bool along_y = i < 2;
        const double half = along_y ? kHalfY : kHalfX;
        const Vec3d u = cross(Vec3d{0, 0, 1}, n[i]);
        b.object(kWall);
        const Vec3f tone = paint * static_cast<float>(b.random.in(0.85, 1.05));
        const int wall = i % 2 == 0
                             ? b.material(Texture::wallpaper, tone, tone * 0.7f + ornament * 0.3f, 0.16)
                             : b.material(Texture::mottled, tone, tone * 0.75f, 0.5);
        const Vec3d foot = along_y ? n[i] * -kHalfX : n[i] * -kHalfY;
        b.plane({foot.x, foot.y, 0.5 * kHeight}, n[i], u, half, 0.5 * kHeight, wall);
        b.object(kNone);
        const Vec3d lip = along_y ? Vec3d{0.02, half, 0} : Vec3d{half, 0.02, 0};
        b.box(Vec3d{foot.x, foot.y, -0.005} - lip, Vec3d{foot.x, foot.y, 0.09} + lip, skirting, 0.004);
    }
}

// A place for something of the given radius on the floor within the box, free of what stands already; false
// if the draws find none.
bool free_place(SceneBuilder& b, Vec3d low, Vec3d high, double radius, Vec3d* out) {
    for (int i = 0; i < 60; ++i) {
        const Vec3d p{b.random.in(low.x, high.x), b.random.in(low.y, high.y), 0};
        // Probes above the floor and its rug; 1.5 radius reaches across the thing's height.
        bool free = true;
        for (double z = 0.1; z < 2 * radius + 0.1; z += radius)
            free = free && b.distance({p.x, p.y, z}) > std::min(radius + 0.03, z - 0.03);
        if (free) {
            *out = p;
            return true;
        }
    }
    return false;
}

}  // namespace

SceneData room_scene(std::uint64_t seed) {
    SceneBuilder b("room", seed);
    add_shell(b);
    // The seed mirrors the room: which wall carries the sofa, which the shelf.
    const double sx = b.random.sign(), sy = b.random.sign();
    const auto facing = [](double nx, double ny) {  // the yaw that turns +y to (nx, ny)
        return nx > 0 ? -0.5 * kPi : nx < 0 ? 0.5 * kPi : ny < 0 ? kPi : 0.0;
    };

    // Sofa wall: sofa, floor lamp, pictures above.
    const double sofa_y = b.random.in(-0.6, 0.5);
    add_sofa(b, {-sx * (kHalfX - 0.47), sofa_y, 0}, facing(sx, 0), b.random.in(1.7, 2.1));
    add_floor_lamp(b, {-sx * (kHalfX - 0.33), -sy * (kHalfY - 0.4), 0}, b.random.in(1.55, 1.8));
    add_picture(b, {-sx * kHalfX, sofa_y - 0.55, b.random.in(1.5, 1.7)}, facing(sx, 0), 0.75, 0.55);
    add_picture(b, {-sx * kHalfX, sofa_y + 0.45, b.random.in(1.5, 1.65)}, facing(sx, 0), 0.5, 0.65);

    // Opposite: dining table between chairs, window behind it.
    const double table_y = b.random.in(-0.5, 0.5), table_x = sx * (kHalfX - 0.53);
    const double top = b.random.in(0.72, 0.76);
    add_table(b, {table_x, table_y, 0}, 0.5 * kPi, {1.35, 0.78, top});
    const int chair_fabric = b.random_fabric();
    add_chair(b, {table_x - 0.05 * sx, table_y - 0.98, 0}, b.random.in(-0.15, 0.15), chair_fabric);
    add_chair(b, {table_x - 0.05 * sx, table_y + 0.98, 0}, kPi + b.random.in(-0.15, 0.15), chair_fabric);
    const double vase_height = b.random.in(0.26, 0.36);
    add_vase(b, {table_x + 0.12 * sx, table_y + b.random.in(-0.1, 0.1), top}, vase_height);
    add_bowl(b, {table_x - 0.1 * sx, table_y + b.random.in(0.3, 0.42), top}, 0.15, 0.012, true);
    add_mug(b, {table_x - 0.15 * sx, table_y - 0.33, top}, b.random.in(0, 6), 0.006);
    add_books(b, {table_x + 0.15 * sx, table_y - 0.45, top}, b.random.in(0, 3), 2);
    add_window(b, {sx * kHalfX, table_y + b.random.in(-0.2, 0.2), 1.55}, facing(-sx, 0), 1.5, 1.1);

    // Shelf wall: shelf, door, round table with a plant.
    const double shelf_x = -sx * b.random.in(0.55, 0.9);
    add_shelf(b, {shelf_x, sy * (kHalfY - 0.19), 0}, facing(0, -sy), {1.1, 0.34, b.random.in(1.8, 2.1)});
    add_door(b, {sx * b.random.in(0.55, 0.85), sy * kHalfY, 0}, facing(0, -sy), 0.88, 2.05);
    add_round_table(b, {-sx * (kHalfX - 0.45), sy * (kHalfY - 0.45), 0}, 0.3, 0.55);
    add_vase(b, {-sx * (kHalfX - 0.42), sy * (kHalfY - 0.42), 0.55 - 0.001}, b.random.in(0.3, 0.4));

    // Sideboard wall: sideboard with a screen, clock, picture, plant in the corner.
    const double board_x = sx * b.random.in(-0.2, 0.3);
    add_sideboard(b, {board_x, -sy * (kHalfY - 0.25), 0}, facing(0, sy), {1.5, 0.44, 0.52});
    add_monitor(b, {board_x + b.random.in(-0.2, 0.2), -sy * (kHalfY - 0.27), 0.52}, facing(0, sy), 0.85);
    add_vase(b, {board_x + 0.62, -sy * (kHalfY - 0.25), 0.519}, b.random.in(0.2, 0.27));
    add_clock(b, {board_x - sx * 1.15, -sy * kHalfY, b.random.in(1.75, 1.95)}, facing(0, sy), 0.17);
    add_picture(b, {board_x + 0.2 * sx, -sy * kHalfY, b.random.in(1.65, 1.8)}, facing(0, sy), 1.0, 0.6);
    add_plant(b, {sx * (kHalfX - 0.42), -sy * (kHalfY - 0.42), 0}, b.random.in(1.0, 1.25));

    // The middle: rug, coffee table, low things wherever there is room.
    b.object(kNone, {-0.35, b.random.in(-0.3, 0.3), 0}, 0);
    const int rug =
        b.material(Texture::carpet, b.pale_colour() * 0.7f, {0.35f, 0.07f, 0.06f}, 0.12, 1.05, 1.4);
    b.add(Shape::box, {}, {1.05, 1.4, 0.016}, rug, 0.006);
    const double coffee_y = b.random.in(-0.35, 0.35);
    add_table(b, {-0.7, coffee_y, 0.012}, 0.5 * kPi + b.random.in(-0.1, 0.1), {1.0, 0.55, 0.38});
    add_bowl(b, {-0.7, coffee_y + 0.2, 0.392}, 0.12, 0.011, false);
    add_books(b, {-0.72, coffee_y - 0.22, 0.392}, b.random.in(0, 3), 2);
    Vec3d spot;
    const Vec3d low{-1.9, -2.3, 0}, high{-0.55, 2.3, 0};
    if (free_place(b, low, high, 0.28, &spot)) add_pouf(b, spot);
    for (int i = 0; i < 3; ++i) {
        const double radius = b.random.in(0.07, 0.1);
        if (free_place(b, {-2.2, -2.5, 0}, {2.2, 2.5, 0}, radius, &spot))
            add_ball(b, {spot.x, spot.y, 0.012}, radius);
    }
    if (free_place(b, low, high, 0.22, &spot)) add_carton(b, spot, b.random.in(0, 3), {0.3, 0.22, 0.2});

    // Ceiling lamp: a bowl close under the ceiling, out of the cameras' way.
    b.object(kNone);
    b.add(Shape::ellipsoid, {0, 0, kHeight - 0.02}, {0.25, 0.25, 0.16},
          b.material(Texture::plain, {0.8f, 0.78f, 0.7f}, {}));

    const double hang = b.random.in(0.8, 1.1), glow = b.random.in(0.7, 1.1), day = b.random.in(1.0, 1.6);
    b.light({b.random.in(-0.4, 0.4), b.random.in(-0.4, 0.4), 2.2}, {1.0f, 0.93f, 0.8f}, hang, 1.6);
    b.light({-sx * 2.1, -sy * 2.2, 1.9}, {1.0f, 0.8f, 0.55f}, glow, 0.8);
    b.light({sx * 2.0, table_y, 1.7}, {0.75f, 0.87f, 1.0f}, day, 1.1);
    b.light({b.random.in(-1, 1), b.random.in(-1.5, 1.5), 1.4}, {0.9f, 1.0f, 0.85f}, 0.2, 0.9);
    b.data.ambient = {
        {0.3f, 0.31f, 0.33f}, {0.2f, 0.17f, 0.14f}, 0.35, 1.4, static_cast<std::uint32_t>(b.random.bits())};
    b.data.exposure = 0.95;
    b.data.bounds = {{-kHalfX - 0.01, -kHalfY - 0.01, -0.01}, {kHalfX + 0.01, kHalfY + 0.01, kHeight + 0.01}};
    b.data.mesh_bounds = {{-kHalfX - 0.03, -kHalfY - 0.03, -0.03},
                          {kHalfX + 0.03, kHalfY + 0.03, kHeight + 0.03}};
    b.data.mesh_resolution = 0.01;
    b.data.cell = 0.16;
    return std::move(b.data);
}

}  // namespace burin::synthetic
