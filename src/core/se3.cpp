// SPDX-License-Identifier: MIT
#include "core/se3.h"

#include <algorithm>

namespace burin {

Se3 Se3::inverse() const {
    const Mat3d Rt = R.transposed();
    return {Rt, -(Rt * t)};
}

Se3 moved(const Se3& T, const Twist& xi) {
    const Mat3d dR = rotation_of(normalised(Quaternion{xi.w[0] / 2, xi.w[1] / 2, xi.w[2] / 2, 1}));
    return normalised(Se3{T.R * dR, T.t + T.R * Vec3d{xi.v[0], xi.v[1], xi.v[2]}});
}

Twist motion_between(const Se3& from, const Se3& to) {
    const Mat3d Rt = from.R.transposed();
    const Vec3d v = Rt * (to.t - from.t);
    const Quaternion q = quaternion_of(Rt * to.R);
    return {{v.x, v.y, v.z}, {2 * q.x / q.w, 2 * q.y / q.w, 2 * q.z / q.w}};
}

Result<Se3> se3_from_quaternion(Vec3d t, Quaternion q) {
    const double n2 = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    if (!std::isfinite(t.x) || !std::isfinite(t.y) || !std::isfinite(t.z) || !std::isfinite(n2))
        return Status::error(Code::invalid_argument, "pose is not finite");
    const double n = std::sqrt(n2);
    if (!(std::fabs(n - 1.0) <= 0.05))
        return Status::error(Code::invalid_argument, "quaternion norm is %g, expected 1", n);
    return Se3{rotation_of({q.x / n, q.y / n, q.z / n, q.w / n}), t};
}

Result<Se3> se3_from_matrix(const double* m, int rows, double tolerance) {
    for (int i = 0; i < 4 * rows; ++i)
        if (!std::isfinite(m[i]))
            return Status::error(Code::invalid_argument, "pose matrix entry %d is not finite", i);
    if (rows == 4 && (std::fabs(m[12]) > 1e-6 || std::fabs(m[13]) > 1e-6 || std::fabs(m[14]) > 1e-6 ||
                      std::fabs(m[15] - 1) > 1e-6))
        return Status::error(Code::invalid_argument, "last row of the pose is %g %g %g %g, expected 0 0 0 1",
                             m[12], m[13], m[14], m[15]);
    Se3 T;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) T.R(r, c) = m[4 * r + c];
    T.t = {m[3], m[7], m[11]};
    double worst = 0;
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
            worst = std::max(worst, std::fabs(dot(T.R.column(a), T.R.column(b)) - (a == b ? 1.0 : 0.0)));
    if (!(worst <= tolerance))
        return Status::error(Code::invalid_argument,
                             "rotation is not orthonormal (R^T R off by %g, expected at most %g)", worst,
                             tolerance);
    if (T.R.determinant() < 0)
        return Status::error(Code::invalid_argument,
                             "rotation has determinant -1 (a reflection), expected +1");
    // Back through the quaternion: the nearest rotation to first order, and the same arithmetic as the other
    // path.
    Quaternion q = quaternion_of(T.R);
    const double n = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    return se3_from_quaternion(T.t, {q.x / n, q.y / n, q.z / n, q.w / n});
}

// Shepperd's method: the largest of the four squared components is the divisor, so no cancellation.
Quaternion quaternion_of(const Mat3d& R) {
    const double trace = R(0, 0) + R(1, 1) + R(2, 2);
    Quaternion q;
    if (trace >= R(0, 0) && trace >= R(1, 1) && trace >= R(2, 2)) {
        const double s = 2 * std::sqrt(std::max(1 + trace, 0.0));
        q = {(R(2, 1) - R(1, 2)) / s, (R(0, 2) - R(2, 0)) / s, (R(1, 0) - R(0, 1)) / s, s / 4};
    } else if (R(0, 0) >= R(1, 1) && R(0, 0) >= R(2, 2)) {
        const double s = 2 * std::sqrt(std::max(1 + R(0, 0) - R(1, 1) - R(2, 2), 0.0));
        q = {s / 4, (R(0, 1) + R(1, 0)) / s, (R(0, 2) + R(2, 0)) / s, (R(2, 1) - R(1, 2)) / s};
    } else if (R(1, 1) >= R(2, 2)) {
        const double s = 2 * std::sqrt(std::max(1 + R(1, 1) - R(0, 0) - R(2, 2), 0.0));
        q = {(R(0, 1) + R(1, 0)) / s, s / 4, (R(1, 2) + R(2, 1)) / s, (R(0, 2) - R(2, 0)) / s};
    } else {
        const double s = 2 * std::sqrt(std::max(1 + R(2, 2) - R(0, 0) - R(1, 1), 0.0));
        q = {(R(0, 2) + R(2, 0)) / s, (R(1, 2) + R(2, 1)) / s, s / 4, (R(1, 0) - R(0, 1)) / s};
    }
    if (q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
    return q;
}

Mat3d rotation_of(Quaternion unit) {
    const double x = unit.x, y = unit.y, z = unit.z, w = unit.w;
    return {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),  //
             2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),  //
             2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
}

Quaternion operator*(Quaternion a, Quaternion b) {
    return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

Quaternion normalised(Quaternion q) {
    const double n = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    if (!(n > 0 && std::isfinite(n))) return {};
    return {q.x / n, q.y / n, q.z / n, q.w / n};
}

Se3 normalised(const Se3& T) { return {rotation_of(normalised(quaternion_of(T.R))), T.t}; }

// The unit quaternion is (axis sin(a/2), cos(a/2)). Three times the square root of a rotation, (v, w + 1)
// normalised, brings a/2 from at most pi/2 to at most pi/16, where sin is below 0.196 and the series of its
// inverse converges fast: the first term left out is below 1e-16.
Vec3d rotation_vector(const Mat3d& R) {
    Quaternion q = normalised(quaternion_of(R));
    for (int i = 0; i < 3; ++i) q = normalised(Quaternion{q.x, q.y, q.z, q.w + 1});
    const Vec3d v{q.x, q.y, q.z};
    const double s2 = dot(v, v);
    // asin(s) / s = sum over k of (2k)! / (4^k (k!)^2 (2k + 1)) s^2k.
    double term = 1, sum = 1;
    for (int k = 1; k <= 9; ++k) {
        term *= s2 * (2 * k - 1) / (2 * k);
        sum += term / (2 * k + 1);
    }
    return v * (16 * sum);
}

Quaternion quaternion_from_vector(Vec3d angle_rad) {
    Vec3d half = angle_rad * 0.5;
    int halvings = 0;  // 64 bring all that could be meant within reach; more is normalised to something
    for (; dot(half, half) > 1 && halvings < 64; ++halvings) half = half * 0.5;
    // Taylor's series of sin(x) / x and cos(x); at x = 1 the first term left out is below 1e-17.
    const double x2 = dot(half, half);
    double sine = 1, cosine = 1;
    for (int k = 18; k >= 2; k -= 2) {
        sine = 1 - x2 / (k * (k + 1)) * sine;
        cosine = 1 - x2 / (k * (k - 1)) * cosine;
    }
    Quaternion q = normalised(Quaternion{half.x * sine, half.y * sine, half.z * sine, cosine});
    for (; halvings > 0; --halvings) q = normalised(q * q);
    return q;
}

Mat3d rotation_from_vector(Vec3d angle_rad) { return rotation_of(quaternion_from_vector(angle_rad)); }

}  // namespace burin
