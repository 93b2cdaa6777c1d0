// SPDX-License-Identifier: MIT
// Hand-held looking camera paths for the built-in scenes, and placing recorded ones into them.
#pragma once

#include <string>

#include "core/status.h"
#include "core/trajectory.h"

namespace burin {

// Frames a scene gets when none are asked for: room 200, desk 200, corridor one round and 4 m more at 1 m/s,
// relief 120, figure 240.
int default_frame_count(const std::string& scene);

// `frames` poses at 30 Hz in the scene's frame, stamps i / 30 s. room and corridor walk on: N frames are the
// first N of an endless path. desk, relief and figure spread their frames over one orbit, however many there
// are.
Trajectory builtin_path(const std::string& scene, std::uint64_t seed, int frames);

// Camera at `eye` looking at `target`, image upright against z.
Se3 look_at(Vec3d eye, Vec3d target);

// The transform that brings a recorded trajectory's world into the scene when the caller gives none. In
// `room`, a trajectory whose world has y down is taken for one of the ICL-NUIM living room and laid into it:
// (x, y, z) -> (x - 1.05, z - 0.2, -y). All others: "up" of the recorded world is the axis nearest to the
// images' up, on average; it becomes z, and the first pose is put where the built-in path begins, heading the
// same way. (A trajectory written by this synthesiser comes back as it was.) Not empty.
Se3 default_T_scene_trajectory(const std::string& scene, std::uint64_t seed, const Trajectory& trajectory);

}  // namespace burin
