// SPDX-License-Identifier: MIT
#include "datasets/synthetic/truth_planes.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/triangle_mesh.h"
#include "datasets/synthetic/portable_math.h"

namespace burin {
namespace {

using Patch = PlanePatch;
using synthetic::Part;
using synthetic::Shape;

// The planar faces of a part in the order of face_of.
std::vector<Patch> patches_of(const Part& part) {
    std::vector<Patch> out;
    const Vec3d axis[3] = {part.to_scene_direction({1, 0, 0}), part.to_scene_direction({0, 1, 0}),
                           part.to_scene_direction({0, 0, 1})};
    if (part.blend >= 0) return out;
    if (part.shape == Shape::half_space) {
        out.push_back({part.position, axis[0], axis[1], axis[2], part.size.x, part.size.y, false});
    } else if (part.shape == Shape::box) {
        for (int i = 0; i < 3; ++i)
            for (double s : {1.0, -1.0}) {
                const int j = (i + 1) % 3, k = (i + 2) % 3;
                out.push_back({part.position + axis[i] * (s * part.size[i]), axis[j], axis[k] * s,
                               axis[i] * s, part.size[j] - part.round, part.size[k] - part.round, false});
            }
    } else if (part.shape == Shape::cylinder || part.shape == Shape::frustum) {
        for (double s : {1.0, -1.0}) {
            const double r = part.shape == Shape::cylinder ? part.size.x - part.round
                             : s > 0                       ? part.size.y
                                                           : part.size.x;
            out.push_back(
                {part.position + axis[2] * (s * part.size.z), axis[0], axis[1] * s, axis[2] * s, r, r, true});
        }
    }
    return out;
}

std::vector<Vec3d> corners_of(const Patch& patch) {
    std::vector<Vec3d> out;
    const int count = patch.round ? 32 : 4;
    for (int i = 0; i < count; ++i) {
        const double a = 2 * synthetic::kPi * (i + 0.5) / count;
        const double stretch = patch.round ? 1 : std::sqrt(2.0);
        out.push_back(patch.centre + patch.u * (stretch * patch.half_u * synthetic::cosine(a)) +
                      patch.v * (stretch * patch.half_v * synthetic::sine(a)));
    }
    return out;
}

// Andrew's monotone chain in the (u, v) coordinates of the plane; counter-clockwise.
std::vector<Vec3d> convex_hull(std::vector<Vec3d> points, Vec3d u, Vec3d v) {
    const auto less = [&](Vec3d a, Vec3d b) {
        const double au = dot(a, u), bu = dot(b, u);
        return std::fabs(au - bu) > 1e-9 ? au < bu : dot(a, v) < dot(b, v);
    };
    std::sort(points.begin(), points.end(), less);
    const auto turn = [&](Vec3d o, Vec3d a, Vec3d b) {
        return dot(a - o, u) * dot(b - o, v) - dot(a - o, v) * dot(b - o, u);
    };
    std::vector<Vec3d> hull;
    for (int pass = 0; pass < 2; ++pass) {
        const std::size_t base = hull.size();
        for (const Vec3d& p : points) {
            while (hull.size() >= base + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 1e-12)
                hull.pop_back();
            hull.push_back(p);
        }
        hull.pop_back();
        std::reverse(points.begin(), points.end());
    }
    return hull;
}

}  // namespace

PlaneSurvey::PlaneSurvey(const SyntheticScene& scene) : scene_(scene) {
    // Faces this far from being coplanar are different planes (metres; the layout is exact to 1e-12).
    constexpr double kSamePlane = 1e-7;
    for (const Part& part : scene.data().parts) {
        const std::vector<Patch> patches = patches_of(part);
        first_face_.push_back(patches.empty() ? -1 : static_cast<int>(face_of_.size()));
        for (const Patch& patch : patches) {
            const double offset = -dot(patch.normal, patch.centre);
            auto face = std::find_if(faces_.begin(), faces_.end(), [&](const Face& f) {
                return f.plane.instance == part.instance && f.plane.label == part.label &&
                       norm(f.plane.normal - patch.normal) < kSamePlane &&
                       std::fabs(f.plane.offset - offset) < kSamePlane;
            });
            if (face == faces_.end()) {
                faces_.push_back({});
                face = faces_.end() - 1;
                face->plane.label = part.label;
                face->plane.instance = part.instance;
                face->plane.normal = patch.normal;
                face->plane.offset = offset;
                face->u = patch.u;
                face->v = cross(patch.normal, patch.u);
            }
            face_of_.push_back(static_cast<int>(face - faces_.begin()));
            face->patches.push_back(patch);
        }
    }
    for (Face& face : faces_) {
        double whole = 0;
        for (const Patch& patch : face.patches) whole += 4 * patch.half_u * patch.half_v;
        if (whole < scene.data().min_plane_area) continue;  // too small even when all of it lies open
        for (const Patch& patch : face.patches) sample_patch(patch, &face);
    }
    for (Face& face : faces_) {
        std::vector<Vec3d> corners;
        for (const Patch& patch : face.patches)
            for (const Vec3d& corner : corners_of(patch)) corners.push_back(corner);
        for (const Sample& sample : face.samples) face.plane.area_m2 += sample.area;
        face.plane.polygon = convex_hull(std::move(corners), face.u, face.v);
    }
}

void PlaneSurvey::sample_patch(const PlanePatch& patch, Face* face) const {
    // About 4000 samples on a face of 1 m^2; at least 20 along each side.
    constexpr double kSampleSpacing = 0.016;
    const int columns = std::max(20, static_cast<int>(2 * patch.half_u / kSampleSpacing));
    const int rows = std::max(20, static_cast<int>(2 * patch.half_v / kSampleSpacing));
    const auto area =
        static_cast<float>(4 * patch.half_u * patch.half_v / (static_cast<double>(columns) * rows));
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            const double a = (2 * i + 1.0) / columns - 1, b = (2 * j + 1.0) / rows - 1;
            if (patch.round && a * a + b * b > 1) continue;
            const Vec3d p = patch.centre + patch.u * (a * patch.half_u) + patch.v * (b * patch.half_v);
            // Open when a point just above is as far from everything as from this face.
            constexpr double kLift = 1e-4;
            if (scene_.distance(p + patch.normal * kLift) > 0.9 * kLift)
                face->samples.push_back({p, area, false});
        }
}

