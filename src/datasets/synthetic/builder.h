// SPDX-License-Identifier: MIT
// Puts parts together into objects. An object has a frame in the scene (z up), a label and an instance
// number; its parts are given in the object's frame. The order of random draws lays out the scene: never two
// draws among the arguments of one call (C++ leaves their order open, and compilers differ).
#pragma once

#include "datasets/synthetic/portable_math.h"
#include "datasets/synthetic/scene.h"

namespace burin::synthetic {

enum Label : std::uint8_t { kNone, kWall, kFloor, kCeiling, kTable, kSeat, kWindow, kDoor };

Mat3d rotation_about(int axis, double angle);  // radians, right-handed
// Maps the z axis to the unit vector `direction`, with the least turn.
Mat3d rotation_z_to(Vec3d direction);

class SceneBuilder {
  public:
    SceneBuilder(const char* name, std::uint64_t seed);

    SceneData data;
    Random random;

    int material(Texture texture, Vec3f a, Vec3f b, double scale = 0.1, double extent_u = 0.5,
                 double extent_v = 0.5);
    Vec3f bright_colour();  // a random saturated colour of middling lightness
    Vec3f pale_colour();    // a random paint for walls
    // Two random bright colours.
    int two_tone(Texture texture, double scale = 0.1, double extent_u = 0.5, double extent_v = 0.5);
    int random_wood(double ring = 0.012);
    int random_fabric();
    int random_glaze();  // for vases, mugs: plain, striped or mottled

    // Later parts belong to a new object that stands at `position`, turned by `yaw` about z.
    void object(Label label, Vec3d position = {}, double yaw = 0);

    // size and round as in shape.h; the returned reference lives until the next add.
    Part& add(Shape shape, Vec3d position, Vec3d size, int material, double round = 0,
              const Mat3d& R_object_part = {});
    Part& box(Vec3d low, Vec3d high, int material, double round = 0);  // by its corners
    // A capsule from a (radius ra) to b (radius rb).
    Part& limb(Vec3d a, double ra, Vec3d b, double rb, int material);
    Part& lathe(Vec3d position, std::vector<ProfilePoint> profile, double thickness, int material);
    // The side of the plane that `normal` leaves is solid; u is a unit direction in the plane, and the
    // visible piece reaches half_u, half_v from position.
    Part& plane(Vec3d position, Vec3d normal, Vec3d u, double half_u, double half_v, int material);

    int new_blend(double k);  // parts added until end_blend melt together
    void end_blend() { blend_ = -1; }

    // Distance of the point to what has been built so far.
    double distance(Vec3d p_scene) const;

    void light(Vec3d position, Vec3f colour, double strength, double reach);

  private:
    Se3 T_scene_object_;
    Label label_ = kNone;
    int instance_ = 0;
    int blend_ = -1;
};

SceneData room_scene(std::uint64_t seed);
SceneData desk_scene(std::uint64_t seed);
SceneData corridor_scene(std::uint64_t seed);
SceneData relief_scene(std::uint64_t seed);
SceneData figure_scene(std::uint64_t seed);

}  // namespace burin::synthetic
