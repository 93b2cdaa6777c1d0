// SPDX-License-Identifier: MIT
// A carved panel of 0.4 x 0.3 m in a frame, standing upright on a ledge before a wall, its face towards -y: a
// rosette, scrolls, a row of beads, chiselled strokes and letters like inscription, all 1 to 3 mm high, under
// lights close by.
#include <algorithm>
#include <cmath>
#include <utility>

#include "datasets/synthetic/builder.h"

namespace burin::synthetic {
namespace {

constexpr double kHalfWidth = 0.2, kHalfHeight = 0.15;  // metres, of the panel
constexpr double kSpacing = 0.0005;  // metres between control heights: details of 1 mm and up
constexpr double kMm = 0.001;

double bump(double x) {  // 1 at 0, smoothly 0 at |x| >= 1
    const double s = 1 - x * x;
    return s > 0 ? s * s * s : 0;
}
double step(double low, double high, double x) {
    const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * t * (t * (6 * t - 15) + 10);
}
double polar_angle(double x, double y) {  // -pi..pi; a rational fit is exact enough for carving
    const double ax = std::fabs(x), ay = std::fabs(y),
                 m = std::min(ax, ay) / std::max(std::max(ax, ay), 1e-12);
    const double s = m * m;
    double a = ((-0.0464964749 * s + 0.15931422) * s - 0.327622764) * s * m + m;
    if (ay > ax) a = 0.5 * kPi - a;
    if (x < 0) a = kPi - a;
    return y < 0 ? -a : a;
}

struct Stroke {
    double ax, ay, bx, by, width, depth;
};

class Carving {
  public:
    explicit Carving(Random& random)
        : petals_(5 + random.below(4)), noise_(static_cast<std::uint32_t>(random.bits())) {
        turn_ = random.in(0, 2 * kPi);
        scroll_ = random.in(0, 2 * kPi);
        // Eight glyphs of three to four strokes each, on a band below the rosette.
        for (int glyph = 0; glyph < 8; ++glyph) {
            const double cx = -0.147 + 0.042 * glyph;
            const int strokes = 3 + random.below(2);
            for (int i = 0; i < strokes; ++i) {
                const double x0 = cx + 0.007 * (random.below(4) - 1.5),
                             y0 = -0.1 + 0.008 * (random.below(4) - 1.5);
                const double x1 = cx + 0.007 * (random.below(4) - 1.5),
                             y1 = -0.1 + 0.008 * (random.below(4) - 1.5);
                const double width = random.in(1.6, 2.4) * kMm;
                strokes_.push_back({x0, y0, x1 + 0.001, y1 + 0.002, width, random.in(1.0, 1.6) * kMm});
            }
        }
    }

    double height(double x, double y) const {
        double h = 0;
        // Rosette of petals around a boss.
        const double rx = x, ry = y - 0.025, r = std::sqrt(rx * rx + ry * ry);
        if (r < 0.075) {
            const double wave = 0.5 + 0.5 * cosine(petals_ * (polar_angle(rx, ry) + turn_));
            const double rim = 0.035 + 0.028 * wave;
            h += 3 * kMm * step(rim + 0.004, rim - 0.006, r) * (0.45 + 0.55 * wave) * step(0.008, 0.02, r);
            h += 0.5 * kMm * bump((r - 0.03) / 0.004) + 2.8 * kMm * bump(r / 0.013);
            h -= 0.5 * kMm * bump((r - 0.017) / 0.003);
        }
        // Scrolls left and right: a ridge along a spiral, r = pitch * angle.
        for (double s : {-1.0, 1.0}) {
            const double sx = s * x - 0.125, sy = y - 0.035, q = std::sqrt(sx * sx + sy * sy);
            if (q > 0.05) continue;
            const double winding = q / 0.0125 - (polar_angle(sx, sy) + scroll_) / (2 * kPi);
            const double off = std::fabs(winding - std::floor(winding + 0.5)) * 0.0125;
            h += 2 * kMm * bump(off / 0.004) * step(0.05, 0.042, q) * step(0.001, 0.005, q);
        }
        // A border of beads between two fillets.
        const double edge = std::min(kHalfWidth - std::fabs(x), kHalfHeight - std::fabs(y));
        h += 1.5 * kMm * bump((edge - 0.012) / 0.003) + 1.5 * kMm * bump((edge - 0.027) / 0.003);
        if (edge > 0.014 && edge < 0.026) {
            const bool top = kHalfHeight - std::fabs(y) < kHalfWidth - std::fabs(x);
            const double along = (top ? x : y) / 0.0105, bead = along - std::floor(along + 0.5);
            const double across = (edge - 0.0195) / 0.0045, d2 = bead * bead * 5.5 + across * across;
            h += d2 < 1 ? 2.2 * kMm * (1 - d2) * (1 - d2) * (1 + d2) : 0;
        }
        // Inscription: grooves; and shallow tool marks on the ground.
        double cut = 0;
        for (const Stroke& s : strokes_) {
            const double vx = s.bx - s.ax, vy = s.by - s.ay;
            const double t = std::clamp(((x - s.ax) * vx + (y - s.ay) * vy) / (vx * vx + vy * vy), 0.0, 1.0);
            const double dx = x - s.ax - t * vx, dy = y - s.ay - t * vy, d2 = dx * dx + dy * dy;
            if (d2 < s.width * s.width) cut = std::max(cut, s.depth * bump(std::sqrt(d2) / s.width));
        }
        h -= cut;
        const double ground = value_noise({x / 0.006, y / 0.0025, 0.5}, noise_) - 0.5;
        return h + 0.25 * kMm * ground * step(0.03, 0.036, edge);
    }

