// SPDX-License-Identifier: MIT
// Elementary functions and pseudo-random numbers from + - * / and bit operations alone. The C library's sin,
// exp and log differ in the last bit between machines (even between CPUs, where a variant with fused
// multiply-adds is picked at run time); rendered sequences must be the same bits everywhere, so nothing in
// this room calls them.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/vec.h"

namespace burin::synthetic {

inline constexpr double kPi = 3.14159265358979323846;

// Absolute error below 1e-12 for |x| < 1e5.
double sine(double x);
double cosine(double x);
// Relative error below 1e-12; exponential clamps x to +-700, logarithm expects x > 0.
double exponential(double x);
double logarithm(double x);
double power(double x, double exponent);  // x > 0; x <= 0 gives 0

// The finaliser of SplitMix64 (Steele, Lea, Flood 2014): every bit of z reaches every bit of the result.
inline std::uint64_t mix_bits(std::uint64_t z) {
    z += 0x9E3779B97F4A7C15ull;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
}
// A counter-based generator: the number depends on its coordinates only, never on who asked first.
inline std::uint64_t hash_bits(std::uint64_t seed, std::uint64_t a, std::uint64_t b = 0,
                               std::uint64_t c = 0) {
    return mix_bits(mix_bits(mix_bits(mix_bits(seed) + a) + b) + c);
}
// In [0, 1), 53 bits.
inline double to_unit(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

// Two independent standard normal numbers (Box & Muller 1958) from 64 bits; tails reach 6.6 sigma.
struct NormalPair {
    double a = 0, b = 0;
};
NormalPair normal_pair(std::uint64_t bits);

// The draws that lay out a scene, in the order the builder asks for them.
class Random {
  public:
    Random(std::uint64_t seed, std::uint64_t stream) : key_(hash_bits(seed, stream)) {}
    std::uint64_t bits() { return hash_bits(key_, counter_++); }
    double in(double low, double high) { return low + (high - low) * to_unit(bits()); }
    int below(int count) { return static_cast<int>(bits() % static_cast<std::uint64_t>(count)); }
    double sign() { return bits() & 1 ? 1.0 : -1.0; }

  private:
    std::uint64_t key_;
    std::uint64_t counter_ = 0;
};

// Smooth value noise in [0, 1] over the unit lattice, C1 (cubic fade between hashed lattice values).
double value_noise(Vec3d p, std::uint32_t seed);

}  // namespace burin::synthetic
