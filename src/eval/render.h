// SPDX-License-Identifier: MIT
// Pictures of a mesh by a z-buffer: to look at results without a viewer, and to compare a mesh with depth
// images. Deterministic: the same image for any number of threads.
#pragma once

#include <array>
#include <cstdint>

#include "core/camera.h"
#include "core/image.h"
#include "core/jobs.h"
#include "core/se3.h"
#include "core/status.h"
#include "core/triangle_mesh.h"

namespace burin {

inline constexpr std::uint32_t kNoTriangle = 0xffffffff;
// Nearer than any depth camera measures; keeps the surface a camera touches from filling the image.
inline constexpr double kDefaultNear_m = 0.01;

struct MeshRaster {
    Image<float> depth_m;           // along the optical axis; 0 where nothing is seen
    Image<std::uint32_t> triangle;  // index of the triangle seen, or kNoTriangle
};

// What each pixel's central ray hits first at z >= near_m. Triangles that reach behind the camera are cut
// exactly at near_m; neighbours leave no gaps. With cull_back_faces only triangles wound counter-clockwise
// for the viewer are seen. Error: check_mesh, check_camera, a camera with distortion (unsupported: straight
// edges would not stay straight), near_m not positive, memory.
Result<MeshRaster> rasterise(const TriangleMesh& mesh, const Camera& camera, const Se3& T_world_camera,
                             double near_m, bool cull_back_faces, Jobs& jobs);

enum class RenderMode {
    shaded,         // grey, lit from the camera
    shaded_colour,  // vertex colours (grey without), lit from the camera
    colour,         // vertex colours as they are (grey without)
    normals,        // world normals, (-1..1) -> (0..255)
    depth,          // near white, far dark
};

struct RenderOptions {
    RenderMode mode = RenderMode::shaded;
    bool cull_back_faces =
        false;  // otherwise they are painted bluish (not in depth), so that holes and flips show
    int supersample =
        2;  // rays per pixel and direction, 1..4, averaged; lowered where it exceeds kMaxImageSide
    double near_m = kDefaultNear_m;
    std::array<std::uint8_t, 3> background = {255, 255, 255};
    double min_depth_m = 0, max_depth_m = 0;  // range of RenderMode::depth; both 0: what the image holds
};

// An RGB image of the camera's size. Errors as rasterise(); supersample outside 1..4; a depth range without
// extent. Normals are the mesh's, interpolated, or those of the triangles when it has none.
Result<Image<std::uint8_t>> render_mesh(const TriangleMesh& mesh, const Camera& camera,
                                        const Se3& T_world_camera, const RenderOptions& options, Jobs& jobs);

struct Viewpoint {
    Camera camera;
    Se3 T_world_camera;
    bool cull_back_faces = false;
};

// A view of the whole from 35 degrees above: from the side most of the surface faces, else with the longer
// side across the image. When the surface faces inwards (a room) back faces are to be culled, so that one
// looks in through the near walls and the ceiling. `up` is the world's up direction. The outermost 0.5 % of
// the vertices on every side do not count, lest a stray speck shrink everything. Error: check_mesh, no
// triangles, an image side outside 1..kMaxImageSide, up without length.
Result<Viewpoint> view_for(const TriangleMesh& mesh, int width, int height, Vec3d up = {0, 0, 1});

}  // namespace burin
