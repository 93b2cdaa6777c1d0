// SPDX-License-Identifier: MIT
#include "datasets/synthetic/builder.h"

#include <algorithm>
#include <utility>

namespace burin::synthetic {

Mat3d rotation_about(int axis, double angle) {
    const double c = cosine(angle), s = sine(angle);
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    Mat3d R;
    R(i, i) = c, R(i, j) = -s;
    R(j, i) = s, R(j, j) = c;
    return R;
}

Mat3d rotation_z_to(Vec3d d) {
    // Rodrigues' formula about z x d, with the pole d = -z apart.
    if (d.z < -0.999999) return rotation_about(0, kPi);
    const double k = 1 / (1 + d.z);
    Mat3d R;
    R(0, 0) = 1 - d.x * d.x * k, R(0, 1) = -d.x * d.y * k, R(0, 2) = d.x;
    R(1, 0) = -d.x * d.y * k, R(1, 1) = 1 - d.y * d.y * k, R(1, 2) = d.y;
    R(2, 0) = -d.x, R(2, 1) = -d.y, R(2, 2) = d.z;
    return R;
}

SceneBuilder::SceneBuilder(const char* name, std::uint64_t seed) : random(seed, 0x5CE9E) {
    data.name = name;
    data.seed = seed;
}

int SceneBuilder::material(Texture texture, Vec3f a, Vec3f b, double scale, double extent_u,
                           double extent_v) {
    const auto seed = static_cast<std::uint32_t>(random.bits());
    data.materials.push_back({texture, a, b, scale, extent_u, extent_v, seed});
    return static_cast<int>(data.materials.size()) - 1;
}

Vec3f SceneBuilder::bright_colour() {
    const double hue = random.in(0, 6), light = random.in(0.25, 0.65), floor = random.in(0.04, 0.15);
    Vec3f c;
    for (int i = 0; i < 3; ++i) {
        const double x = std::fabs(std::fmod(hue + 2 * i, 6) - 3) - 1;
        c[i] = static_cast<float>(floor + (light - floor) * std::clamp(x, 0.0, 1.0));
    }
    return c;
}

Vec3f SceneBuilder::pale_colour() {
    const Vec3f tint = bright_colour();
    const auto light = static_cast<float>(random.in(0.45, 0.65));
    return Vec3f{light, light * 0.97f, light * 0.9f} * 0.8f + tint * 0.2f;
}

int SceneBuilder::random_wood(double ring) {
    const double light = random.in(0.25, 1);
    const Vec3f a = linear_colour(205, 165, 115) * static_cast<float>(light);
    const Vec3f b = linear_colour(140, 90, 50) * static_cast<float>(light);
    return material(Texture::wood, a, b, ring);
}

int SceneBuilder::random_fabric() {
    const Vec3f a = bright_colour();
    return material(Texture::fabric, a, a * 0.5f + Vec3f{0.12f, 0.12f, 0.12f}, random.in(0.012, 0.03));
}

int SceneBuilder::random_glaze() {
    const Texture kind[3] = {Texture::plain, Texture::stripes, Texture::mottled};
    const Vec3f a = bright_colour();
    const Texture texture = kind[random.below(3)];
    return material(texture, a, Vec3f{0.75f, 0.72f, 0.65f}, random.in(0.03, 0.06));
}

int SceneBuilder::two_tone(Texture texture, double scale, double extent_u, double extent_v) {
    const Vec3f a = bright_colour(), b = bright_colour();
    return material(texture, a, b, scale, extent_u, extent_v);
}

void SceneBuilder::object(Label label, Vec3d position, double yaw) {
    label_ = label;
    ++instance_;
    T_scene_object_ = {rotation_about(2, yaw), position};
}

Part& SceneBuilder::add(Shape shape, Vec3d position, Vec3d size, int material_index, double round,
                        const Mat3d& R_object_part) {
    Part part;
    part.shape = shape;
    part.label = label_;
    part.instance = static_cast<std::uint16_t>(instance_);
    part.material = static_cast<std::uint16_t>(material_index);
    part.blend = static_cast<std::int16_t>(blend_);
    part.R_part_scene = (T_scene_object_.R * R_object_part).transposed();
    part.position = T_scene_object_ * position;
    part.size = size;
    part.round = round;
    data.parts.push_back(std::move(part));
    return data.parts.back();
}

Part& SceneBuilder::box(Vec3d low, Vec3d high, int material_index, double round) {
    return add(Shape::box, (low + high) * 0.5, (high - low) * 0.5, material_index, round);
}

Part& SceneBuilder::limb(Vec3d a, double ra, Vec3d b, double rb, int material_index) {
    const Vec3d axis = b - a;
    const double length = norm(axis);
    return add(Shape::capsule, (a + b) * 0.5, {ra, rb, 0.5 * length}, material_index, 0,
               rotation_z_to(axis * (1 / length)));
}

Part& SceneBuilder::lathe(Vec3d position, std::vector<ProfilePoint> profile, double thickness,
                          int material_index) {
    Part& part = add(Shape::lathe, position, {}, material_index, thickness);
    part.profile = std::move(profile);
    return part;
}

Part& SceneBuilder::plane(Vec3d position, Vec3d normal, Vec3d u, double half_u, double half_v,
                          int material_index) {
    const Vec3d v = cross(normal, u);
    Mat3d R;
    for (int i = 0; i < 3; ++i) R(i, 0) = u[i], R(i, 1) = v[i], R(i, 2) = normal[i];
    return add(Shape::half_space, position, {half_u, half_v, 0}, material_index, 0, R);
}

int SceneBuilder::new_blend(double k) {
    data.blends.push_back({k});
    return blend_ = static_cast<int>(data.blends.size()) - 1;
}

double SceneBuilder::distance(Vec3d p_scene) const {
    double best = 1e300;
    for (const Part& part : data.parts) best = std::min(best, part_distance(part, part.to_part(p_scene)));
    return best;
}

void SceneBuilder::light(Vec3d position, Vec3f colour, double strength, double reach) {
    data.lights.push_back({position, colour * static_cast<float>(strength), reach});
}

}  // namespace burin::synthetic
