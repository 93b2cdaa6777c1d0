// SPDX-License-Identifier: MIT
#include "capture/register.h"

#include <algorithm>
#include <cmath>
#include <new>

namespace burin {
namespace {

// What depth pixels cover in the colour image is widened by this share. Two neighbours on a surface that
// leans by 45 degrees part by baseline / distance of a pixel: 50 mm at 0.8 m.
constexpr double kMargin = 1.0 / 16;
// A surface is behind another when it is further by more than this and 1/64: noise of a structured-light
// sensor at 1 m.
constexpr double kSlack_m = 0.01;
// Nearer than any sensor sees; footprints would grow without bound.
constexpr double kNearest_m = 0.02;

// What the colour image shows at most, as x^2 + y^2 of normalised coordinates.
double most_r2_of(const Camera& c) {
    double most = 0;
    constexpr int kSteps = 32;
    for (int i = 0; i <= kSteps; ++i) {
        const double u = -0.5 + c.width * (static_cast<double>(i) / kSteps);
        const double v = -0.5 + c.height * (static_cast<double>(i) / kSteps);
        for (const Pixel p :
             {Pixel{u, -0.5}, Pixel{u, c.height - 0.5}, Pixel{-0.5, v}, Pixel{c.width - 0.5, v}}) {
            const Vec3d ray = unproject(c, p);
            most = std::max(most, ray.x * ray.x + ray.y * ray.y);
        }
    }
    most *= 1.02;  // a footprint's half beyond the border
    // Not beyond where the polynomial turns back.
    constexpr int kRadii = 256;
    for (int i = 1; i <= kRadii; ++i) {
        const double r2 = most * i / kRadii;
        if (!(1 + r2 * (3 * c.k1 + r2 * (5 * c.k2 + r2 * 7 * c.k3)) > 0)) return most * (i - 1) / kRadii;
    }
    return most;
}

}  // namespace

Status ImageRegistration::configure(const Camera& depth, double depth_unit_m, const Camera& colour,
                                    const Se3& T_colour_depth) {
    rows_.reset();
    rays_.reset();
    BURIN_TRY(check_camera(depth, "depth"));
    BURIN_TRY(check_camera(colour, "colour"));
    if (!(depth_unit_m >= 1e-6 && depth_unit_m <= 1))
        return Status::error(Code::invalid_argument,
                             "registration: unit of depth is %g m, expected 1e-6 to 1", depth_unit_m);
    const Se3& T = T_colour_depth;
    double largest = 0;
    for (const double r : T.R.m) largest = std::max(largest, std::fabs(r) <= 1.01 ? 0 : 1e9);
    if (!(largest == 0 && norm(T.t) <= 10))
        return Status::error(
            Code::invalid_argument,
            "registration: depth to colour is %g %g %g m, expected a rotation and at most 10 m", T.t.x, T.t.y,
            T.t.z);
    depth_ = depth;
    colour_ = colour;
    by_ = {};
    by_.width = colour.width;
    by_.height = colour.height;
    const bool distorted = by_.distorted = colour.distorted();
    const Mat3d K = distorted ? Mat3d{} : Mat3d{{colour.fx, 0, colour.cx, 0, colour.fy, colour.cy, 0, 0, 1}};
    const Mat3d from_pixel = {
        {1 / depth.fx, 0, -depth.cx / depth.fx, 0, 1 / depth.fy, -depth.cy / depth.fy, 0, 0, 1}};
    const Mat3d h = K * T.R * from_pixel;
    const Vec3d t = K * (T.t * (1 / depth_unit_m));
    for (int i = 0; i < 9; ++i) by_.h[i] = static_cast<float>(h.m[i]);
    for (int i = 0; i < 3; ++i) by_.t[i] = static_cast<float>(t[i]);
    // Half the span of a pixel along u: derivatives along x and y where they are largest. The smaller one
    // counts only from a roll of 4 degrees on, or each pixel of upright cameras would cover two rows.
    double half[2] = {};
    for (const double x : {0.0, 0.5, 1.0})
        for (const double y : {0.0, 0.5, 1.0}) {
            const Vec3d q = h * Vec3d{x * depth.width, y * depth.height, 1};
            if (!(q.z > 0.1)) continue;  // looks away from there
            for (int k = 0; k < 2; ++k) {
                const double at = q[k] / q.z;
                const double along = std::fabs(h(k, 0) - at * h(2, 0)),
                             across = std::fabs(h(k, 1) - at * h(2, 1));
                const double least = std::min(along, across), most = std::max(along, across);
                half[k] = std::max(half[k], 0.5 * (1 + kMargin) * (most + (least > most / 16 ? least : 0)));
            }
        }
    by_.half_u = static_cast<float>(half[0] * (distorted ? colour.fx : 1));
    by_.half_v = static_cast<float>(half[1] * (distorted ? colour.fy : 1));
    by_.nearest = static_cast<float>(std::clamp(kNearest_m / depth_unit_m, 1.0, 65534.0));
    slack_ = static_cast<int>(std::min(kSlack_m / depth_unit_m, 65535.0));
    by_.fx = static_cast<float>(colour.fx);
    by_.fy = static_cast<float>(colour.fy);
    by_.cx = static_cast<float>(colour.cx);
    by_.cy = static_cast<float>(colour.cy);
    by_.k1 = static_cast<float>(colour.k1);
    by_.k2 = static_cast<float>(colour.k2);
    by_.k3 = static_cast<float>(colour.k3);
    by_.p1 = static_cast<float>(colour.p1);
    by_.p2 = static_cast<float>(colour.p2);
    by_.most_r2 = distorted ? static_cast<float>(most_r2_of(colour)) : 0.0f;

    const std::size_t padded = (static_cast<std::size_t>(depth.width) + simd::kFootprintBatch - 1) /
                               simd::kFootprintBatch * simd::kFootprintBatch;
    const std::size_t pixels = static_cast<std::size_t>(depth.width) * static_cast<std::size_t>(depth.height);
    std::unique_ptr<std::uint32_t[]> rows(new (std::nothrow) std::uint32_t[2 * padded]);
    if (depth.distorted()) rays_.reset(new (std::nothrow) float[3 * pixels]);
    if (!rows || (depth.distorted() && !rays_))
        return Status::error(Code::insufficient_memory, "registration: no memory for %dx%d pixels",
                             depth.width, depth.height);
    footprints_.cell = reinterpret_cast<std::int32_t*>(rows.get());
    footprints_.what = rows.get() + padded;
    there_ = reinterpret_cast<std::uint16_t*>(footprints_.what);  // one or the other
    rows_ = std::move(rows);
    if (rays_) fill_rays();
    return {};
}

void ImageRegistration::fill_rays() {
    const Camera& c = depth_;
    const auto at = [&](double u, double v) {
        const Vec3d r = unproject(c, {u, v});
        return Pixel{c.fx * r.x + c.cx, c.fy * r.y + c.cy};
    };
    const std::size_t pixels = static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height);
    float *x = rays_.get(), *y = x + pixels, *span = y + pixels;
    for (int v = 0; v < c.height; ++v)
        for (int u = 0; u < c.width; ++u, ++x, ++y, ++span) {
            const Pixel p = at(u, v), right = at(u + 0.5, v), left = at(u - 0.5, v), below = at(u, v + 0.5),
                        above = at(u, v - 0.5);
            *x = static_cast<float>(p.u);
            *y = static_cast<float>(p.v);
            // A model that runs away beyond its image must not make pixels of any size.
            *span = static_cast<float>(
                std::clamp(std::max(std::fabs(right.u - left.u), std::fabs(below.v - above.v)), 0.25, 4.0));
        }
}

