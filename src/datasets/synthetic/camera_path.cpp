// SPDX-License-Identifier: MIT
#include "datasets/synthetic/camera_path.h"

#include <algorithm>
#include <cmath>

#include "datasets/synthetic/builder.h"

namespace burin {
namespace {

using synthetic::cosine;
using synthetic::hash_bits;
using synthetic::kPi;
using synthetic::sine;
using synthetic::to_unit;

constexpr double kFramesPerSecond = 30;

// Hand tremor: a few incommensurate sines a channel, strongest below 1 Hz and fading to 7 Hz (a hand holding
// 1 kg). Unit amplitude per channel at the slowest.
double tremor(double t, std::uint64_t seed, std::uint64_t channel) {
    constexpr double kHertz[] = {0.37, 0.83, 1.7, 3.1, 6.3};
    constexpr double kAmplitude[] = {1.0, 0.55, 0.22, 0.08, 0.03};
    double sum = 0;
    for (std::uint64_t i = 0; i < 5; ++i)
        sum += kAmplitude[i] * sine(2 * kPi * (kHertz[i] * t + to_unit(hash_bits(seed, channel, i))));
    return sum;
}

struct View {
    Vec3d eye, target;
};

Se3 shaken(const View& view, double t, std::uint64_t seed, double metres, double radians) {
    const Vec3d sway{tremor(t, seed, 1), tremor(t, seed, 2), tremor(t, seed, 3)};
    const Se3 T = look_at(view.eye + sway * metres, view.target + sway * (0.3 * metres));
    // Small rotations in the camera frame, the last about the optical axis.
    const Mat3d R = synthetic::rotation_about(0, radians * tremor(t, seed, 4)) *
                    synthetic::rotation_about(1, radians * tremor(t, seed, 5)) *
                    synthetic::rotation_about(2, 1.5 * radians * tremor(t, seed, 6));
    return {T.R * R, T.t};
}

// Once around in 12 s on an ellipse inside the free volume, looking outwards over the near furniture: 30
// degrees and some 0.4 m a second.
View room_view(double t) {
    const double a = 2 * kPi * t / 12 - 1.2, nod = sine(2 * kPi * t / 7.3);
    const Vec3d eye{0.75 * cosine(a + kPi), 1.0 * sine(a + kPi), 1.4 + 0.12 * nod};
    return {eye, eye + Vec3d{cosine(a), sine(a), -0.32 + 0.14 * sine(2 * kPi * t / 5.1)}};
}

// s in 0..1: a bow over the desk from the left to the right and back nearer by.
View desk_view(double s) {
    const double a = 1.1 * cosine(2 * kPi * s), near = sine(2 * kPi * s);
    const double reach = 1.0 - 0.22 * near;
    return {{reach * sine(a) * 0.95, -0.1 - reach * cosine(a) * 0.85, 1.3 + 0.1 * near},
            {0.25 * sine(a), 0.08, 0.8 + 0.03 * sine(6 * kPi * s)}};
}

// A figure of eight before the panel, 0.43 to 0.55 m away: past the sensor's nearest range.
View relief_view(double s) {
    const double a = 2 * kPi * s;
    const Vec3d eye{0.24 * sine(a), -0.46 + 0.03 * cosine(2 * a), 0.21 + 0.13 * sine(2 * a)};
    return {eye, {0.09 * sine(a), 0, 0.2 + 0.05 * sine(2 * a)}};
}

// Once around the turntable, the whole person in view, while the camera rises and sinks twice.
View figure_view(double s) {
    const double a = 2 * kPi * s + 0.5 * kPi, nod = sine(4 * kPi * s + 0.4);
    return {{1.95 * cosine(a), 1.95 * sine(a), 1.05 + 0.45 * nod}, {0, 0, 0.88 + 0.06 * nod}};
}

// Corridor: the middle line, a rectangle 18 x 10 m with rounded corners. Arc length to position and heading.
constexpr double kLineX = 9, kLineY = 5, kTurn = 0.95;  // metres: half sides, corner radius
constexpr double kWalk = 1.0;                           // metres a second
double round_length() { return 4 * (kLineX + kLineY - 2 * kTurn) + 2 * kPi * kTurn; }

void corridor_line(double s, Vec3d* position, Vec3d* heading) {
    const double straight[4] = {2 * (kLineX - kTurn), 2 * (kLineY - kTurn), 2 * (kLineX - kTurn),
                                2 * (kLineY - kTurn)};
    const Vec3d along[4] = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
    const Vec3d start[4] = {{-kLineX + kTurn, -kLineY, 0},
                            {kLineX, -kLineY + kTurn, 0},
                            {kLineX - kTurn, kLineY, 0},
                            {-kLineX, kLineY - kTurn, 0}};
    s -= std::floor(s / round_length()) * round_length();
    for (int side = 0; side < 4; ++side) {
        const Vec3d left{-along[side].y, along[side].x, 0};
        if (s <= straight[side]) {
            *position = start[side] + along[side] * s;
            *heading = along[side];
            return;
        }
        s -= straight[side];
        const double angle = s / kTurn;
        if (angle <= 0.5 * kPi || side == 3) {
            const Vec3d centre = start[side] + along[side] * straight[side] + left * kTurn;
            *position = centre + along[side] * (kTurn * sine(angle)) - left * (kTurn * cosine(angle));
            *heading = along[side] * cosine(angle) + left * sine(angle);
            return;
        }
        s -= 0.5 * kPi * kTurn;
    }
}

View corridor_view(double t) {
    Vec3d eye, heading, ahead, unused;
    corridor_line(kWalk * t, &eye, &heading);
    corridor_line(kWalk * t + 0.9, &ahead, &unused);      // people look into a turn before they walk it
    const double glance = 0.5 * sine(2 * kPi * t / 6.7);  // from wall to wall
    eye.z = 1.45 + 0.02 * sine(2 * kPi * 1.8 * t);        // steps
    const Vec3d look = normalised(ahead - Vec3d{eye.x, eye.y, 0});
    const Vec3d side{-look.y, look.x, 0};
    return {eye, eye + look * cosine(glance) + side * sine(glance) + Vec3d{0, 0, -0.16}};
}

}  // namespace

int default_frame_count(const std::string& scene) {
    if (scene == "corridor") return static_cast<int>((round_length() + 4) / kWalk * kFramesPerSecond);
    return scene == "relief" ? 120 : scene == "figure" ? 240 : 200;
}

Se3 look_at(Vec3d eye, Vec3d target) {
    const Vec3d forward = normalised(target - eye);
    Vec3d right = cross(forward, Vec3d{0, 0, 1});
    right = norm(right) > 1e-9 ? normalised(right) : Vec3d{1, 0, 0};
    const Vec3d down = cross(forward, right);
    Mat3d R;
    for (int i = 0; i < 3; ++i) R(i, 0) = right[i], R(i, 1) = down[i], R(i, 2) = forward[i];
    return {R, eye};
}

Trajectory builtin_path(const std::string& scene, std::uint64_t seed, int frames) {
    Trajectory path;
    const std::uint64_t key = hash_bits(seed, 0x9A7);
    for (int i = 0; i < frames; ++i) {
        const double t = i / kFramesPerSecond, s = static_cast<double>(i) / frames;
        Se3 T;
        if (scene == "room")
            T = shaken(room_view(t), t, key, 0.012, 0.012);
        else if (scene == "corridor")
            T = shaken(corridor_view(t), t, key, 0.02, 0.012);
        else if (scene == "desk")
            T = shaken(desk_view(s), t, key, 0.008, 0.008);
        else if (scene == "relief")
            T = shaken(relief_view(s), t, key, 0.004, 0.006);
        else
            T = shaken(figure_view(s), t, key, 0.008, 0.006);
        path.push_back({static_cast<std::int64_t>(i) * 1'000'000'000 / 30, T});
    }
    return path;
}

Se3 default_T_scene_trajectory(const std::string& scene, std::uint64_t seed, const Trajectory& trajectory) {
    Vec3d mean_up;
    for (const StampedPose& pose : trajectory) mean_up = mean_up - pose.T_world_camera.R.column(1);
    int axis = 0;
    for (int i = 1; i < 3; ++i)
        if (std::fabs(mean_up[i]) > std::fabs(mean_up[axis])) axis = i;
    const bool negative = mean_up[axis] < 0;
    if (scene == "room" && axis == 1 && negative)
        return {Mat3d{{1, 0, 0, 0, 0, 1, 0, -1, 0}}, {-1.05, -0.2, 0}};
    // Rows of the rotation are the scene's axes in the recorded world: cyclic, so that it stays right-handed.
    Mat3d up;
    const double sign = negative ? -1 : 1;
    for (double& m : up.m) m = 0;
    up(0, (axis + 1) % 3) = 1;
    up(1, (axis + 2) % 3) = sign;
    up(2, axis) = sign;
    const Se3 goal = builtin_path(scene, seed, 1).front().T_world_camera;
    const Se3 first = Se3{up, {}} * trajectory.front().T_world_camera;
    const Vec3d from = first.R.column(2), to = goal.R.column(2);
    // The turn about z that maps heading `from` to heading `to`, without trigonometry.
    const double c = from.x * to.x + from.y * to.y, s = from.x * to.y - from.y * to.x,
                 n = std::sqrt(c * c + s * s);
    Mat3d yaw;
    if (n > 1e-9) yaw = {{c / n, -s / n, 0, s / n, c / n, 0, 0, 0, 1}};
    const Mat3d R = yaw * up;
    return {R, goal.t - R * trajectory.front().T_world_camera.t};
}

}  // namespace burin
