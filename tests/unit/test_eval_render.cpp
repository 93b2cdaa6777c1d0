// SPDX-License-Identifier: MIT
// The rasteriser against rays through the search tree, and pictures whose pixels are known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "eval/render.h"
#include "eval/triangle_bvh.h"
#include "test_eval_meshes.h"

using namespace burin;
using namespace burin::testing_meshes;

namespace {

Camera make_camera(int width, int height, double f) {
    Camera c;
    c.width = width;
    c.height = height;
    c.fx = f;
    c.fy = 1.1 * f;
    c.cx = 0.47 * width;
    c.cy = 0.52 * height;
    return c;
}

Se3 any_pose(Random& random, double reach) {
    const Vec3d axis = random.direction();
    const double half = random.between(0, 1.5);
    return *se3_from_quaternion(random.point(reach), {axis.x * std::sin(half), axis.y * std::sin(half),
                                                      axis.z * std::sin(half), std::cos(half)});
}

struct Agreement {
    int pixels = 0, covered = 0, different = 0, behind = 0;
};

// Compares every pixel with the ray through its centre.
Agreement compare(const TriangleMesh& mesh, const Camera& camera, const Se3& T_world_camera, double near_m,
                  Jobs& jobs) {
    Agreement out;
    const auto raster = rasterise(mesh, camera, T_world_camera, near_m, false, jobs);
    const auto bvh = TriangleBvh::build(mesh, jobs);
    EXPECT_TRUE(raster.ok() && bvh.ok());
    if (!raster.ok() || !bvh.ok()) return out;
    for (int v = 0; v < camera.height; ++v)
        for (int u = 0; u < camera.width; ++u) {
            const Vec3d ray = {(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1};
            const RayHit hit = bvh->raycast(T_world_camera.t, T_world_camera.R * ray, near_m);
            const float depth_m = raster->depth_m.view().at(u, v);
            const std::uint32_t triangle = raster->triangle.view().at(u, v);
            EXPECT_EQ(depth_m == 0, triangle == kNoTriangle);
            ++out.pixels;
            out.covered += hit.found;
            const bool same = hit.found ? std::fabs(depth_m - hit.t) <= 1e-4 * hit.t : depth_m == 0;
            out.different += !same;
        }
    for (const Vec3f& p : mesh.positions) out.behind += (T_world_camera.inverse() * to_double(p)).z < near_m;
    return out;
}

}  // namespace

TEST(Rasterise, DepthIsThatOfRays) {
    Random random(21);
    Jobs jobs(2);
    Agreement sum;
    for (int i = 0; i < 12; ++i) {
        // The camera stands among the triangles: many reach through the near plane or lie behind.
        const TriangleMesh mesh = make_soup(random, 300, 1.5, i % 2 ? 0.15 : 0.8);
        const Camera camera = make_camera(97 + i, 61 + 2 * i, random.between(30, 150));
        const Agreement a = compare(mesh, camera, any_pose(random, 0.5), i % 3 ? 0.01 : 0.3, jobs);
        sum.pixels += a.pixels;
        sum.covered += a.covered;
        sum.different += a.different;
        sum.behind += a.behind;
    }
    EXPECT_GT(sum.covered, sum.pixels / 4);
    EXPECT_GT(sum.behind, 1000);
    // Only rays that graze an edge within rounding may differ.
    EXPECT_LE(sum.different, sum.pixels / 10'000) << sum.different << " of " << sum.pixels;
}

TEST(Rasterise, AClosedSurfaceHasNoGapsFromInside) {
    Random random(22);
    Jobs jobs(3);
    const TriangleMesh mesh = make_sphere(1, 5);
    for (int i = 0; i < 6; ++i) {
        const Camera camera = make_camera(160, 120, 60);
        const auto raster = rasterise(mesh, camera, any_pose(random, 0.55), 0.01, false, jobs);
        ASSERT_TRUE(raster.ok());
        EXPECT_EQ(std::count(raster->depth_m.pixels.begin(), raster->depth_m.pixels.end(), 0.0f), 0);
        const auto culled = rasterise(mesh, camera, any_pose(random, 0.55), 0.01, true, jobs);
        ASSERT_TRUE(culled.ok());  // from inside only back faces are seen
        EXPECT_EQ(std::count(culled->depth_m.pixels.begin(), culled->depth_m.pixels.end(), 0.0f), 160 * 120);
    }
}

TEST(Rasterise, PixelsThroughVerticesAreCovered) {
    // Every vertex of a 16 x 16 grid falls exactly on a pixel centre.
    const TriangleMesh mesh = make_rectangle(16, 16, 0, 16);
    Camera camera;
    camera.width = camera.height = 17;
    camera.fx = camera.fy = 16;
    camera.cx = camera.cy = 8;
    Se3 T_world_camera;
    T_world_camera.R = {{1, 0, 0, 0, -1, 0, 0, 0, -1}};  // looks down
    T_world_camera.t = {8, 8, 16};
    Jobs jobs(1);
    const auto raster = rasterise(mesh, camera, T_world_camera, 0.01, true, jobs);
    ASSERT_TRUE(raster.ok());
    for (const float z : raster->depth_m.pixels) EXPECT_EQ(z, 16.0f);
}

TEST(Rasterise, SameImageForAnyNumberOfThreads) {
    Random random(23);
    TriangleMesh mesh = make_soup(random, 3000, 1, 0.2);
    mesh.triangles.insert(mesh.triangles.end(), mesh.triangles.begin(),
                          mesh.triangles.end());  // equal depths
    const Camera camera = make_camera(320, 240, 200);
    Se3 T_world_camera;
    T_world_camera.t = {0, 0, -2};
    Jobs one(1), four(4);
    const auto a = rasterise(mesh, camera, T_world_camera, 0.01, false, one);
    const auto b = rasterise(mesh, camera, T_world_camera, 0.01, false, four);
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(a->depth_m.pixels, b->depth_m.pixels);
    EXPECT_EQ(a->triangle.pixels, b->triangle.pixels);
    for (const std::uint32_t t : a->triangle.pixels)
        EXPECT_TRUE(t == kNoTriangle || t < 3000);  // the first of equals
}

namespace {

// A square of 2 m that fills the view of a camera 1 m above it.
struct Scene {
    TriangleMesh mesh = make_rectangle(2, 2, 0, 2);
    Camera camera;
    Se3 T_world_camera;
    Scene() {
        camera.width = 40;
        camera.height = 30;
        camera.fx = camera.fy = 40;
        camera.cx = 19.5;
        camera.cy = 14.5;
        T_world_camera.R = {{1, 0, 0, 0, -1, 0, 0, 0, -1}};
        T_world_camera.t = {1, 1, 1};
    }
    Image<std::uint8_t> render(RenderOptions options) const {
        Jobs jobs(2);
        auto image = render_mesh(mesh, camera, T_world_camera, options, jobs);
        EXPECT_TRUE(image.ok()) << image.status().text();
        return image.ok() ? *image : Image<std::uint8_t>();
    }
};

std::array<int, 3> pixel(const Image<std::uint8_t>& image, int x, int y) {
    const auto view = image.view();
    return {view.at(x, y, 0), view.at(x, y, 1), view.at(x, y, 2)};
}

}  // namespace

TEST(Render, ModesPaintWhatTheySay) {
    Scene scene;
    RenderOptions options;
    options.mode = RenderMode::normals;
    auto image = scene.render(options);
    ASSERT_EQ(image.width, 40);
    ASSERT_EQ(image.channels, 3);
    EXPECT_EQ(pixel(image, 20, 15), (std::array<int, 3>{128, 128, 255}));  // up

    options.mode = RenderMode::shaded;
    image = scene.render(options);
    const auto middle = pixel(image, 20, 15), border = pixel(image, 0, 0);
    EXPECT_EQ(middle[0], middle[1]);
    EXPECT_NEAR(middle[0], 205, 1);  // faces the light
    // The corner pixel's ray leans by atan(|(19.5, 14.5)| / 40).
    const double lean = 1 / std::sqrt(1 + (19.5 * 19.5 + 14.5 * 14.5) / 1600);
    EXPECT_NEAR(border[0], 205 * (0.25 + 0.75 * lean), 1.5);

    options.mode = RenderMode::colour;
    for (const Vec3f& p :
         scene.mesh.positions)  // linear in x and y: perspective-correct means linear in the image here
        scene.mesh.colours.push_back(
            {static_cast<std::uint8_t>(100 * p.x), static_cast<std::uint8_t>(100 * p.y), 7});
    image = scene.render(options);
    for (int y = 0; y < 30; y += 7)
        for (int x = 0; x < 40; x += 7) {
            const auto c = pixel(image, x, y);
            EXPECT_NEAR(c[0], 100 * (1 + (x - 19.5) / 40), 1);
            EXPECT_NEAR(c[1], 100 * (1 - (y - 14.5) / 40), 1);
            EXPECT_EQ(c[2], 7);
        }
    options.mode = RenderMode::depth;
    options.min_depth_m = 0.5;
    options.max_depth_m = 1.5;
    image = scene.render(options);
    EXPECT_EQ(pixel(image, 3, 3), (std::array<int, 3>{140, 140, 140}));  // halfway from 245 to 35
}

TEST(Render, ColoursArePerspectiveCorrect) {
    // A floor seen at a flat angle: colour runs evenly over the floor, not over the image.
    Scene scene;
    scene.mesh = make_rectangle(2, 100, 0, 1);
    for (const Vec3f& p : scene.mesh.positions)
        scene.mesh.colours.push_back({static_cast<std::uint8_t>(2 * p.y), 0, 0});
    scene.T_world_camera.R = {{1, 0, 0, 0, 0, 1, 0, -1, 0}};  // looks along y, level
    scene.T_world_camera.t = {1, 0, 1};
    RenderOptions options;
    options.mode = RenderMode::colour;
    options.supersample = 1;
    const auto image = scene.render(options);
    for (int y = 16; y < 30; ++y) {
        const double distance = 40 / (y - 14.5);
        EXPECT_NEAR(pixel(image, 20, y)[0], 2 * distance, 1) << y;
    }
    EXPECT_EQ(pixel(image, 20, 5), (std::array<int, 3>{255, 255, 255}));  // above the horizon: background
}

TEST(Render, BackFacesAreBlueOrCulled) {
    Scene scene;
    flip(&scene.mesh);
    RenderOptions options;
    for (const RenderMode mode :
         {RenderMode::shaded, RenderMode::shaded_colour, RenderMode::colour, RenderMode::normals}) {
        options.mode = mode;
        const auto c = pixel(scene.render(options), 20, 15);
        EXPECT_GT(c[2], c[0] + 80);
    }
    options.cull_back_faces = true;
    options.background = {1, 2, 3};
    EXPECT_EQ(pixel(scene.render(options), 20, 15), (std::array<int, 3>{1, 2, 3}));
}

TEST(Render, SupersamplingBlendsBorders) {
    Scene scene;
    scene.mesh = make_rectangle(1, 2, 0, 1);   // its border runs through the middle of the image
    scene.T_world_camera.t.x = 1 + 0.25 / 40;  // a quarter pixel off
    RenderOptions options;
    options.mode = RenderMode::normals;
    options.supersample = 4;
    const auto image = scene.render(options);
    // The border is at u = 19.5 - 0.25: column 19 reaches from 18.5 to 19.5, three quarters of it are
    // surface.
    EXPECT_EQ(pixel(image, 18, 15)[0], 128);
    EXPECT_EQ(pixel(image, 20, 15)[0], 255);
    EXPECT_NEAR(pixel(image, 19, 15)[0], 0.75 * 127.5 + 0.25 * 255, 1);
}

TEST(Render, BadInputIsNamed) {
    Scene scene;
    Jobs jobs(1);
    const auto says = [&](const RenderOptions& options, const char* part) {
        const auto image = render_mesh(scene.mesh, scene.camera, scene.T_world_camera, options, jobs);
        ASSERT_FALSE(image.ok());
        EXPECT_NE(std::strstr(image.status().text(), part), nullptr) << image.status().text();
    };
    RenderOptions options;
    options.supersample = 0;
    says(options, "supersampling is 0");
    options = {};
    options.near_m = 0;
    says(options, "near plane is at 0 m");
    options = {};
    options.min_depth_m = 2;
    options.max_depth_m = 1;
    says(options, "depth range is 2 to 1 m");
    scene.camera.k1 = 0.1;
    says({}, "distortion");
    scene.camera.k1 = 0;
    scene.camera.width = 0;
    says({}, "image size is 0x30");
    scene.camera.width = 40;
    scene.mesh.triangles[1][1] = 99;
    says({}, "triangle 1 uses vertex 99");
}

namespace {

// Where the corners of the bounding box come to lie in the image: the smallest and largest of x and y, 0..1.
struct Filled {
    double x0 = 1e9, x1 = -1e9, y0 = 1e9, y1 = -1e9;
};
Filled filled(const TriangleMesh& mesh, const Viewpoint& view) {
    Filled f;
    for (const Vec3f& point : mesh.positions) {
        const Vec3d p = view.T_world_camera.inverse() * to_double(point);
        EXPECT_GT(p.z, 0);
        const Pixel q = project(view.camera, p);
        f.x0 = std::min(f.x0, (q.u + 0.5) / view.camera.width);
        f.x1 = std::max(f.x1, (q.u + 0.5) / view.camera.width);
        f.y0 = std::min(f.y0, (q.v + 0.5) / view.camera.height);
        f.y1 = std::max(f.y1, (q.v + 0.5) / view.camera.height);
    }
    return f;
}

// A closed box, facing outwards or (a room) inwards.
TriangleMesh make_box(Vec3d size, bool inwards) {
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i)
        mesh.positions.push_back(to_float({i & 1 ? size.x : 0, i & 2 ? size.y : 0, i & 4 ? size.z : 0}));
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    if (inwards) flip(&mesh);
    return mesh;
}

}  // namespace

TEST(ViewFor, ShowsTheWholeFromAboveAndFillsTheImage) {
    for (const Vec3d up : {Vec3d{0, 0, 1}, Vec3d{0, -1, 0}, Vec3d{0.3, 0.2, 0.8}}) {
        for (const Vec3d size : {Vec3d{4, 3, 2.5}, Vec3d{0.1, 20, 0.3}, Vec3d{1, 1, 1}}) {
            const TriangleMesh mesh = make_box(size, false);
            const auto view = view_for(mesh, 640, 480, up);
            ASSERT_TRUE(view.ok()) << view.status().text();
            EXPECT_FALSE(view->cull_back_faces);
            const Vec3d forward = view->T_world_camera.R.column(2);
            EXPECT_NEAR(-dot(forward, normalised(up)), std::sin(35 * 3.14159265 / 180), 1e-6);  // looks down
            EXPECT_LT(std::fabs(dot(view->T_world_camera.R.column(0), up)), 1e-9);              // level
            EXPECT_NEAR(view->T_world_camera.R.determinant(), 1, 1e-9);
            const Filled f = filled(mesh, *view);
            EXPECT_GE(std::min(f.x0, f.y0), 0.0);
            EXPECT_LE(std::max(f.x1, f.y1), 1.0);
            EXPECT_TRUE(up.z != 1 || std::max(f.x1 - f.x0, f.y1 - f.y0) > 0.85);
        }
    }
}

TEST(ViewFor, LooksIntoRooms) {
    Jobs jobs(2);
    const TriangleMesh room = make_box({5, 4, 2.5}, true);
    const auto view = view_for(room, 320, 240);
    ASSERT_TRUE(view.ok());
    EXPECT_TRUE(view->cull_back_faces);
    // The floor (triangles 0 and 1) is seen through the culled ceiling and walls.
    const auto raster = rasterise(room, view->camera, view->T_world_camera, kDefaultNear_m, true, jobs);
    ASSERT_TRUE(raster.ok());
    const auto floor = std::count_if(raster->triangle.pixels.begin(), raster->triangle.pixels.end(),
                                     [](std::uint32_t t) { return t < 2; });
    EXPECT_GT(floor, 320 * 240 / 10);
}

TEST(ViewFor, LooksAtTheSideThatWasScanned) {
    // One wall facing -y, as a camera at negative y saw it, in front of the floor.
    TriangleMesh wall = make_rectangle(3, 2.5, 0, 10);
    for (Vec3f& p : wall.positions) p = {p.x, 0, p.y};  // (x, y, 0) -> (x, 0, y): faces -y
    const auto view = view_for(wall, 320, 240);
    ASSERT_TRUE(view.ok());
    EXPECT_LT(view->T_world_camera.t.y, -1);
}

TEST(ViewFor, AStraySpeckDoesNotShrinkThePicture) {
    TriangleMesh mesh = make_sphere(1, 5);
    const auto alone = view_for(mesh, 320, 240);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.normals.clear();
    mesh.positions.insert(mesh.positions.end(), {{500, 0, 0}, {500, 0.01f, 0}, {500, 0, 0.01f}});
    mesh.triangles.push_back({first, first + 1, first + 2});
    const auto with = view_for(mesh, 320, 240);
    ASSERT_TRUE(alone.ok() && with.ok());
    EXPECT_LT(norm(alone->T_world_camera.t - with->T_world_camera.t), 0.1);
    EXPECT_FALSE(view_for({}, 320, 240).ok());
    EXPECT_FALSE(view_for(mesh, 320, 240, {0, 0, 0}).ok());
    EXPECT_FALSE(view_for(mesh, 0, 240).ok());
}