void PlaneSurvey::add_frame(const TruthImages& images, const Camera& camera, const Se3& T_scene_camera,
                            double max_depth, Jobs& jobs) {
    const int w = images.depth_m.width, h = images.depth_m.height;
    const auto face_at = [&](std::size_t i) {
        if (images.face.pixels[i] < 0 || images.part.pixels[i] < 0) return -1;
        const int first = first_face_[static_cast<std::size_t>(images.part.pixels[i])];
        return first < 0 ? -1 : face_of_[static_cast<std::size_t>(first + images.face.pixels[i])];
    };
    for (std::size_t i = 0; i < images.depth_m.pixels.size(); ++i)
        if (const int face = face_at(i); face >= 0 && images.depth_m.pixels[i] <= max_depth)
            ++faces_[static_cast<std::size_t>(face)].plane.support;
    const Se3 T_camera_scene = T_scene_camera.inverse();
    jobs.run(static_cast<int>(faces_.size()), [&](int index, int) {
        Face& face = faces_[static_cast<std::size_t>(index)];
        if (dot(face.plane.normal, T_scene_camera.t) + face.plane.offset <= 0) return;  // seen from behind
        for (Sample& sample : face.samples) {
            if (sample.seen) continue;
            const Vec3d p = T_camera_scene * sample.position;
            if (!(p.z > 0.01 && p.z <= max_depth)) continue;
            const Pixel pixel = project(camera, p);
            const int x = static_cast<int>(std::floor(pixel.u + 0.5)),
                      y = static_cast<int>(std::floor(pixel.v + 0.5));
            if (x < 0 || y < 0 || x >= w || y >= h) continue;
            sample.seen = face_at(static_cast<std::size_t>(y) * w + x) == index;
        }
    });
}

std::vector<TruthPlane> PlaneSurvey::planes() const {
    std::vector<TruthPlane> out;
    for (const Face& face : faces_) {
        if (face.plane.area_m2 < scene_.data().min_plane_area) continue;
        out.push_back(face.plane);
        for (const Sample& sample : face.samples)
            if (sample.seen) out.back().seen_area_m2 += sample.area;
    }
    std::stable_sort(out.begin(), out.end(),
                     [](const TruthPlane& a, const TruthPlane& b) { return a.area_m2 > b.area_m2; });
    for (std::size_t i = 0; i < out.size(); ++i) out[i].id = static_cast<int>(i);
    return out;
}

std::string planes_json(const std::vector<TruthPlane>& planes) {
    const auto vector = [](Vec3d v) { return nlohmann::ordered_json::array({v.x, v.y, v.z}); };
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const TruthPlane& plane : planes) {
        nlohmann::ordered_json polygon = nlohmann::ordered_json::array();
        for (const Vec3d& p : plane.polygon) polygon.push_back(vector(p));
        nlohmann::ordered_json zero = nlohmann::ordered_json::array();
        for (int i = 0; i < 4; ++i) zero.push_back(nlohmann::ordered_json::array({0.0, 0.0, 0.0, 0.0}));
        list.push_back({{"id", plane.id},
                        {"label", label_name(plane.label)},
                        {"normal", vector(plane.normal)},
                        {"offset", plane.offset},
                        {"area_m2", plane.area_m2},
                        {"seen_area_m2", plane.seen_area_m2},
                        {"polygon", polygon},
                        {"covariance", zero},
                        {"support", plane.support}});
    }
    return list.dump(1) + "\n";
}

}  // namespace burin
