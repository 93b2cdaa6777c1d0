// SPDX-License-Identifier: MIT
#include "datasets/synthetic/shape.h"

#include <algorithm>

namespace burin::synthetic {
namespace {

struct Flat {  // a distance in the (radius, z) half plane with its gradient
    double distance, r, z;
};

// Axis-aligned rectangle |x| <= a, |z| <= b.
Flat rectangle(double x, double z, double a, double b) {
    const double qx = std::fabs(x) - a, qz = std::fabs(z) - b;
    const double sx = x < 0 ? -1 : 1, sz = z < 0 ? -1 : 1;
    if (qx <= 0 || qz <= 0) return qx > qz ? Flat{qx, sx, 0} : Flat{qz, 0, sz};
    const double d = std::sqrt(qx * qx + qz * qz);
    return {d, sx * qx / d, sz * qz / d};
}

// Trapezium with corners (r0, -h) and (r1, +h), mirrored at r = 0: a frustum's cross section.
Flat trapezium(double r, double z, double r0, double r1, double h) {
    const double length = std::sqrt((r1 - r0) * (r1 - r0) + 4 * h * h);
    const double ur = (r1 - r0) / length, uz = 2 * h / length;  // along the slanted side, upwards
    const double along = (r - r0) * ur + (z + h) * uz;
    const double side = (r - r0) * uz - (z + h) * ur;  // signed, positive outside
    const double cap = std::fabs(z) - h, sz = z < 0 ? -1 : 1;
    if (side <= 0 && cap <= 0) return side > cap ? Flat{side, uz, -ur} : Flat{cap, 0, sz};
    const double rim = z < 0 ? r0 : r1;
    if (cap >= 0 && r <= rim) return {cap, 0, sz};
    if (along >= 0 && along <= length && side > 0) return {side, uz, -ur};
    const double corner_r = along > 0.5 * length ? r1 : r0, corner_z = along > 0.5 * length ? h : -h;
    const double dr = r - corner_r, dz = z - corner_z, d = std::sqrt(dr * dr + dz * dz);
    return d > 0 ? Flat{d, dr / d, dz / d} : Flat{0, uz, -ur};
}

// Hull of two circles (radius r0 at z = -h, r1 at z = +h), r >= 0.
Flat round_cone(double r, double z, double r0, double r1, double h) {
    const double slope = (r0 - r1) / (2 * h);  // sine of the half opening angle
    const auto ball = [&](double centre_z, double radius) {
        const double dz = z - centre_z, n = std::sqrt(r * r + dz * dz);
        return n > 0 ? Flat{n - radius, r / n, dz / n} : Flat{-radius, 0, 1};
    };
    if (std::fabs(slope) >= 1) return r0 > r1 ? ball(-h, r0) : ball(h, r1);  // one ball holds the other
    const double cosine = std::sqrt(1 - slope * slope);
    const double along = -r * slope + z * cosine;  // coordinate along the tangent line
    if (along <= -h * cosine) return ball(-h, r0);
    if (along >= h * cosine) return ball(h, r1);
    return {r * cosine + (z + h) * slope - r0, cosine, slope};
}

Flat polyline(double r, double z, const std::vector<ProfilePoint>& points, double thickness) {
    double best = 1e300, gr = 0, gz = 1;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        const double ar = points[i].r, az = points[i].z;
        const double br = points[i + 1].r - ar, bz = points[i + 1].z - az;
        const double t = std::clamp(((r - ar) * br + (z - az) * bz) / (br * br + bz * bz), 0.0, 1.0);
        const double dr = r - ar - t * br, dz = z - az - t * bz, d2 = dr * dr + dz * dz;
        if (d2 < best) best = d2, gr = dr, gz = dz;
    }
    const double d = std::sqrt(best);
    return d > 0 ? Flat{d - thickness, gr / d, gz / d} : Flat{-thickness, 0, 1};
}

double revolve(Vec3d p, double r, Flat flat, Vec3d* gradient) {
    if (gradient)
        *gradient = r > 0 ? Vec3d{p.x / r * flat.r, p.y / r * flat.r, flat.z} : Vec3d{flat.r, 0, flat.z};
    return flat.distance;
}

double box(Vec3d p, Vec3d half, double round, Vec3d* gradient) {
    const Vec3d s{p.x < 0 ? -1.0 : 1.0, p.y < 0 ? -1.0 : 1.0, p.z < 0 ? -1.0 : 1.0};
    const Vec3d q{std::fabs(p.x) - half.x + round, std::fabs(p.y) - half.y + round,
                  std::fabs(p.z) - half.z + round};
    const Vec3d o{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
    const double n = norm(o);
    if (n > 0) {
        if (gradient) *gradient = {s.x * o.x / n, s.y * o.y / n, s.z * o.z / n};
        return n - round;
    }
    const int axis = q.x >= q.y && q.x >= q.z ? 0 : q.y >= q.z ? 1 : 2;
    if (gradient) *gradient = {}, (*gradient)[axis] = s[axis];
    return q[axis] - round;
}

// The nearest surface point is x_i = e_i^2 y_i / (t + e_i^2) where t is the largest root of
// F(t) = sum (e_i y_i / (t + e_i^2))^2 - 1 (Eberly, "Distance from a Point to an Ellipsoid"). F is convex and
// falls right of -min e^2, so Newton's method from a point where F >= 0 rises to the root monotonically.
double ellipsoid(Vec3d p, Vec3d e, Vec3d* gradient) {
    constexpr double kOffAxis = 1e-9;  // metres; keeps the denominators positive on the symmetry planes
    Vec3d y, e2;
    double t = -1e300, level = 0;
    for (int i = 0; i < 3; ++i) {
        y[i] = std::max(std::fabs(p[i]), kOffAxis);
        e2[i] = e[i] * e[i];
        t = std::max(t, e[i] * y[i] - e2[i]);
        level += y[i] * y[i] / e2[i];
    }
    for (int round = 0; round < 60; ++round) {
        double f = -1, slope = 0;
        for (int i = 0; i < 3; ++i) {
            const double u = t + e2[i], w = e[i] * y[i] / u;
            f += w * w;
            slope -= 2 * w * w / u;
        }
        if (f <= 1e-14) break;
        t -= f / slope;
    }
    Vec3d x, n;
    for (int i = 0; i < 3; ++i) {
        x[i] = e2[i] * y[i] / (t + e2[i]);
        n[i] = (p[i] < 0 ? -1.0 : 1.0) * x[i] / e2[i];
    }
    if (gradient) *gradient = normalised(n);
    return level < 1 ? -norm(y - x) : norm(y - x);
}

double relief(const Part& part, Vec3d p, Vec3d* gradient) {
    Vec3d side;
    // The box reaches up to +size.z, above the highest relief; the height field cuts it off.
    const double column = box(p, part.size, 0, gradient ? &side : nullptr);
    double slope_x = 0, slope_y = 0;
    const double height = part.relief->height(p.x, p.y, &slope_x, &slope_y);
    const double scale = part.relief->distance_scale();
    const double field = (p.z - height) * scale;
    if (column > field) {
        if (gradient) *gradient = side;
        return column;
    }
    if (gradient) *gradient = {-slope_x * scale, -slope_y * scale, scale};
    return field;
}

}  // namespace

double part_distance(const Part& part, Vec3d p, Vec3d* gradient) {
    const Vec3d s = part.size;
    switch (part.shape) {
        case Shape::half_space:
            if (gradient) *gradient = {0, 0, 1};
            return p.z;
        case Shape::box:
            return box(p, s, part.round, gradient);
        case Shape::sphere: {
            const double n = norm(p);
            if (gradient) *gradient = n > 0 ? p * (1 / n) : Vec3d{0, 0, 1};
            return n - s.x;
        }
        case Shape::ellipsoid:
            return ellipsoid(p, s, gradient);
        case Shape::relief:
            return relief(part, p, gradient);
        default:
            break;
    }
    const double r = std::sqrt(p.x * p.x + p.y * p.y);
    switch (part.shape) {
        case Shape::cylinder: {
            Flat flat = rectangle(r, p.z, s.x - part.round, s.z - part.round);
            flat.distance -= part.round;
            return revolve(p, r, flat, gradient);
        }
        case Shape::frustum:
            return revolve(p, r, trapezium(r, p.z, s.x, s.y, s.z), gradient);
        case Shape::capsule:
            return revolve(p, r, round_cone(r, p.z, s.x, s.y, s.z), gradient);
        case Shape::torus: {
            const double dr = r - s.x, n = std::sqrt(dr * dr + p.z * p.z);
            return revolve(p, r, n > 0 ? Flat{n - s.y, dr / n, p.z / n} : Flat{-s.y, 0, 1}, gradient);
        }
        default:
            return revolve(p, r, polyline(r, p.z, part.profile, part.round), gradient);
    }
}

bool is_convex(Shape shape) {
    return shape != Shape::torus && shape != Shape::lathe && shape != Shape::relief;
}

int face_of(const Part& part, Vec3d p) {
    constexpr double kOnFace = 1e-6;  // metres; surface points from tracing lie within 1e-9
    if (part.shape == Shape::half_space) return 0;
    if (part.shape == Shape::box) {
        for (int axis = 0; axis < 3; ++axis)
            if (std::fabs(std::fabs(p[axis]) - part.size[axis]) < kOnFace) return 2 * axis + (p[axis] < 0);
        return -1;
    }
    if ((part.shape == Shape::cylinder || part.shape == Shape::frustum) &&
        std::fabs(std::fabs(p.z) - part.size.z) < kOnFace)
        return p.z < 0;
    return -1;
}

}  // namespace burin::synthetic
