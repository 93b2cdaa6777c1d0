// SPDX-License-Identifier: MIT
#include "datasets/synthetic/portable_math.h"

namespace burin::synthetic {
namespace {

// Taylor series on [-pi/4, pi/4]; the first term left out is below 1e-14.
double sine_core(double x) {
    const double s = x * x;
    double sum = 1;
    for (int k = 15; k >= 3; k -= 2) sum = 1 - s / (k * (k - 1)) * sum;
    return x * sum;
}

double cosine_core(double x) {
    const double s = x * x;
    double sum = 1;
    for (int k = 16; k >= 2; k -= 2) sum = 1 - s / (k * (k - 1)) * sum;
    return sum;
}

// pi/2 as a sum of 33 leading bits and the rest (Cody & Waite 1980), so that k * high is exact for k < 2^20.
constexpr double kHalfPiHigh = 1.57079632673412561417e+00;
constexpr double kHalfPiLow = 6.07710050650619224932e-11;

double quarter_wave(double x, int shift) {
    const double turns = std::floor(x * (2 / kPi) + 0.5);
    const double y = (x - turns * kHalfPiHigh) - turns * kHalfPiLow;
    switch ((static_cast<long long>(turns) + shift) & 3) {
        case 0:
            return sine_core(y);
        case 1:
            return cosine_core(y);
        case 2:
            return -sine_core(y);
        default:
            return -cosine_core(y);
    }
}

constexpr double kLn2 = 0.69314718055994530942;

std::uint32_t lattice_hash(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t seed) {
    std::uint32_t h = static_cast<std::uint32_t>(x) * 0x8DA6B343u ^
                      static_cast<std::uint32_t>(y) * 0xD8163841u ^
                      static_cast<std::uint32_t>(z) * 0xCB1AB31Fu ^ seed;
    h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
    h = (h ^ (h >> 12)) * 0x297A2D39u;
    return h ^ (h >> 15);
}

}  // namespace

double sine(double x) { return quarter_wave(x, 0); }
double cosine(double x) { return quarter_wave(x, 1); }

double exponential(double x) {
    x = x < -700 ? -700 : x > 700 ? 700 : x;
    const double k = std::floor(x / kLn2 + 0.5);
    const double y = x - k * kLn2;  // |y| <= 0.35
    double sum = 1;
    for (int i = 14; i >= 1; --i) sum = 1 + y / i * sum;
    return std::ldexp(sum, static_cast<int>(k));
}

double logarithm(double x) {
    int exponent = 0;
    double m = std::frexp(x, &exponent);  // [0.5, 1)
    if (m < 0.70710678118654752440) m *= 2, --exponent;
    const double z = (m - 1) / (m + 1), s = z * z;  // log m = 2 atanh z, |z| <= 0.1716
    double sum = 0;
    for (int k = 17; k >= 1; k -= 2) sum = 1.0 / k + s * sum;
    return 2 * z * sum + exponent * kLn2;
}

double power(double x, double exponent) { return x <= 0 ? 0 : exponential(exponent * logarithm(x)); }

NormalPair normal_pair(std::uint64_t bits) {
    const double u = (static_cast<double>(bits >> 32) + 0.5) * 0x1p-32;  // (0, 1)
    const double angle = static_cast<double>(bits & 0xFFFFFFFFu) * (0x1p-32 * 2 * kPi);
    const double radius = std::sqrt(-2 * logarithm(u));
    return {radius * cosine(angle), radius * sine(angle)};
}

double value_noise(Vec3d p, std::uint32_t seed) {
    const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
    const auto x = static_cast<std::int32_t>(fx), y = static_cast<std::int32_t>(fy),
               z = static_cast<std::int32_t>(fz);
    double a = p.x - fx, b = p.y - fy, c = p.z - fz;
    a = a * a * (3 - 2 * a), b = b * b * (3 - 2 * b), c = c * c * (3 - 2 * c);
    double v[8];
    for (int i = 0; i < 8; ++i)
        v[i] = lattice_hash(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2), seed) * 0x1p-32;
    const double low = (v[0] + a * (v[1] - v[0])) * (1 - b) + (v[2] + a * (v[3] - v[2])) * b;
    const double high = (v[4] + a * (v[5] - v[4])) * (1 - b) + (v[6] + a * (v[7] - v[6])) * b;
    return low + c * (high - low);
}

}  // namespace burin::synthetic
