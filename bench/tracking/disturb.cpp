// SPDX-License-Identifier: MIT
#include "tracking/disturb.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace burin::bench {
namespace {

constexpr double kHandM = 0.3;           // an arm's bend away, and within the range that is fused
constexpr double kHandWidth = 0.8;       // of the image, from the left
constexpr std::uint8_t kSkin = 120;      // one brightness all over: nothing to hold on to
constexpr std::uint64_t kOne = 1000000;  // shares are counted in millionths
// The largest plane: of so many drawn through three readings, the one most readings lie on; within three
// deviations of a structured-light sensor's reading at 3 m.
constexpr int kPlaneDraws = 200, kPlaneStep = 8;
constexpr double kPlaneNear_m = 0.02, kPlanePerDepth = 0.01;

// The finaliser of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014): every bit of x reaches all of the result.
std::uint64_t mixed(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

template <class T>
void drop(std::vector<T>& pixels, int index, double share) {
    const auto limit = static_cast<std::uint64_t>(share * static_cast<double>(kOne));
    for (std::size_t i = 0; i < pixels.size(); ++i)
        if (mixed((static_cast<std::uint64_t>(index) << 32) + i + 1) % kOne < limit) pixels[i] = 0;
}

// `value` into the left columns of every row; a pixel has `channels` values.
template <class T>
void cover(std::vector<T>& pixels, int width, int channels, T value) {
    const std::size_t row = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels);
    const std::size_t covered =
        static_cast<std::size_t>(kHandWidth * width) * static_cast<std::size_t>(channels);
    for (std::size_t at = 0; row > 0 && at + row <= pixels.size(); at += row)
        std::fill_n(pixels.begin() + static_cast<std::ptrdiff_t>(at), covered, value);
}

// The place of the reading at a pixel; z is 0 without one.
Vec3d reading(const Frame& frame, int x, int y) {
    const Camera& c = frame.depth_camera;
    const std::size_t at =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(c.width) + static_cast<std::size_t>(x);
    const double z = frame.depth_unit_m * (frame.depth_u16.pixels.empty()
                                               ? static_cast<double>(frame.depth_f32.pixels[at])
                                               : static_cast<double>(frame.depth_u16.pixels[at]));
    return {(x - c.cx) / c.fx * z, (y - c.cy) / c.fy * z, z};
}

bool on_plane(Vec3d normal, double offset, Vec3d p) {
    return std::abs(dot(normal, p) - offset) < kPlaneNear_m + kPlanePerDepth * p.z;
}

void keep_largest_plane(int step, Frame* frame) {
    frame->colour = {};
    std::vector<Vec3d> points;
    for (int y = 0; y < frame->depth_camera.height; y += kPlaneStep)
        for (int x = 0; x < frame->depth_camera.width; x += kPlaneStep)
            if (const Vec3d p = reading(*frame, x, y); p.z > 0) points.push_back(p);
    Vec3d normal;
    double offset = 0;
    std::size_t most = 0;
    for (int draw = 0; draw < kPlaneDraws && points.size() > 3; ++draw) {
        const auto any = [&](std::uint64_t which) {
            return points
                [mixed(((static_cast<std::uint64_t>(step) << 20) + static_cast<std::uint64_t>(draw)) * 3 +
                       which) %
                 points.size()];
        };
        const Vec3d a = any(1), n = cross(any(2) - a, any(3) - a);
        if (norm(n) < 1e-3) continue;  // three readings on a line
        const Vec3d unit = n * (1 / norm(n));
        const std::size_t count = static_cast<std::size_t>(std::count_if(
            points.begin(), points.end(), [&](Vec3d p) { return on_plane(unit, dot(unit, a), p); }));
        if (count <= most) continue;
        most = count;
        normal = unit;
        offset = dot(unit, a);
    }
    std::size_t at = 0;
    for (int y = 0; y < frame->depth_camera.height; ++y)
        for (int x = 0; x < frame->depth_camera.width; ++x, ++at) {
            if (on_plane(normal, offset, reading(*frame, x, y))) continue;
            if (!frame->depth_u16.pixels.empty()) frame->depth_u16.pixels[at] = 0;
            if (!frame->depth_f32.pixels.empty()) frame->depth_f32.pixels[at] = 0;
        }
}

}  // namespace

Span Disturbance::span() const {
    if (dropout > 0 || skip > 1 || !any()) return {0, 1 << 30};
    Span all;
    for (const Span& s : {blank, hand, plane})
        if (!s.empty())
            all = all.empty() ? s : Span{std::min(all.first, s.first), std::max(all.last, s.last)};
    return all;
}

void disturb(const Disturbance& d, int step, Frame* frame) {
    if (d.dropout > 0) {
        drop(frame->depth_u16.pixels, step, d.dropout);
        drop(frame->depth_f32.pixels, step, d.dropout);
    }
    if (d.plane.has(step)) keep_largest_plane(step, frame);
    if (d.hand.has(step)) {
        const double value = kHandM / frame->depth_unit_m;
        cover(frame->depth_u16.pixels, frame->depth_u16.width, 1, static_cast<std::uint16_t>(value + 0.5));
        cover(frame->depth_f32.pixels, frame->depth_f32.width, 1, static_cast<float>(value));
        cover(frame->colour.pixels, frame->colour.width, 3, kSkin);
    }
    if (d.blank.has(step)) {
        std::fill(frame->depth_u16.pixels.begin(), frame->depth_u16.pixels.end(), std::uint16_t{0});
        std::fill(frame->depth_f32.pixels.begin(), frame->depth_f32.pixels.end(), 0.0f);
        frame->colour = {};
    }
}

}  // namespace burin::bench
