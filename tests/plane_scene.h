// SPDX-License-Identifier: MIT
// A corner of a room with a low box on the floor, z up, for the tests of planes.
#pragma once

#include "scene_helpers.h"

namespace burin {

// Floor z = 0, walls x = -1 and y = 1.4, a box of 40 mm height. A part of the floor may be blind (a sensor
// that gets nothing back) or a pit of 0.5 m that is seen into.
struct PlaneScene {
    struct Face {
        Vec3d normal;
        double offset;
    };
    Face faces[3] = {{{0, 0, 1}, 0}, {{1, 0, 0}, 1}, {{0, -1, 0}, 1.4}};
    Vec3d box_low{0.2, 0.5, 0}, box_high{0.44, 0.74, 0.04};
    Vec3d hole_low{-0.56, 0.36, 0}, hole_high{-0.36, 0.56, 0};
    bool blind = false, pit = false;
    double sigma_m = 0.001;  // noise along the optical axis

    double trace(Vec3d o, Vec3d d) const {
        double first = 1e9;
        for (const Face& f : faces) {
            const double along = dot(f.normal, d);
            if (!(along < 0)) continue;
            double t = -(dot(f.normal, o) + f.offset) / along;
            const Vec3d x = o + d * t;
            const bool in_hole = f.normal.z > 0 && x.x > hole_low.x && x.x < hole_high.x &&
                                 x.y > hole_low.y && x.y < hole_high.y;
            if (in_hole && blind && t < first) t = first = 0;
            if (in_hole && pit) t = t * (o.z + 0.5) / o.z;  // its ground, wider than its mouth
            first = std::min(first, t);
        }
        double enter = 0, leave = 1e9;
        for (int r = 0; r < 3; ++r) {
            const double a = (box_low[r] - o[r]) / d[r], b = (box_high[r] - o[r]) / d[r];
            enter = std::max(enter, std::min(a, b));
            leave = std::min(leave, std::max(a, b));
        }
        if (enter < leave && enter > 0) first = std::min(first, enter);
        return first < 1e9 ? first : 0;
    }
    Image<float> depth(const Camera& camera, const Se3& T_world_camera, int frame) const {
        Rng rng(static_cast<std::uint64_t>(frame) + 1);
        Image<float> out(camera.width, camera.height);
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x) {
                const Vec3d ray = unproject(camera, {static_cast<double>(x), static_cast<double>(y)});
                const double t = trace(T_world_camera.t, T_world_camera.R * ray);
                out.view().at(x, y) = static_cast<float>(t > 0 ? t + sigma_m * rng.normal() : 0);
            }
        return out;
    }
};

inline Se3 walk_pose(int i) {
    const double a = 0.05 * i;
    return look_from({0.35 + 0.3 * std::cos(a), -0.1 + 0.3 * std::sin(a), 1.1 + 0.1 * std::sin(2.3 * a)},
                     {-0.25 + 0.2 * std::sin(a), 0.7, 0.1}, {0, 0, 1});
}

inline burin_config plane_config() {
    burin_config c = test_config(0.01f);
    c.planes = 1;
    c.budget_bytes = 48u << 20;
    return c;
}

}  // namespace burin
