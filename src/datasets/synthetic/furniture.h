// SPDX-License-Identifier: MIT
// Pieces of furniture and small things. Each call makes one object standing at `position` (its lowest point's
// height is position.z), turned by `yaw`; its front looks along +y of its own frame. Sizes in metres.
#pragma once

#include "datasets/synthetic/builder.h"

namespace burin::synthetic {

void add_table(SceneBuilder& b, Vec3d position, double yaw, Vec3d size);  // size: width, depth, height
void add_round_table(SceneBuilder& b, Vec3d position, double radius, double height);
void add_chair(SceneBuilder& b, Vec3d position, double yaw, int fabric);
void add_sofa(SceneBuilder& b, Vec3d position, double yaw, double width);
void add_pouf(SceneBuilder& b, Vec3d position);
void add_shelf(SceneBuilder& b, Vec3d position, double yaw, Vec3d size);
void add_sideboard(SceneBuilder& b, Vec3d position, double yaw, Vec3d size);
void add_monitor(SceneBuilder& b, Vec3d position, double yaw, double width);
void add_floor_lamp(SceneBuilder& b, Vec3d position, double height);
void add_plant(SceneBuilder& b, Vec3d position, double height);
void add_bin(SceneBuilder& b, Vec3d position, double radius, double height);

void add_vase(SceneBuilder& b, Vec3d position, double height);
void add_bowl(SceneBuilder& b, Vec3d position, double radius, double wall, bool fruit);
void add_mug(SceneBuilder& b, Vec3d position, double yaw, double wall);
void add_books(SceneBuilder& b, Vec3d position, double yaw, int count);  // a lying pile
void add_ball(SceneBuilder& b, Vec3d position, double radius);
void add_carton(SceneBuilder& b, Vec3d position, double yaw, Vec3d size);

// On a wall: `position` lies on the wall, the yaw turns +y to the wall's inward normal.
void add_picture(SceneBuilder& b, Vec3d position, double yaw, double width, double height);
void add_clock(SceneBuilder& b, Vec3d position, double yaw, double radius);
void add_door(SceneBuilder& b, Vec3d position, double yaw, double width,
              double height);  // position: foot, middle
void add_window(SceneBuilder& b, Vec3d position, double yaw, double width,
                double height);  // position: its middle

}  // namespace burin::synthetic
