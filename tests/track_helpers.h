// SPDX-License-Identifier: MIT
// A room with something on its walls, a way through it, and how far poses are apart: for the tests of
// tracking.
#pragma once

#include <algorithm>
#include <vector>

#include "scene_helpers.h"
#include "track/track_points.h"

namespace burin {

inline constexpr double kDegree = M_PI / 180;

// A corner of a room with balls in it.
inline AnalyticScene tracking_room() {
    return {{{{0, 0, -1}, -2.6}, {{0, -1, 0}, -1.1}, {{1, 0, 0}, -1.7}, {{-1, 0, 0}, -2.1}},
            {{{-0.7, 0.7, 1.9}, 0.4},
             {{0.6, 0.2, 2.2}, 0.35},
             {{0.1, 0.9, 1.5}, 0.25},
             {{-0.9, -0.6, 2.4}, 0.3}}};
}

// Brightness of the surface at a point, 0.2 .. 0.8: waves of 0.2 to 0.5 m in no direction of an axis.
inline double texture_at(Vec3d p) {
    return 0.5 + 0.15 * std::sin(14 * p.x + 9 * p.y + 3 * p.z) +
           0.15 * std::sin(-8 * p.x + 19 * p.y - 9 * p.z);
}

// The scene in three colours of one luma or another; gain and bias of an exposure, in levels.
inline Image<std::uint8_t> paint(const AnalyticScene& scene, const Camera& camera, const Se3& T_world_camera,
                                 double gain = 1, double bias = 0) {
    Image<std::uint8_t> out(camera.width, camera.height, 3);
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
            const Vec3d ray =
                T_world_camera.R * unproject(camera, {static_cast<double>(x), static_cast<double>(y)});
            const double t = scene.trace(T_world_camera.t, ray);
            const double level = t > 0 ? gain * 255 * texture_at(T_world_camera.t + ray * t) + bias : 0;
            for (int c = 0; c < 3; ++c)
                out.view().at(x, y, c) =
                    static_cast<std::uint8_t>(std::lround(std::clamp(level * (1.1 - 0.1 * c), 0.0, 255.0)));
        }
    return out;
}

// 14 directions: along and about each axis, and the corners.
inline constexpr int kDirections = 14;
inline Twist direction(int i, double m, double rad) {
    Twist xi;
    if (i < 6) {
        xi.v[i / 2] = i % 2 ? m : -m;
        xi.w[(i / 2 + 1) % 3] = i % 2 ? rad : -rad;
        return xi;
    }
    for (int k = 0; k < 3; ++k) {
        xi.v[k] = ((i - 6) >> k & 1 ? m : -m) / std::sqrt(3.0);
        xi.w[k] = ((i - 6) >> k & 1 ? rad : -rad) / std::sqrt(3.0);
    }
    return xi;
}

inline double away_m(const Se3& a, const Se3& b) { return norm(a.t - b.t); }
inline double away_rad(const Se3& a, const Se3& b) {
    const Twist xi = motion_between(a, b);
    return norm(Vec3d{xi.w[0], xi.w[1], xi.w[2]});
}
inline bool same_bits(const Se3& a, const Se3& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

// The defaults of a scan, for small images.
inline burin_config scan_config(float voxel_m = 0.01f) {
    burin_config c = burin_scan_config_default();
    c.budget_bytes = 64u << 20;
    c.voxel_m = voxel_m;
    c.max_width = 160;
    c.max_height = 120;
    return c;
}

// Where the map of the room is seen from, and beyond.
inline Se3 room_view(int i) { return look_from({0.05 * i, -0.1 + 0.02 * i, 0.03 * i}, {0.1, 0.3, 2.0}); }
// The room as a map, from six true poses.
inline const Volume& fused_room(TestSession& session, const Camera& camera) {
    for (int i = 0; i < 6; ++i)
        session.integrate(frame_of(tracking_room().depth(camera, room_view(i)), camera, room_view(i)));
    return session.volume();
}

// Depth of a scan for scenes without noise.
inline DepthOptions noiseless_depth() {
    DepthOptions o = options_of(scan_config()).depth;
    o.bilateral = false;
    return o;
}

// Depth, threads and points of one frame, in one memory with the parts that a test adds.
struct TrackRig {
    TrackRig(const DepthOptions& options, int threads) : depth(options), jobs(threads) {}
    // place(arena) lays out the parts of the derived rig.
    template <class Place>
    void lay_out(const Camera& camera, float max_depth_m, Place&& place) {
        const auto place_all = [&](Arena& arena) {
            points.place(arena, camera.width, camera.height, max_depth_m);
            place(arena);
        };
        Arena measure;
        place_all(measure);
        memory = aligned_memory(measure.used());
        Arena arena(memory.get(), measure.used());
        place_all(arena);
    }
    void build_points(const Image<float>& image, const Camera& camera) {
        points.build(depth.prepare(frame_of(image, camera, {})), jobs);
    }

    TestDepth depth;
    Jobs jobs;
    Memory memory;
    TrackPoints points;
};

// A round through the room in `count` frames of 160 x 120, 30 a second, with colour.
struct RoomSequence {
    explicit RoomSequence(int count = 60) {
        for (int i = 0; i < count; ++i) {
            const double a = 2 * M_PI * i / 60;  // 31 mm a frame
            poses.push_back(
                look_from({0.3 * std::sin(a), -0.1 + 0.1 * std::sin(2 * a), 0.15 - 0.15 * std::cos(a)},
                          {0.1 + 0.2 * std::sin(a), 0.3 + 0.1 * std::cos(a), 2.0}));
            depths.push_back(tracking_room().depth(camera, poses.back()));
            colours.push_back(paint(tracking_room(), camera, poses.back()));
        }
    }
    // Only the first frame tells its pose; the others' would be far off.
    FrameView frame(int i, bool colour = true) const {
        const auto k = static_cast<std::size_t>(i);
        Se3 pose = poses[k];
        if (i > 0) pose.t.x += 3;
        FrameView v = frame_of(depths[k], camera, pose);
        v.t_ns = i * std::int64_t{33333333};
        if (colour) {
            v.colour = colours[k].view();
            v.colour_camera = camera;
        }
        return v;
    }
    const Se3& pose(int i) const { return poses[static_cast<std::size_t>(i)]; }

    Camera camera = test_camera();
    std::vector<Se3> poses;
    std::vector<Image<float>> depths;
    std::vector<Image<std::uint8_t>> colours;
};
inline const RoomSequence& room_sequence() {
    static const RoomSequence sequence;
    return sequence;
}

}  // namespace burin
