// SPDX-License-Identifier: MIT
// glm.hpp: what the matrices draw where, against projecting the same points by the camera's own formula.
#include <gtest/gtest.h>
#include <burin/glm.hpp>

#include "scene_helpers.h"

namespace burin {
namespace {

// Off-centre, of unequal scales, as no real camera is.
const Camera kCamera{640, 360, 500, 430, 301.25, 190.5};
constexpr double kNear = 0.1, kFar = 20;

struct Clipped {
    double u, v, depth;
};
// The renderer's part: clip space to pixels. y_up: OpenGL's, whose images begin at the bottom.
Clipped to_pixels(const glm::mat4& projection, const glm::mat4& view_matrix, Vec3d p, bool y_up) {
    const glm::dvec4 clip = glm::dmat4(projection) * (glm::dmat4(view_matrix) * glm::dvec4(p.x, p.y, p.z, 1));
    const double x = clip.x / clip.w, y = (y_up ? -clip.y : clip.y) / clip.w;
    return {(x + 1) / 2 * kCamera.width - 0.5, (y + 1) / 2 * kCamera.height - 0.5, clip.z / clip.w};
}

TEST(Glm, PointsFallOnTheirPixels) {
    Rng rng(1);
    for (int i = 0; i < 200; ++i) {
        const Se3 T = random_pose(rng, 3);
        const burin_pose pose = c_pose(T);
        const double z = rng.uniform(kNear, kFar);
        const Pixel pixel{rng.uniform(-0.5, kCamera.width - 0.5), rng.uniform(-0.5, kCamera.height - 0.5)};
        const Vec3d p = T * (unproject(kCamera, pixel) * z);
        const burin_camera c = c_camera(kCamera);
        const Clipped gl = to_pixels(projection_gl(c, kNear, kFar), view(pose), p, true);
        const Clipped vulkan = to_pixels(projection_vulkan(c, kNear, kFar), view(pose), p, false);
        // Single precision, nearer than a metre at coordinates of several: a hundredth of a pixel.
        const double tolerance = 0.002 + 0.005 / z;
        EXPECT_NEAR(gl.u, pixel.u, tolerance);
        EXPECT_NEAR(gl.v, pixel.v, tolerance);
        EXPECT_NEAR(vulkan.u, pixel.u, tolerance);
        EXPECT_NEAR(vulkan.v, pixel.v, tolerance);
        // Both depths, from their definitions: linear in 1 / z between near and far.
        const double between = (1 / kNear - 1 / z) / (1 / kNear - 1 / kFar);
        EXPECT_NEAR(vulkan.depth, between, 1e-4);
        EXPECT_NEAR(gl.depth, 2 * between - 1, 2e-4);
    }
}

TEST(Glm, CornersOfTheImageAreThoseOfClipSpace) {
    const burin_pose identity{0, 0, 0, 0, 0, 0, 1};
    const burin_camera c = c_camera(kCamera);
    for (const double u : {-0.5, kCamera.width - 0.5})
        for (const double v : {-0.5, kCamera.height - 0.5})
            for (const double z : {kNear, kFar}) {
                const Vec3d p = unproject(kCamera, {u, v}) * z;
                const glm::vec4 at(p.x, p.y, p.z, 1);
                const glm::vec4 gl = projection_gl(c, kNear, kFar) * view(identity) * at;
                const glm::vec4 vulkan = projection_vulkan(c, kNear, kFar) * view(identity) * at;
                EXPECT_NEAR(gl.x / gl.w, u < 0 ? -1 : 1, 1e-5);
                EXPECT_NEAR(gl.y / gl.w, v < 0 ? 1 : -1, 1e-5) << "the first row is the upper one";
                EXPECT_NEAR(gl.z / gl.w, z == kNear ? -1 : 1, 1e-5);
                EXPECT_NEAR(vulkan.x / vulkan.w, u < 0 ? -1 : 1, 1e-5);
                EXPECT_NEAR(vulkan.y / vulkan.w, v < 0 ? -1 : 1, 1e-5);
                EXPECT_NEAR(vulkan.z / vulkan.w, z == kNear ? 0 : 1, 1e-5);
            }
}

TEST(Glm, PosesComeBack) {
    Rng rng(2);
    for (int i = 0; i < 50; ++i) {
        const Se3 T = random_pose(rng, 5);
        const glm::dmat4 m = matrix(c_pose(T));
        const Vec3d p{rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)}, q = T * p;
        const glm::dvec4 moved = m * glm::dvec4(p.x, p.y, p.z, 1);
        EXPECT_NEAR(moved.x, q.x, 1e-12);
        EXPECT_NEAR(moved.y, q.y, 1e-12);
        EXPECT_NEAR(moved.z, q.z, 1e-12);
        // An AR system gives the inverse of the view matrix.
        const burin_pose back = pose_from_eye(m * camera_to_eye());
        const Se3 again =
            *se3_from_quaternion({back.tx, back.ty, back.tz}, {back.qx, back.qy, back.qz, back.qw});
        EXPECT_LT(norm(again * p - q), 1e-12);
    }
}

}  // namespace
}  // namespace burin
