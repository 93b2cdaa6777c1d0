// SPDX-License-Identifier: MIT
#include "track/photometric.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace burin {
namespace {

// Of a block's mean brightness, levels: what a small sensor's noise leaves of 16 pixels, and interpolation
// adds. Only the ratio to the robust scale matters.
constexpr float kSigmaGrey = 2;
// Larger differences are something else standing there.
constexpr float kLimitGrey = 60;
// A keyframe's point this much nearer or farther than ours hides it or is hidden.
constexpr float kSameSurface = 0.05f;
// Nearer than any depth sensor sees, metres.
constexpr float kNearest_m = 0.05f;
// Fewer matches say nothing of an exposure; nor does a spread below that of noise, levels squared.
constexpr double kLeastMatches = 100, kLeastSpread = 4;
// Twice or half as bright is what an automatic exposure does between two keyframes.
constexpr double kLeastGain = 0.5, kMostGain = 2;

}  // namespace

// Sums over matched points, of keyframe (k) and current (c) brightness.
struct Photometric::Moments {
    double count = 0, k = 0, kk = 0, c = 0, cc = 0;
    void add(double a, double b) {
        count += 1;
        k += a;
        kk += a * a;
        c += b;
        cc += b * b;
    }
    void add(const Moments& m) {
        count += m.count;
        k += m.k;
        kk += m.kk;
        c += m.c;
        cc += m.cc;
    }
};

void Photometric::place(Arena& arena) {
    auto most = static_cast<std::size_t>(TrackPoints::kMostPoints);
    for (int i = 0; i < TrackPoints::kLevels; ++i, most /= 4) {
        depth_[i] = arena.allocate<float>(most, 64);
        grey_[i] = arena.allocate<float>(most, 64);
    }
    items_ = arena.allocate<ResidualItem>(kMostItems, 64);
    moments_ = arena.allocate<Moments>(kMostItems, 64);
}

void Photometric::set_keyframe(const TrackPoints& points, const PointBrightness& brightness,
                               const Se3& T_world_camera) {
    T_world_keyframe_ = T_world_camera;
    has_keyframe_ = true;
    for (int i = 0; i < TrackPoints::kLevels; ++i) {
        const TrackLevel& level = points.level(i);
        cameras_[i] = level.camera;
        widths_[i] = level.width;
        heights_[i] = level.height;
        std::copy_n(level.grid_z, level.width * level.height, depth_[i]);
        std::copy_n(brightness.grid(i), level.width * level.height, grey_[i]);
    }
}

void Photometric::set_keyframe(const ReferenceView& view) {
    T_world_keyframe_ = view.T_world_reference();
    has_keyframe_ = true;
    for (int i = view.finest(); i < TrackPoints::kLevels; ++i) {
        cameras_[i] = view.camera(i);
        widths_[i] = cameras_[i].width;
        heights_[i] = cameras_[i].height;
        std::copy_n(view.depth(i), widths_[i] * heights_[i], depth_[i]);
        std::copy_n(view.grey(i), widths_[i] * heights_[i], grey_[i]);
    }
}

void Photometric::look_at(const TrackPoints& points, const PointBrightness& brightness, Jobs& jobs) {
    points_ = &points;
    brightness_ = &brightness;
    jobs_ = &jobs;
}