simd::RayRow ImageRegistration::rays(int y) const {
    if (!rays_) return {};
    const std::size_t width = static_cast<std::size_t>(depth_.width),
                      pixels = width * static_cast<std::size_t>(depth_.height);
    const float* row = rays_.get() + static_cast<std::size_t>(y) * width;
    return {row, row + pixels, row + 2 * pixels};
}

Status ImageRegistration::check(int depth_width, int depth_height, int width, int height,
                                std::ptrdiff_t pitch) const {
    if (!configured()) return Status::error(Code::state, "registration: not configured");
    if (depth_width != depth_.width || depth_height != depth_.height || width != colour_.width ||
        height != colour_.height || pitch < width || pitch > 32767)
        return Status::error(
            Code::invalid_argument,
            "registration: depth %dx%d, colour %dx%d in rows of %td, expected %dx%d and %dx%d in "
            "rows of at most 32767",
            depth_width, depth_height, width, height, pitch, depth_.width, depth_.height, colour_.width,
            colour_.height);
    return {};
}

Status ImageRegistration::depth_to_colour(View<const std::uint16_t> depth, View<std::uint16_t> out) {
    BURIN_TRY(check(depth.width, depth.height, out.width, out.height, out.stride));
    by_.pitch = static_cast<int>(out.stride);
    for (int y = 0; y < out.height; ++y) std::fill_n(out.row(y), out.width, std::uint16_t{65535});
    for (int y = 0; y < depth.height; ++y) {
        const simd::RayRow row = rays(y);
        simd::footprints_row(depth.row(y), depth.width, y, rays_ ? &row : nullptr, by_, footprints_);
        simd::splat_row(footprints_, depth.width, by_, out.data);
    }
    for (int y = 0; y < out.height; ++y) simd::add_one(out.row(y), out.width);
    return {};
}

Status ImageRegistration::colour_to_depth(View<const std::uint8_t> rgb, View<const std::uint16_t> depth,
                                          View<const std::uint16_t> registered, View<std::uint8_t> out,
                                          View<std::uint8_t> mask) {
    BURIN_TRY(check(depth.width, depth.height, registered.width, registered.height, registered.stride));
    BURIN_TRY(check(out.width, out.height, rgb.width, rgb.height, registered.stride));
    BURIN_TRY(check(mask.width, mask.height, rgb.width, rgb.height, registered.stride));
    by_.pitch = static_cast<int>(registered.stride);
    const simd::ColourSource from = {rgb.data, rgb.stride, registered.data, by_.pitch, slack_};
    for (int y = 0; y < depth.height; ++y) {
        const simd::RayRow row = rays(y);
        simd::cells_row(depth.row(y), depth.width, y, rays_ ? &row : nullptr, by_, footprints_.cell, there_);
        simd::colours_row(footprints_.cell, there_, depth.width, from, out.row(y), mask.row(y));
    }
    return {};
}

}  // namespace burin
