// SPDX-License-Identifier: MIT
// The specification of the kernels of reproject.h.
#include "simd/reproject.h"

#include <algorithm>

namespace burin::simd {
namespace {

struct Landed {
    float u, v, extent, z;
};

// False: lands nowhere.
inline bool land(const std::uint16_t* depths, int column, int row, const RayRow* rays, const Reprojection& by,
                 Landed* to) {
    const std::uint16_t depth = depths[column];
    const float x = rays ? rays->x[column] : static_cast<float>(column);
    const float y = rays ? rays->y[column] : static_cast<float>(row);
    const float* h = by.h;
    const float z = static_cast<float>(depth);
    const float U = (h[0] * x + (h[1] * y + h[2])) * z + by.t[0];
    const float V = (h[3] * x + (h[4] * y + h[5])) * z + by.t[1];
    const float Z = (h[6] * x + (h[7] * y + h[8])) * z + by.t[2];
    if (depth == 0 || depth == 65535 || !(Z >= by.nearest && Z < 65534.5f)) return false;
    const float i = 1.0f / Z;
    float u = U * i, v = V * i, e = z * i;
    if (rays) e = e * rays->span[column];
    if (by.distorted) {
        const float xx = u * u, yy = v * v, two_xy = 2.0f * (u * v), r2 = xx + yy;
        if (!(r2 <= by.most_r2)) return false;
        const float radial = 1.0f + r2 * (by.k1 + r2 * (by.k2 + r2 * by.k3));
        const float slope = 1.0f + r2 * (3.0f * by.k1 + r2 * (5.0f * by.k2 + r2 * (7.0f * by.k3)));
        e = e * std::max(std::max(radial, slope), 0.0f);
        const float du = u * radial + (by.p1 * two_xy + by.p2 * (r2 + 2.0f * xx));
        const float dv = v * radial + (by.p1 * (r2 + 2.0f * yy) + by.p2 * two_xy);
        u = by.fx * du + by.cx;
        v = by.fy * dv + by.cy;
    }
    *to = {u, v, e, Z};
    return true;
}

struct Span {
    int first, count;
};
// The cells of 0..size-1 whose centres lie in [centre - half, centre + half).
inline Span span_of(float centre, float half, int size) {
    const int away = size + 32;
    const float k = static_cast<float>(away);
    const float c = std::min(std::max(centre - k, -k - 16.0f), -16.0f);  // 16: more than any half
    const auto limited = [&](float edge) { return std::clamp(static_cast<int>(edge), -away, size - away); };
    const int first = limited(c - half);
    return {first + away, limited(c + half) - first};
}

}  // namespace

namespace scalar {

void footprints_row(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
                    const Footprints& out) {
    const int padded = (width + kFootprintBatch - 1) / kFootprintBatch * kFootprintBatch;
    for (int i = 0; i < padded; ++i) {
        std::int32_t cell = 0;
        std::uint32_t what = kNowhere;
        Landed at;
        if (i < width && land(depth, i, y, rays, by, &at)) {
            const Span columns = span_of(at.u, std::min(by.half_u * at.extent, kMostHalf), by.width);
            const Span rows = span_of(at.v, std::min(by.half_v * at.extent, kMostHalf), by.height);
            if (columns.count > 0 && rows.count > 0) {
                cell = rows.first * by.pitch + columns.first;
                what = static_cast<std::uint32_t>(at.z - 0.5f) << 16 |
                       static_cast<std::uint32_t>(rows.count << 8 | columns.count);
            }
        }
        out.cell[i] = cell;
        out.what[i] = what;
    }
}

void cells_row(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
               std::int32_t* cell, std::uint16_t* depth_there) {
    const int padded = (width + kFootprintBatch - 1) / kFootprintBatch * kFootprintBatch;
    for (int i = 0; i < padded; ++i) {
        // Each stored once: with a first store of "nowhere" GCC 12.2 at -O3 loses the second one.
        std::int32_t found = 0;
        std::uint16_t there = 0;
        Landed at;
        if (i < width && land(depth, i, y, rays, by, &at)) {
            const float u = at.u + 0.5f, v = at.v + 0.5f;
            if (u >= 0 && v >= 0 && u < static_cast<float>(by.width) && v < static_cast<float>(by.height)) {
                found = static_cast<int>(v) * by.pitch + static_cast<int>(u);
                there = static_cast<std::uint16_t>(static_cast<int>(at.z - 0.5f) + 1);
            }
        }
        cell[i] = found;
        depth_there[i] = there;
    }
}

void splat_row(const Footprints& row, int width, const Reprojection& by, std::uint16_t* target) {
    for (int i = 0; i < width; ++i) {
        const int columns = row.what[i] & 255, rows = row.what[i] >> 8 & 255;
        const auto less_one = static_cast<std::uint16_t>(row.what[i] >> 16);
        std::uint16_t* at = target + row.cell[i];
        for (int v = 0; v < rows; ++v, at += by.pitch)
            for (int u = 0; u < columns; ++u) at[u] = std::min(at[u], less_one);
    }
}

void add_one(std::uint16_t* values, int count) {
    for (int i = 0; i < count; ++i) ++values[i];
}

}  // namespace scalar

void colours_row(const std::int32_t* cell, const std::uint16_t* depth_there, int width,
                 const ColourSource& source, std::uint8_t* rgb, std::uint8_t* mask) {
    const ColourSource from = source;  // which the bytes stored below cannot change
    // A multiplication in double in place of a division: below 2^28 cells the half keeps it on the right side
    // of every row's end.
    const double rows_per_cell = 1.0 / from.pitch;
    const std::ptrdiff_t skip = from.rgb_stride - std::ptrdiff_t{3} * from.pitch;
    for (int i = 0; i < width; ++i, rgb += 3) {
        const int c = cell[i];
        const int front = from.registered[c], there = depth_there[i];
        // One condition, no jumps: what is hidden lies in no order.
        const bool before = (front != 0) & (there > front + from.slack + there / 64);
        const auto keep = static_cast<std::uint8_t>(-static_cast<int>((there != 0) & !before));
        std::ptrdiff_t at = std::ptrdiff_t{3} * c;
        if (skip != 0) at += static_cast<int>((c + 0.5) * rows_per_cell) * skip;
        rgb[0] = from.rgb[at] & keep;
        rgb[1] = from.rgb[at + 1] & keep;
        rgb[2] = from.rgb[at + 2] & keep;
        mask[i] = keep;
    }
}

#if defined(BURIN_SCALAR_ONLY)
void footprints_row(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
                    const Footprints& out) {
    scalar::footprints_row(depth, width, y, rays, by, out);
}
void cells_row(const std::uint16_t* depth, int width, int y, const RayRow* rays, const Reprojection& by,
               std::int32_t* cell, std::uint16_t* depth_there) {
    scalar::cells_row(depth, width, y, rays, by, cell, depth_there);
}
void splat_row(const Footprints& row, int width, const Reprojection& by, std::uint16_t* target) {
    scalar::splat_row(row, width, by, target);
}
void add_one(std::uint16_t* values, int count) { scalar::add_one(values, count); }
#endif

}  // namespace burin::simd
