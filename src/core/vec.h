// SPDX-License-Identifier: MIT
// Plain 3-vectors and 3x3 matrices for storage and for kernels: no alignment demands, no expression
// templates, every operation written out so that its rounding is the same on every platform.
#pragma once

#include <cmath>
#include <cstdint>

namespace burin {

template <class T>
struct Vec3 {
    T x{}, y{}, z{};
    T& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
    const T& operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
    friend Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
    friend Vec3 operator*(Vec3 a, T s) { return {a.x * s, a.y * s, a.z * s}; }
    friend Vec3 operator*(T s, Vec3 a) { return a * s; }
    friend bool operator==(const Vec3&, const Vec3&) = default;
};

using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;
using Vec3i = Vec3<std::int32_t>;

template <class T>
T dot(Vec3<T> a, Vec3<T> b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
T norm(Vec3<T> a) {
    return std::sqrt(dot(a, a));
}
// Unit vector along a; the zero vector stays zero.
template <class T>
Vec3<T> normalised(Vec3<T> a) {
    const T n = norm(a);
    return n > T(0) ? a * (T(1) / n) : a;
}
inline Vec3f to_float(Vec3d a) {
    return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}
inline Vec3d to_double(Vec3f a) { return {a.x, a.y, a.z}; }

// Row-major 3x3.
struct Mat3d {
    double m[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double operator()(int r, int c) const { return m[3 * r + c]; }
    double& operator()(int r, int c) { return m[3 * r + c]; }
    Vec3d column(int c) const { return {m[c], m[3 + c], m[6 + c]}; }
    friend Vec3d operator*(const Mat3d& a, Vec3d v) {
        return {a.m[0] * v.x + a.m[1] * v.y + a.m[2] * v.z, a.m[3] * v.x + a.m[4] * v.y + a.m[5] * v.z,
                a.m[6] * v.x + a.m[7] * v.y + a.m[8] * v.z};
    }
    friend Mat3d operator*(const Mat3d& a, const Mat3d& b) {
        Mat3d c;
        for (int r = 0; r < 3; ++r)
            for (int k = 0; k < 3; ++k) c(r, k) = a(r, 0) * b(0, k) + a(r, 1) * b(1, k) + a(r, 2) * b(2, k);
        return c;
    }
    Mat3d transposed() const { return {{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}}; }
    double determinant() const { return dot(column(0), cross(column(1), column(2))); }
};

}  // namespace burin
