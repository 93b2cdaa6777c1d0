// SPDX-License-Identifier: MIT
// A scene whose geometry is known exactly: the union of analytic solids. It answers the questions of a
// renderer (what does this ray hit) and of an evaluation (how far is this point from the surface).
//
// Scene frame: right-handed, metres, z up, the floor at z = 0 (for `relief` and `figure`: what the object
// stands on).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/se3.h"
#include "core/status.h"
#include "datasets/synthetic/material.h"
#include "datasets/synthetic/shape.h"

namespace burin {

struct Box3d {
    Vec3d low, high;
    bool contains(Vec3d p) const {
        return p.x >= low.x && p.y >= low.y && p.z >= low.z && p.x <= high.x && p.y <= high.y &&
               p.z <= high.z;
    }
};

namespace synthetic {

// Irradiance colour * cos / (1 + (distance / reach)^2): bounded near the lamp, inverse square far from it.
struct PointLight {
    Vec3d position;
    Vec3f colour;
    double reach = 1;  // metres
};

// Light from everywhere, told by the normal's height, rising and falling over the scene (value noise).
struct Ambient {
    Vec3f from_above, from_below;
    double variation = 0.3;   // relative, 0..1
    double wavelength = 1.5;  // metres
    std::uint32_t seed = 0;
};

// Parts of one blend melt into each other by a polynomial smooth minimum of width k (Quilez 2013): its
// gradient is a convex combination of theirs, so the value stays a lower bound of the distance.
struct Blend {
    double k = 0.03;  // metres
};

// What a scene file of this room fills in.
struct SceneData {
    std::string name;
    std::uint64_t seed = 0;
    std::vector<Part> parts;
    std::vector<Blend> blends;
    std::vector<Material> materials;
    std::vector<std::unique_ptr<ReliefSurface>> reliefs;
    std::vector<PointLight> lights;
    Ambient ambient;
    double exposure = 1;                // multiplies radiance before the sRGB curve
    double occlusion_reach = 0.2;       // metres; ambient light fades in corners narrower than this
    Vec3f backdrop{0.3f, 0.3f, 0.32f};  // linear colour where no surface is hit
    Box3d bounds;                       // encloses all finite parts and all camera positions
    Box3d mesh_bounds;                  // where the truth mesh is made and surface points are sampled
    double mesh_resolution = 0.01;      // metres, of truth/mesh.ply
    double min_plane_area = 0.04;       // m^2; smaller planar faces are not listed in planes.json
    double cell = 0.15;                 // metres, of the acceleration grid
};

}  // namespace synthetic

class SyntheticScene {
  public:
    // Takes the scene apart into cells. Errors: no parts, or more than 65535.
    static Result<std::unique_ptr<SyntheticScene>> create(synthetic::SceneData data);

    // Signed distance to the union, negative inside: 1-Lipschitz everywhere. Outside all solids it is the
    // Euclidean distance, but near blends and reliefs, where it is a lower bound; inside it is a bound of the
    // depth.
    double distance(Vec3d p) const;
    // Euclidean distance also beside blends and reliefs, with its nearest point: Newton steps onto the
    // surface and along it. Meant for points within a few centimetres of the surface.
    double surface_distance(Vec3d p, Vec3d* nearest = nullptr) const;
    Vec3d normal(Vec3d p) const;  // unit gradient of distance()

    // Of the part whose surface is nearest to p.
    std::uint8_t label(Vec3d p) const;
    int instance(Vec3d p) const;
    Vec3f albedo(Vec3d p) const;  // linear reflectance, all detail

    // The first surface along a ray. direction has unit length; distances in metres from the origin, which
    // lies outside all solids. Exact to 1e-8 m where the surface is crossed at more than a grazing angle.
    struct Hit {
        double distance = 0;  // metres along the ray; infinity when nothing was hit
        int part = -1;        // the one nearest to the hit point
    };
    Hit trace(Vec3d origin, Vec3d direction, double max_distance) const;
    // At a hit: outward unit normal in the scene frame, gradient of the hit part or its blend.
    Vec3d normal_at(Vec3d p, int part) const;
    Vec3f albedo_at(Vec3d p, Vec3d n, int part, double footprint) const;

    const synthetic::SceneData& data() const { return data_; }
    const synthetic::Part& part(int index) const { return data_.parts[static_cast<std::size_t>(index)]; }

  private:
    explicit SyntheticScene(synthetic::SceneData data) : data_(std::move(data)) {}
    using Items = std::vector<std::uint16_t>;  // part numbers; parts of one blend stand together
    struct Range {
        const std::uint16_t* begin;
        const std::uint16_t* end;
    };
    struct Nearest {
        double distance;
        int part;        // nearest by its own distance
        Vec3d gradient;  // scene frame; of the union
    };

    void build_grid();
    Range near_items(Vec3d p) const;
    double fold(Range items, Vec3d p) const;
    Nearest nearest(Vec3d p) const;
    Nearest nearest(Range items, Vec3d p) const;
    Vec3d foot_point(Range group, Vec3d p) const;
    double trace_convex(const synthetic::Part& part, Vec3d origin, Vec3d direction, double t0,
                        double t1) const;
    double trace_field(Range items, Vec3d origin, Vec3d direction, double t0, double t1) const;

    synthetic::SceneData data_;
    // A uniform grid over bounds. Of every cell: the parts that can be nearest to a point of it (near_) and
    // those whose surface can pass through it (crossing_).
    int size_[3] = {0, 0, 0};
    std::vector<std::uint32_t> near_begin_, crossing_begin_;
    Items near_, crossing_;
    Items half_spaces_, all_;  // half spaces are intersected once a ray, not cell by cell
};

// The scenes: room, desk, corridor, relief, figure.
std::vector<std::string> scene_names();
// Error (invalid_argument): no such scene; the text lists them.
Result<std::unique_ptr<SyntheticScene>> make_scene(const std::string& name, std::uint64_t seed);

}  // namespace burin
