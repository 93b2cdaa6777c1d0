// SPDX-License-Identifier: MIT
//
// Poses and cameras of burin.h as GLM matrices, so that an AR renderer draws a map over the camera's image:
// C++17, GLM 0.9.9 or later. Matrices are GLM's (columns, for column vectors).
//
//     gl_Position = projection_gl(camera, near, far) * view(T_world_camera) * vec4(position of a vertex, 1)
//
// Eye space is OpenGL's: x right, y up, z towards the viewer; world space is the map's, in metres. Pixel
// centres have integer coordinates, so the image reaches from -0.5 to width - 0.5. Lenses: k1 .. k3, p1 and
// p2 are not looked at, a matrix cannot bend lines: draw over a rectified image. No errors: nonsense in,
// nonsense out. Any thread.
#ifndef BURIN_GLM_HPP
#define BURIN_GLM_HPP

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "burin/burin.h"

namespace burin {
inline namespace cpp {

// A pose as a matrix: T_a_b maps coordinates of b to a. For poses of cameras, b has camera axes (y down, z
// forward).
inline glm::dmat4 matrix(const burin_pose& T) {
    glm::dmat4 m = glm::mat4_cast(glm::dquat(T.qw, T.qx, T.qy, T.qz));
    m[3] = glm::dvec4(T.tx, T.ty, T.tz, 1.0);
    return m;
}

// Camera axes (x right, y down, z forward) to eye axes (x right, y up, z backward), and back: it is its own
// inverse.
inline glm::dmat4 camera_to_eye() {
    glm::dmat4 m(1.0);
    m[1][1] = m[2][2] = -1.0;
    return m;
}

// World to eye: where the renderer's camera must stand to see what the depth camera sees.
inline glm::mat4 view(const burin_pose& T_world_camera) {
    return glm::mat4(camera_to_eye() * glm::inverse(matrix(T_world_camera)));
}

// The pose for burin_frame of a camera given as OpenGL, ARKit and ARCore do: T_world_eye maps eye axes to the
// world. It must be rigid.
inline burin_pose pose_from_eye(const glm::dmat4& T_world_eye) {
    const glm::dmat4 m = T_world_eye * camera_to_eye();
    const glm::dquat q = glm::normalize(glm::quat_cast(m));
    burin_pose pose;
    pose.tx = m[3].x;
    pose.ty = m[3].y;
    pose.tz = m[3].z;
    pose.qx = q.x;
    pose.qy = q.y;
    pose.qz = q.z;
    pose.qw = q.w;
    return pose;
}

// Eye to clip space of OpenGL: y up, depth -1 at near_m to 1 at far_m. 0 < near_m < far_m, metres along the
// axis.
inline glm::mat4 projection_gl(const burin_camera& c, double near_m, double far_m) {
    const double w = c.width, h = c.height;
    glm::dmat4 m(0.0);
    m[0][0] = 2.0 * c.fx / w;
    m[1][1] = 2.0 * c.fy / h;
    m[2][0] = 1.0 - 2.0 * (c.cx + 0.5) / w;
    m[2][1] = 2.0 * (c.cy + 0.5) / h - 1.0;
    m[2][2] = -(far_m + near_m) / (far_m - near_m);
    m[2][3] = -1.0;
    m[3][2] = -2.0 * far_m * near_m / (far_m - near_m);
    return glm::mat4(m);
}

// Eye to clip space of Vulkan: y down, depth 0 at near_m to 1 at far_m.
inline glm::mat4 projection_vulkan(const burin_camera& c, double near_m, double far_m) {
    const double w = c.width, h = c.height;
    glm::dmat4 m(0.0);
    m[0][0] = 2.0 * c.fx / w;
    m[1][1] = -2.0 * c.fy / h;
    m[2][0] = 1.0 - 2.0 * (c.cx + 0.5) / w;
    m[2][1] = 1.0 - 2.0 * (c.cy + 0.5) / h;
    m[2][2] = -far_m / (far_m - near_m);
    m[2][3] = -1.0;
    m[3][2] = -far_m * near_m / (far_m - near_m);
    return glm::mat4(m);
}

}  // namespace cpp
}  // namespace burin
#endif