void Photometric::measure_item(const Se3& T, int level, int item, ResidualItem* out, Moments* moments) const {
    const TrackLevel& points = points_->level(level);
    const float* now = brightness_->grid(level);
    const Camera& camera = cameras_[level];
    const int width = widths_[level], height = heights_[level];
    const float *depth = depth_[level], *grey = grey_[level];
    const float fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
    const float cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);
    const float gain = static_cast<float>(gain_), bias = static_cast<float>(bias_);
    float R[9], t[3];
    for (int i = 0; i < 9; ++i) R[i] = static_cast<float>(T.R.m[i]);
    for (int i = 0; i < 3; ++i) t[i] = static_cast<float>(T.t[i]);
    const simd::TrackRobust robust = huber(scale_, kLimitGrey);
    alignas(64) float distance[simd::kSampleBatch], gradient[3][simd::kSampleBatch],
        normalised[simd::kSampleBatch], sigma[simd::kSampleBatch];
    std::fill_n(sigma, simd::kSampleBatch, 1 / kSigmaGrey);
    const float* gradients[3] = {gradient[0], gradient[1], gradient[2]};
    out->clear();
    in_batches(points.count, item, [&](int first, int count) {
        for (int k = 0; k < simd::kSampleBatch; ++k) {
            distance[k] = std::numeric_limits<float>::quiet_NaN();
            gradient[0][k] = gradient[1][k] = gradient[2][k] = 0;
            if (k >= count) continue;
            const int i = first + k;
            const float brightness = now[points.cell[i]];
            if (brightness < 0) continue;
            ++out->known;
            const float x = points.x[i], y = points.y[i], z = points.z[i];
            const float px = R[0] * x + R[1] * y + R[2] * z + t[0],
                        py = R[3] * x + R[4] * y + R[5] * z + t[1],
                        pz = R[6] * x + R[7] * y + R[8] * z + t[2];
            if (!(pz > kNearest_m)) continue;
            const float inverse_z = 1.0f / pz;
            const float u = fx * (px * inverse_z) + cx, v = fy * (py * inverse_z) + cy;
            if (!(u >= 0 && v >= 0 && u < static_cast<float>(width - 1) &&
                  v < static_cast<float>(height - 1)))
                continue;
            const int column = static_cast<int>(u), row = static_cast<int>(v);
            const int at = row * width + column;
            const float *d = depth + at, *g = grey + at;
            const float near = (1 - kSameSurface) * pz, far = (1 + kSameSurface) * pz;
            const auto same = [&](float other) { return other > near && other < far; };
            if (!(same(d[0]) && same(d[1]) && same(d[width]) && same(d[width + 1]))) continue;
            if (std::min(std::min(g[0], g[1]), std::min(g[width], g[width + 1])) < 0) continue;
            const float a = u - static_cast<float>(column), b = v - static_cast<float>(row);
            const float above = g[0] + a * (g[1] - g[0]), below = g[width] + a * (g[width + 1] - g[width]);
            const float there = above + b * (below - above);
            distance[k] = there - (gain * brightness + bias);
            const float du =
                ((g[1] - g[0]) + b * ((g[width + 1] - g[width]) - (g[1] - g[0]))) * fx * inverse_z;
            const float dv = (below - above) * fy * inverse_z;
            gradient[0][k] = du;
            gradient[1][k] = dv;
            gradient[2][k] = -(du * px + dv * py) * inverse_z;
            if (moments && std::fabs(distance[k]) < kLimitGrey)
                moments->add(static_cast<double>(there), static_cast<double>(brightness));
        }
        simd::track_sums({points.x + first, points.y + first, points.z + first, sigma, distance, gradients},
                         count, R, robust, out->sums, normalised);
        out->take(normalised, count, std::numeric_limits<float>::infinity());
    });
}

Measured Photometric::measure(const Se3& T_world_camera, int level) {
    const int count = points_->level(level).count;
    const int items = items_of(count);
    const Se3 T = T_world_keyframe_.inverse() * T_world_camera;
    jobs_->run(items, [&](int item, int) { measure_item(T, level, item, &items_[item], nullptr); });
    Measured out = measured_of(items_, items, count, scale_);
    out.bright = out.known;
    out.seen = out.close;
    out.depth_points = out.known = out.close = 0;
    out.considered = out.bright;
    return out;
}

// Gain and bias carry the mean and the spread of what is matched over; a regression would make the gain too
// small wherever the images do not fit yet. Then the scale.
Measured Photometric::begin_level(const Se3& T_world_camera, int level) {
    const int count = points_->level(level).count;
    const int items = items_of(count);
    const Se3 T = T_world_keyframe_.inverse() * T_world_camera;
    jobs_->run(items, [&](int item, int) {
        moments_[item] = {};
        measure_item(T, level, item, &items_[item], &moments_[item]);
    });
    Moments all;
    for (int i = 0; i < items; ++i) all.add(moments_[i]);
    if (all.count >= kLeastMatches) {
        const double k = all.k / all.count, c = all.c / all.count;
        const double spread_k = all.kk / all.count - k * k, spread_c = all.cc / all.count - c * c;
        // A flat wall has no spread to go by: then the bias alone.
        gain_ = spread_k > kLeastSpread && spread_c > kLeastSpread
                    ? std::clamp(std::sqrt(spread_k / spread_c), kLeastGain, kMostGain)
                    : 1;
        bias_ = k - gain_ * c;
    }
    return begin_with_scale(T_world_camera, level);
}

}  // namespace burin
