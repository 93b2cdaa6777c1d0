// SPDX-License-Identifier: MIT
#include "planes/classify.h"

namespace burin {
namespace {

// Further than 45 degrees from the cameras' up a wall would be as near as the floor.
constexpr double kNearUp = 0.7071;  // cos 45 degrees
// Floors, ceilings and walls meet at right angles to well within 5 degrees; roofs and ramps do not.
constexpr double kAgree = 0.9962;   // cos 5 degrees
constexpr double kSquare = 0.0872;  // sin 5 degrees
// Squaring a matrix 10 times is 1024 steps of the power method: eigenvalues 2 % apart are told to 1e-9.
constexpr int kSquarings = 10;

}  // namespace

Vec3d estimate_up(const PlaneShape* planes, int count, Vec3d mean_camera_up) {
    const Vec3d camera_up = normalised(mean_camera_up);
    Vec3d up = camera_up;
    double best = 0;
    for (int i = 0; i < count; ++i) {
        const double lean = dot(planes[i].normal, camera_up);
        if (!(std::fabs(lean) >= kNearUp)) continue;
        double agree = 0;  // m^2
        for (int k = 0; k < count; ++k) {
            const double c = std::fabs(dot(planes[k].normal, planes[i].normal));
            if (c >= kAgree || c <= kSquare) agree += planes[k].area_m2;
        }
        // In a room of right angles all three axes agree with the same area: the cameras decide.
        if (const double score = agree * std::fabs(lean); score > best) {
            best = score;
            up = lean > 0 ? planes[i].normal : -planes[i].normal;
        }
    }
    if (!(best > 0)) return up;

    // The unit g that maximises sum area (n.g)^2 over level planes minus the same over upright ones: the
    // first eigenvector of that matrix, shifted by the upright area so that no eigenvalue is negative.
    Mat3d m{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
    double upright = 0;
    for (int k = 0; k < count; ++k) {
        const Vec3d n = planes[k].normal;
        const double c = std::fabs(dot(n, up));
        if (!(c >= kAgree || c <= kSquare)) continue;
        const double area = c <= kSquare ? -planes[k].area_m2 : planes[k].area_m2;
        if (area < 0) upright -= area;
        for (int r = 0; r < 3; ++r)
            for (int s = 0; s < 3; ++s) m(r, s) += area * n[r] * n[s];
    }
    for (int r = 0; r < 3; ++r) m(r, r) += upright;
    for (int i = 0; i < kSquarings; ++i) {
        const double trace = m(0, 0) + m(1, 1) + m(2, 2);
        if (!(trace > 0)) return up;
        for (double& v : m.m) v /= trace;
        m = m * m;
    }
    int longest = 0;
    for (int c = 1; c < 3; ++c)
        if (dot(m.column(c), m.column(c)) > dot(m.column(longest), m.column(longest))) longest = c;
    const Vec3d g = normalised(m.column(longest));
    if (!(dot(g, g) > 0.5)) return up;
    return dot(g, camera_up) < 0 ? -g : g;
}

}  // namespace burin
