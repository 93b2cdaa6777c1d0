// SPDX-License-Identifier: MIT
#include "datasets/synthetic/material.h"

#include <algorithm>
#include <cmath>

#include "datasets/synthetic/portable_math.h"

namespace burin::synthetic {
namespace {

Vec3f mix(Vec3f a, Vec3f b, double t) { return a * static_cast<float>(1 - t) + b * static_cast<float>(t); }
double clamp01(double x) { return x < 0 ? 0 : x > 1 ? 1 : x; }
double ramp(double low, double high, double x) {
    const double t = clamp01((x - low) / (high - low));
    return t * t * (3 - 2 * t);
}
// How much of a detail of the given wavelength a pixel of this footprint still resolves (1 all .. 0 none).
double resolved(double wavelength, double footprint) { return 1 - ramp(0.3, 1.0, footprint / wavelength); }

// Fractal noise around 0, amplitude about 0.5; octaves the pixel cannot resolve are left out.
double fractal(Vec3d p, double wavelength, int octaves, double footprint, std::uint32_t seed) {
    double sum = 0, amplitude = 0.5;
    for (int i = 0; i < octaves; ++i, wavelength *= 0.47, amplitude *= 0.55) {
        const double fade = resolved(wavelength, footprint);
        if (fade <= 0) break;
        sum += amplitude * fade *
               (2 * value_noise(p * (1 / wavelength), seed + 101u * static_cast<std::uint32_t>(i)) - 1);
    }
    return sum;
}

double cell_random(double i, double j, std::uint32_t seed) {
    return to_unit(hash_bits(seed, static_cast<std::uint64_t>(static_cast<std::int64_t>(i)),
                             static_cast<std::uint64_t>(static_cast<std::int64_t>(j))));
}

// Coverage of a pulse of the given width centred on every whole multiple of the period, box-filtered by the
// footprint.
double line_coverage(double x, double period, double width, double footprint) {
    const double d = std::fabs(x / period - std::floor(x / period + 0.5)) * period;  // to the nearest line
    const double blur = std::max(footprint, 1e-5);
    const double sharp = clamp01((0.5 * width - d) / blur + 0.5);
    const double keep = resolved(period, footprint);
    return keep * sharp + (1 - keep) * std::min(1.0, width / period);
}

struct Uv {
    double u, v;
};
Uv texture_plane(Vec3d p, Vec3d n) {
    const double ax = std::fabs(n.x), ay = std::fabs(n.y), az = std::fabs(n.z);
    if (az >= ax && az >= ay) return {p.x, p.y};
    return ax > ay ? Uv{p.y, p.z} : Uv{p.x, p.z};
}

Vec3f wood(const Material& m, Vec3d p, double offset, double footprint) {
    // Rings around a trunk far off the board, drawn out along x, wavering slowly.
    const double waver =
        0.35 * m.scale * 8 * fractal({p.x * 1.3 + offset, p.y * 5, p.z * 5}, 1.0, 3, footprint, m.seed);
    const double y = p.y + 0.31 + offset, z = p.z + 0.17;
    const double ring = (std::sqrt(y * y + z * z) + waver) / m.scale;
    const double phase = ring - std::floor(ring);
    const double keep = resolved(m.scale, footprint);
    const double dark = keep * (phase < 0.75 ? phase / 0.75 : (1 - phase) * 4) + (1 - keep) * 0.5;
    const double pore = fractal({p.x * 6, p.y * 160, p.z * 160}, 1.0, 1, footprint * 160, m.seed + 9);
    return mix(m.a, m.b, clamp01(0.75 * dark + 0.5 * pore + 0.1));
}

Vec3f planks(const Material& m, Uv t, double footprint) {
    const double length = 8 * m.scale;
    const double row = std::floor(t.v / m.scale);
    const double shift = cell_random(row, 0, m.seed) * length;
    const double column = std::floor((t.u + shift) / length);
    const double tone = cell_random(row, column + 1, m.seed);
    Material board = m;
    board.scale = 0.012;
    Vec3f colour =
        wood(board, {t.u, t.v, 0.05 * tone}, 3 * tone, footprint) * static_cast<float>(0.75 + 0.45 * tone);
    const double joint = std::max(line_coverage(t.v, m.scale, 0.003, footprint),
                                  line_coverage(t.u + shift, length, 0.003, footprint));
    return mix(colour, m.b * 0.25f, joint);
}

Vec3f tiles(const Material& m, Uv t, double footprint) {
    const double tone = cell_random(std::floor(t.u / m.scale), std::floor(t.v / m.scale), m.seed);
    const double mottle = fractal({t.u, t.v, tone}, 0.3 * m.scale, 3, footprint, m.seed);
    const double joint = std::max(line_coverage(t.u, m.scale, 0.04 * m.scale, footprint),
                                  line_coverage(t.v, m.scale, 0.04 * m.scale, footprint));
    return mix(m.a * static_cast<float>(0.8 + 0.3 * tone + 0.3 * mottle), m.b, joint);
}

Vec3f wallpaper(const Material& m, Uv t, double footprint) {
    // A lozenge in every cell of a brick-like lattice, with a dot in its middle and a slow stain over all.
    const double row = std::floor(t.v / m.scale);
    const double u = t.u / m.scale + 0.5 * (row - 2 * std::floor(0.5 * row)), v = t.v / m.scale;
    const double du = std::fabs(u - std::floor(u) - 0.5), dv = std::fabs(v - std::floor(v) - 0.5);
    const double d = du * 1.4 + dv, blur = std::max(footprint / m.scale, 0.01);
    const double outline = clamp01((0.07 - std::fabs(d - 0.38)) / blur + 0.5);
    const double dot2 = clamp01((0.13 - std::sqrt(du * du + dv * dv)) / blur + 0.5);
    const double keep = resolved(m.scale, 1.5 * footprint);
    const double stain = fractal({t.u, t.v, 0.3}, 0.6, 4, footprint, m.seed);
    const Vec3f ground = m.a * static_cast<float>(1 + 0.22 * stain);
    return mix(ground, m.b, keep * std::max(outline, dot2) + (1 - keep) * 0.25);
}

Vec3f fabric(const Material& m, Vec3d p, Uv t, double footprint) {
    const double warp = line_coverage(t.u, m.scale, 0.45 * m.scale, footprint);
    const double weft = line_coverage(t.v, m.scale, 0.45 * m.scale, footprint);
    const double fold = fractal(p, 0.12, 3, footprint, m.seed);
    return mix(m.a, m.b, clamp01(0.35 * warp + 0.35 * weft + 0.25)) * static_cast<float>(1 + 0.35 * fold);
}

Vec3f carpet(const Material& m, Uv t, double footprint) {
    const double edge =
        std::min(m.extent_u - std::fabs(t.u), m.extent_v - std::fabs(t.v));  // from the rim inwards
    const Vec3f c = mix(m.a, m.b, 0.5) * 0.6f;
    Vec3f colour = m.a;
    if (edge < m.scale)
        colour = m.b;
    else if (edge < 1.5 * m.scale)
        colour = c;
    else {
        const double ru = t.u / (0.6 * m.extent_u), rv = t.v / (0.6 * m.extent_v),
                     r = std::sqrt(ru * ru + rv * rv);
        const double bands = r * 3 - std::floor(r * 3);
        if (r < 1)
            colour = bands < 0.5 ? mix(m.a, m.b, 0.75) : c;
        else if (line_coverage(t.u + t.v, 2.2 * m.scale, 0.5 * m.scale, footprint) > 0.5)
            colour = mix(m.a, m.b, 0.25);
    }
    const double pile = fractal({t.u, t.v, 0}, 0.02, 2, footprint, m.seed);
    return colour * static_cast<float>(1 + 0.4 * pile);
}

Vec3f picture(const Material& m, Uv t, double footprint) {
    const double u = t.u / m.extent_u, v = t.v / m.extent_v;  // -1..1
    const double horizon =
        0.3 * cell_random(1, 2, m.seed) - 0.15 + 0.25 * fractal({2 * u, 0.7, 3}, 1.0, 4, footprint, m.seed);
    Vec3f colour = mix(mix(m.a, {0.9f, 0.85f, 0.75f}, 0.6), m.a, clamp01(v));
    if (v < horizon)
        colour =
            mix(m.b, m.b * 0.35f,
                clamp01((horizon - v) * 1.2 + 0.6 * fractal({3 * u, 6 * v, 1}, 1.0, 3, footprint, m.seed)));
    for (int i = 0; i < 5; ++i) {  // round things, one of them the sun
        const double cu = 1.6 * cell_random(i, 10, m.seed) - 0.8,
                     cv = 1.5 * cell_random(i, 11, m.seed) - 0.75;
        const double radius = 0.08 + 0.16 * cell_random(i, 12, m.seed);
        const double d = std::sqrt((u - cu) * (u - cu) + (v - cv) * (v - cv));
        const Vec3f tint{static_cast<float>(0.15 + 0.75 * cell_random(i, 13, m.seed)),
                         static_cast<float>(0.1 + 0.6 * cell_random(i, 14, m.seed)),
                         static_cast<float>(0.1 + 0.6 * cell_random(i, 15, m.seed))};
        colour =
            mix(colour, tint, 0.85 * clamp01((radius - d) / std::max(0.02, footprint / m.extent_u) + 0.5));
    }
    const double margin = 1 - std::max(std::fabs(u), std::fabs(v));
    return margin < 0.08
               ? Vec3f{0.8f, 0.78f, 0.72f}
               : colour * static_cast<float>(1 + 0.3 * fractal({t.u, t.v, 5}, 0.03, 2, footprint, m.seed));
}

Vec3f screen(const Material& m, Uv t, double footprint) {
    const double u = t.u / m.extent_u, v = t.v / m.extent_v;
    if (std::max(std::fabs(u), std::fabs(v)) > 0.96) return {0.02f, 0.02f, 0.02f};
    Vec3f colour = mix(m.a, m.b, 0.5 + 0.4 * v + 0.3 * fractal({u, v, 2}, 0.8, 3, footprint, m.seed));
    for (int i = 0; i < 3; ++i) {  // windows with lines of text
        const double cu = -0.5 + 0.5 * i + 0.2 * cell_random(i, 1, m.seed),
                     cv = 0.4 * cell_random(i, 2, m.seed) - 0.2;
        const double du = u - cu, dv = v - cv, hw = 0.28 + 0.12 * cell_random(i, 3, m.seed), hh = 0.45;
        if (std::fabs(du) > hw || std::fabs(dv) > hh) continue;
        colour = dv > hh - 0.08 ? Vec3f{0.12f, 0.2f, 0.45f} : Vec3f{0.85f, 0.86f, 0.84f};
        const double line = std::floor(dv / 0.07), word = std::floor((du + hw) / 0.045);
        if (dv < hh - 0.12 && dv / 0.07 - line < 0.45 && cell_random(line + 100 * i, word, m.seed) < 0.7 &&
            (du + hw) / (2 * hw) < 0.4 + 0.6 * cell_random(line, i, m.seed))
            colour = mix({0.45f, 0.46f, 0.46f}, {0.05f, 0.06f, 0.1f}, resolved(0.07 * m.extent_v, footprint));
    }
    return colour;
}

Vec3f keys(const Material& m, Uv t, double footprint) {
    const double row = std::floor(t.v / m.scale);
    const double u = t.u + 0.37 * m.scale * row;
    const double gap = std::max(line_coverage(u, m.scale, 0.16 * m.scale, footprint),
                                line_coverage(t.v, m.scale, 0.16 * m.scale, footprint));
    const double ku = u / m.scale - std::floor(u / m.scale) - 0.4, kv = t.v / m.scale - row - 0.6;
    const double letter = std::fabs(ku) < 0.14 && std::fabs(kv) < 0.16 &&
                          cell_random(std::floor(ku * 18 + 40), std::floor(kv * 18 + 40),
                                      m.seed + static_cast<std::uint32_t>(static_cast<std::int64_t>(
                                                   std::floor(u / m.scale) * 31 + row + 4096))) < 0.5;
    return mix(mix(m.a, {0.8f, 0.8f, 0.8f}, letter * resolved(0.06 * m.scale, footprint)), m.b, gap);
}

Vec3f face(const Material& m, Vec3d p, double footprint) {
    const double u = p.x / m.scale, v = p.z / m.scale;
    Vec3f colour = m.a * static_cast<float>(1 + 0.15 * fractal(p, 0.03, 3, footprint, m.seed));
    if (p.y < 0) return colour;
    const double eu = std::fabs(u) - 0.29, ev = v - 0.1;
    if (eu * eu / 0.009 + ev * ev / 0.0016 < 1)
        colour = eu * eu + ev * ev < 0.0014 ? Vec3f{0.05f, 0.04f, 0.03f} : Vec3f{0.6f, 0.58f, 0.55f};
    if (std::fabs(v - 0.24 + 2 * eu * eu) < 0.025 && std::fabs(eu) < 0.14) colour = m.b;
    if (std::fabs(v + 0.5 - 0.5 * u * u) < 0.04 && std::fabs(u) < 0.22)
        colour = mix(m.a, {0.4f, 0.08f, 0.08f}, 0.6);
    const double cheek = (std::fabs(u) - 0.42) * (std::fabs(u) - 0.42) + (v + 0.2) * (v + 0.2);
    return mix(colour, {0.7f, 0.25f, 0.2f}, 0.35 * clamp01(1 - cheek / 0.05));
}

Vec3f skyline(const Material& m, Uv t, double footprint) {
    const double u = t.u / m.extent_u, v = t.v / m.extent_v;
    const double hill = -0.2 + 0.35 * fractal({1.5 * u, 0.2, 8}, 1.0, 4, footprint, m.seed);
    const double cloud = fractal({u, 2.5 * v, 4}, 0.7, 4, footprint, m.seed);
    Vec3f colour = mix(mix({0.75f, 0.85f, 0.95f}, m.a, clamp01(0.5 * (v + 0.4))), {0.95f, 0.95f, 0.95f},
                       clamp01(2.2 * cloud));
    if (v < hill)
        colour =
            mix(m.b, {0.15f, 0.25f, 0.1f}, clamp01(0.5 + fractal({t.u, t.v, 0}, 0.1, 3, footprint, m.seed)));
    const double block = std::floor(u * 4), roof = -0.75 + 0.5 * cell_random(block, 3, m.seed);
    if (v < roof) {
        const double tone = cell_random(block, 4, m.seed);
        const bool pane = std::fabs(u * 16 - std::floor(u * 16) - 0.5) < 0.25 &&
                          std::fabs(v * 10 - std::floor(v * 10) - 0.5) < 0.25;
        colour = pane ? Vec3f{0.12f, 0.14f, 0.18f} : mix({0.5f, 0.3f, 0.22f}, {0.6f, 0.58f, 0.5f}, tone);
    }
    return colour;
}

Vec3f raw_albedo(const Material& m, Vec3d p, Vec3d n, double footprint) {
    const Uv t = texture_plane(p, n);
    switch (m.texture) {
        case Texture::plain:
            return m.a * static_cast<float>(1 + 0.12 * fractal(p, 0.15, 2, footprint, m.seed));
        case Texture::mottled:
            return mix(m.a, m.b, clamp01(0.5 + 1.1 * fractal(p, m.scale, 4, footprint, m.seed)));
        case Texture::checker: {
            const double su = std::floor(t.u / m.scale), sv = std::floor(t.v / m.scale);
            const double parity = su + sv - 2 * std::floor(0.5 * (su + sv));
            const double keep = resolved(m.scale, footprint);
            return mix(m.a, m.b, keep * parity + (1 - keep) * 0.5) *
                   static_cast<float>(1 + 0.15 * fractal(p, 0.1, 2, footprint, m.seed));
        }
        case Texture::stripes:
            return mix(m.a, m.b, line_coverage(t.u, m.scale, 0.45 * m.scale, footprint)) *
                   static_cast<float>(1 + 0.15 * fractal(p, 0.1, 2, footprint, m.seed));
        case Texture::hoops:
            return mix(m.a, m.b, line_coverage(p.z, m.scale, 0.45 * m.scale, footprint)) *
                   static_cast<float>(1 + 0.15 * fractal(p, 0.1, 2, footprint, m.seed));
        case Texture::wood:
            return wood(m, p, 0.37 * (m.seed % 64), footprint);
        case Texture::planks:
            return planks(m, t, footprint);
        case Texture::tiles:
            return tiles(m, t, footprint);
        case Texture::wallpaper:
            return wallpaper(m, t, footprint);
        case Texture::fabric:
            return fabric(m, p, t, footprint);
        case Texture::carpet:
            return carpet(m, t, footprint);
        case Texture::picture:
            return picture(m, t, footprint);
        case Texture::screen:
            return screen(m, t, footprint);
        case Texture::keys:
            return keys(m, t, footprint);
        case Texture::face:
            return face(m, p, footprint);
        case Texture::skyline:
            return skyline(m, t, footprint);
    }
    return m.a;
}

}  // namespace

Vec3f linear_colour(int r, int g, int b) {
    const auto decode = [](int value) {  // IEC 61966-2-1
        const double s = value / 255.0;
        return static_cast<float>(s <= 0.04045 ? s / 12.92 : power((s + 0.055) / 1.055, 2.4));
    };
    return {decode(r), decode(g), decode(b)};
}

Vec3f albedo_of(const Material& material, Vec3d p, Vec3d n, double footprint) {
    Vec3f c = raw_albedo(material, p, n, footprint);
    for (int i = 0; i < 3; ++i)
        c[i] = std::clamp(c[i], 0.005f, 0.95f);  // no surface is a perfect mirror or hole
    return c;
}

}  // namespace burin::synthetic
