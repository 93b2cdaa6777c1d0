// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <exception>
#include <vector>

#include "eval/render.h"

namespace burin {
namespace {

constexpr double kElevation = 35 * 3.14159265358979 / 180;  // floors and walls are both seen
constexpr double kTurn = 25 * 3.14159265358979 / 180;       // off the axis, so that corners read as corners
constexpr double kHalfWidthTan = 0.5;                       // 53 degrees across, like a phone
constexpr double kMargin = 0.95;                            // of the image is filled

struct Interval {
    double low = 0, high = 0;
    double middle() const { return 0.5 * (low + high); }
    double extent() const { return high - low; }
};

// The interval that holds all but the outermost 0.5 % of the vertices at either end.
Interval extent_along(const std::vector<Vec3f>& points, Vec3d axis) {
    // A million points place the quantile well enough.
    const std::size_t step = points.size() / 1'000'000 + 1;
    std::vector<double> values;
    for (std::size_t i = 0; i < points.size(); i += step) values.push_back(dot(to_double(points[i]), axis));
    const std::size_t outside = values.size() / 200;
    const auto low = values.begin() + static_cast<std::ptrdiff_t>(outside);
    const auto high = values.end() - 1 - static_cast<std::ptrdiff_t>(outside);
    std::nth_element(values.begin(), low, values.end());
    const double low_value = *low;
    std::nth_element(values.begin(), high, values.end());
    return {low_value, *high};
}

struct Facing {
    Vec3d area_normal;    // sum of area * normal, m2
    double outwards = 0;  // sum of area * cosine between the normal and the direction from the centre, m2
    double area = 0;      // m2
};

Facing facing_of(const TriangleMesh& mesh, Vec3d centre) {
    Facing sum;
    for (const auto& t : mesh.triangles) {
        const Vec3d a = to_double(mesh.positions[t[0]]), b = to_double(mesh.positions[t[1]]),
                    c = to_double(mesh.positions[t[2]]);
        const Vec3d n = cross(b - a, c - a) * 0.5;
        sum.area_normal = sum.area_normal + n;
        sum.outwards += dot(n, normalised((a + b + c) * (1.0 / 3) - centre));
        sum.area += norm(n);
    }
    return sum;
}

// Some of the vertices inside the intervals along the axes, enough to outline the mesh.
std::vector<Vec3d> outline(const TriangleMesh& mesh, const Vec3d (&axes)[3], const Interval (&intervals)[3]) {
    constexpr std::size_t kEnough = 50'000;
    std::vector<Vec3d> points;
    const std::size_t step = mesh.positions.size() / kEnough + 1;
    for (std::size_t i = 0; i < mesh.positions.size(); i += step) {
        const Vec3d p = to_double(mesh.positions[i]);
        bool inside = true;
        for (int k = 0; k < 3; ++k)
            inside = inside && dot(p, axes[k]) >= intervals[k].low && dot(p, axes[k]) <= intervals[k].high;
        if (inside) points.push_back(p);
    }
    // A handful of vertices may leave none inside all three: then the box itself.
    for (int corner = 0; points.size() < 8 && corner < 8; ++corner) {
        Vec3d p;
        for (int k = 0; k < 3; ++k)
            p = p + axes[k] * (corner >> k & 1 ? intervals[k].high : intervals[k].low);
        points.push_back(p);
    }
    return points;
}

// Moves the camera along its axes until the points fill the image, centred.
Vec3d fit(const Camera& camera, const Mat3d& R_world_camera, Vec3d centre, const std::vector<Vec3d>& points) {
    const double tan_x = kMargin * 0.5 * camera.width / camera.fx,
                 tan_y = kMargin * 0.5 * camera.height / camera.fy;
    const Mat3d R_camera_world = R_world_camera.transposed();
    Vec3d eye;                  // camera coordinates relative to the centre
    constexpr int kRounds = 4;  // each halves what is left of the off-centre shift several times over
    for (int round = 0; round < kRounds; ++round) {
        double distance = kDefaultNear_m;
        for (const Vec3d& point : points) {
            const Vec3d p = R_camera_world * (point - centre);
            distance = std::max({distance, std::fabs(p.x - eye.x) / tan_x - p.z,
                                 std::fabs(p.y - eye.y) / tan_y - p.z, 2 * kDefaultNear_m - p.z});
        }
        eye.z = -distance;
        if (round + 1 == kRounds) break;
        double x0 = HUGE_VAL, x1 = -HUGE_VAL, y0 = HUGE_VAL, y1 = -HUGE_VAL;
        for (const Vec3d& point : points) {
            const Vec3d p = R_camera_world * (point - centre) - eye;
            x0 = std::min(x0, p.x / p.z);
            x1 = std::max(x1, p.x / p.z);
            y0 = std::min(y0, p.y / p.z);
            y1 = std::max(y1, p.y / p.z);
        }
        eye.x += 0.5 * (x0 + x1) * distance;
        eye.y += 0.5 * (y0 + y1) * distance;
    }
    return centre + R_world_camera * eye;
}

}  // namespace

Result<Viewpoint> view_for(const TriangleMesh& mesh, int width, int height, Vec3d up) try {
    BURIN_TRY(check_mesh(mesh));
    if (mesh.triangles.empty())
        return Status::error(Code::invalid_argument, "the mesh has no triangles, expected a surface");
    const double up_length = norm(up);
    if (!(up_length > 0) || !std::isfinite(up_length))
        return Status::error(Code::invalid_argument, "up is (%g, %g, %g), expected a direction", up.x, up.y,
                             up.z);
    Viewpoint view;
    view.camera.width = width;
    view.camera.height = height;
    view.camera.fx = view.camera.fy = 0.5 * width / kHalfWidthTan;
    view.camera.cx = 0.5 * (width - 1);
    view.camera.cy = 0.5 * (height - 1);
    BURIN_TRY(check_camera(view.camera, "view"));

    up = normalised(up);
    // Two horizontal axes; the first from the world axis that is least upright.
    Vec3d across = std::fabs(up.x) <= std::fabs(up.y) && std::fabs(up.x) <= std::fabs(up.z) ? Vec3d{1, 0, 0}
                   : std::fabs(up.y) <= std::fabs(up.z)                                     ? Vec3d{0, 1, 0}
                                                                                            : Vec3d{0, 0, 1};
    across = normalised(across - up * dot(across, up));
    Vec3d along = cross(up, across);
    Interval side = extent_along(mesh.positions, across), depth = extent_along(mesh.positions, along);
    const Interval tall = extent_along(mesh.positions, up);
    if (depth.extent() > side.extent()) {  // the longer side across the image
        std::swap(side, depth);
        std::swap(across, along);
    }
    const Vec3d centre = across * side.middle() + along * depth.middle() + up * tall.middle();
    const Facing facing = facing_of(mesh, centre);
    // Of a room's area well over half faces the middle, of an object's little does; furniture is about even.
    constexpr double kInwards = -0.15;
    view.cull_back_faces = facing.outwards < kInwards * facing.area;

    Vec3d towards = -along;
    const Vec3d horizontal = facing.area_normal - up * dot(facing.area_normal, up);
    constexpr double kOneSided = 0.1;  // closed surfaces sum to zero, a scanned wall to its area
    if (norm(horizontal) > kOneSided * facing.area) towards = normalised(horizontal);
    towards = towards * std::cos(kTurn) + cross(up, towards) * std::sin(kTurn);
    towards = towards * std::cos(kElevation) + up * std::sin(kElevation);

    const Vec3d forward = -towards, right = normalised(cross(forward, up)), down = cross(forward, right);
    for (int r = 0; r < 3; ++r) {
        view.T_world_camera.R(r, 0) = right[r];
        view.T_world_camera.R(r, 1) = down[r];
        view.T_world_camera.R(r, 2) = forward[r];
    }
    const Vec3d axes[3] = {across, along, up};
    const Interval intervals[3] = {side, depth, tall};
    view.T_world_camera.t = fit(view.camera, view.T_world_camera.R, centre, outline(mesh, axes, intervals));
    return view;
} catch (const std::exception&) {
    return Status::error(Code::insufficient_memory, "no memory to place a camera for %zu vertices",
                         mesh.positions.size());
}

}  // namespace burin
