// SPDX-License-Identifier: MIT
// Kernels that bring the depth of one camera into the view of another, nearest surface first, and colours
// back: row by row of the depth image. Frames: capture/register.h.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin::simd {

// From a depth camera to a target camera. Lengths are in units of the depth image's readings.
struct Reprojection {
    int width = 0, height = 0;  // of the target image, 1..16384
    int pitch = 0;              // its cells from one row to the next, at most 32767
    // Row-major, K R inverse(K_depth): the undistorted pixel (x, y, 1) of the depth camera at depth 1 to (fx
    // X
    // + cx Z, fy Y + cy Z, Z) of the target, or to (X, Y, Z) when the target is distorted. And K t, or t.
    float h[9] = {}, t[3] = {};
    // Half of what a depth pixel covers in the target at the same depth in both, pixels; >= 0.
    float half_u = 0.5f, half_v = 0.5f;
    float nearest = 1;  // depth in the target; what is nearer is left out; 1..65535
    // Brown's distortion of the target, on normalised coordinates with x^2 + y^2 <= most_r2: beyond what the
    // image shows the polynomial may come back into it.
    bool distorted = false;
    float fx = 1, fy = 1, cx = 0, cy = 0, k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0, most_r2 = 0;
};

// A distorted depth camera's row: where its pixels are when undistorted, and how much longer they are there
// than in the middle, the longer side.
struct RayRow {
    const float *x, *y, *span;
};

// Where the pixels of one row of depth land: as many as the row has pixels, rounded up to kFootprintBatch.
// The cell is that of the target, y * pitch + x, in the upper left. What lands there: columns, rows times
// 256, and 65536 times the depth in the target minus 1, so that no depth, 0, becomes the largest. A pixel
// that lands nowhere has cell 0 and kNowhere.
inline constexpr int kFootprintBatch = 16;
inline constexpr std::uint32_t kNowhere = 0xffff0101u;
struct Footprints {
    std::int32_t* cell;
    std::uint32_t* what;
};
// Half of what a pixel covers at most, cells: one of 320 x 240 in a colour image of 4K, and never 256 of
// them.
inline constexpr float kMostHalf = 7.9f;

// Pixels of depth row y: 0 and 65535 are no depth. x and y of the undistorted pixel are the column and `y`,
// or with rays (null: none) theirs. With z the depth and (a, b, c) = h (x, y, 1), summed as h0 x + (h1 y +
// h2):
//   (U, V, Z) = (a z + t0, b z + t1, c z + t2), i = 1 / Z, u = U i, v = V i, e = z i, times the ray's span
// With distortion, r2 = u^2 + v^2, e is multiplied by the largest of the polynomial, its radial derivative
// and 0, and u and v are distorted and multiplied by the focal lengths. With a = min(e half_u, kMostHalf),
// the target cells whose centres lie in [u - a, u + a) are covered, likewise v: centres are compared as u -
// (width + 32), which is negative, so that conversion to an integer rounds up. Lands nowhere: Z < nearest, Z
// >= 65534.5, none covered. Depth there: floor(Z - 1/2) + 1.
void footprints_row(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
                    const Footprints& out);

// The same for one cell each, the nearest: (floor(u + 1/2), floor(v + 1/2)), and the depth there. Both 0 for
// a pixel that lands nowhere. As many as the row has pixels rounded up to kFootprintBatch.
void cells_row(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
               std::int32_t* cell, std::uint16_t* depth_there);

// The z-buffer: target[c] = min(target[c], depth - 1 of each footprint that covers c). The result does not
// depend on the order of rows. Cells between the rows of `target`, where its pitch is more than its width,
// are not touched. Of `by` size and pitch count.
void splat_row(const Footprints& row, int width, const Reprojection& by, std::uint16_t* target);

// values[i] += 1, modulo 2^16: the z-buffer to depth.
void add_one(std::uint16_t* values, int count);

// The colour of each pixel of depth by the cells of cells_row: 3 bytes from rgb + y * rgb_stride + 3 x, and
// 255 to mask[i], or 0 and 0 where depth_there is 0 or a surface in front hides it: registered[cell] != 0 and
// depth_there > registered[cell] + slack + depth_there / 64. `pitch` is that of the cells and of
// `registered`. No vectors in it.
struct ColourSource {
    const std::uint8_t* rgb;
    std::ptrdiff_t rgb_stride;  // bytes
    const std::uint16_t* registered;
    int pitch;
    int slack;  // units
};
void colours_row(const std::int32_t* cell, const std::uint16_t* depth_there, int width,
                 const ColourSource& from, std::uint8_t* rgb, std::uint8_t* mask);

namespace scalar {
void footprints_row(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
                    const Footprints& out);
void cells_row(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
               std::int32_t* cell, std::uint16_t* depth_there);
void splat_row(const Footprints& row, int width, const Reprojection& by, std::uint16_t* target);
void add_one(std::uint16_t* values, int count);
}  // namespace scalar

}  // namespace burin::simd