  private:
    int petals_;
    std::uint32_t noise_;
    double turn_ = 0, scroll_ = 0;
    std::vector<Stroke> strokes_;
};

}  // namespace

SceneData relief_scene(std::uint64_t seed) {
    SceneBuilder b("relief", seed);
    const Carving carving(b.random);
    const int columns = static_cast<int>(2 * kHalfWidth / kSpacing) + 1,
              rows = static_cast<int>(2 * kHalfHeight / kSpacing) + 1;
    std::vector<float> control(static_cast<std::size_t>(columns) * rows);
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i)
            control[static_cast<std::size_t>(j) * columns + i] = static_cast<float>(
                carving.height((i - 0.5 * (columns - 1)) * kSpacing, (j - 0.5 * (rows - 1)) * kSpacing));
    b.data.reliefs.push_back(std::make_unique<ReliefSurface>(columns, rows, kSpacing, std::move(control)));

    // Panel coordinates to the scene: x right, y up, z towards the viewer (-y of the scene).
    const Mat3d upright = rotation_about(0, 0.5 * kPi);
    const Vec3d centre{0, 0, 0.2};
    const Vec3f stone = b.pale_colour();
    const int kind = b.random.below(2);
    const int surface =
        kind ? b.material(Texture::wood, linear_colour(190, 150, 105), linear_colour(160, 115, 75), 0.02)
             : b.material(Texture::mottled, stone, stone * 0.65f + Vec3f{0.06f, 0.04f, 0.02f}, 0.05);
    b.object(kNone);
    Part& panel = b.add(Shape::relief, centre, {kHalfWidth, kHalfHeight, 0.034}, surface, 0, upright);
    panel.relief = b.data.reliefs.back().get();
    const int frame = b.random_wood(0.008);
    b.object(kNone);
    for (double s : {-1.0, 1.0}) {
        b.box({s * 0.207 - 0.012, -0.014, 0.2 - 0.169}, {s * 0.207 + 0.012, 0.036, 0.2 + 0.169}, frame,
              0.004);
        b.box({-0.21, -0.0135, 0.2 + s * 0.157 - 0.012}, {0.21, 0.035, 0.2 + s * 0.157 + 0.012}, frame,
              0.004);
    }
    b.object(kTable);  // the ledge
    b.box({-0.6, -0.12, -0.02}, {0.6, 0.06, 0.034}, b.random_wood());
    b.object(kWall);
    b.plane({0, 0.03, 0.3}, {0, -1, 0}, {1, 0, 0}, 1.5, 1.5,
            b.material(Texture::mottled, b.pale_colour(), {0.3f, 0.28f, 0.25f}, 0.12));

    const double left = b.random.in(0.25, 0.4), right = b.random.in(0.2, 0.35);
    // Raking light, so that a millimetre shows.
    b.light({-left, -b.random.in(0.08, 0.15), 0.42}, {1.0f, 0.85f, 0.65f}, 2.6, 0.2);
    b.light({right, -b.random.in(0.1, 0.2), 0.08}, {0.6f, 0.75f, 1.0f}, 1.6, 0.2);
    b.light({b.random.in(-0.1, 0.1), -0.5, 0.8}, {1.0f, 1.0f, 0.95f}, 0.5, 0.5);
    b.data.ambient = {
        {0.2f, 0.21f, 0.23f}, {0.12f, 0.11f, 0.1f}, 0.5, 0.15, static_cast<std::uint32_t>(b.random.bits())};
    b.data.exposure = 1.2;
    b.data.occlusion_reach = 0.006;
    b.data.bounds = {{-0.62, -0.13, -0.03}, {0.62, 0.07, 0.4}};
    b.data.mesh_bounds = {{-0.225, -0.03, 0.036}, {0.225, 0.035, 0.375}};
    b.data.mesh_resolution = 0.001;
    b.data.min_plane_area = 0.004;
    b.data.cell = 0.02;
    return std::move(b.data);
}

}  // namespace burin::synthetic
