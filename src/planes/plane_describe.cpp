// SPDX-License-Identifier: MIT
// Step three of Dzitsiuk et al. (ICRA 2017), beside the de-noising: extents, completion and labels of planes.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "planes/classify.h"
#include "planes/plane_layer.h"
#include "simd/tsdf.h"

namespace burin {
namespace {

constexpr std::uint16_t kFillWeight =
    simd::kWeightOne;  // one observation: known to a mesh, outweighed by the first look
// Voxels around a completed plane that take its distances: the corners of the cells that it crosses, and what
// their normals read.
constexpr double kFillVoxels = 3.5;
constexpr int kFillReach = 3;  // layers of voxels that this needs, at either side of the plane's

}  // namespace

void PlaneLayer::note_camera(const Se3& T_world_camera) {
    cameras_.up = cameras_.up - T_world_camera.R.column(1);
    cameras_.position = cameras_.position + T_world_camera.t;
    ++cameras_.count;
}

void PlaneLayer::describe(const Volume& volume, const Vec3d* up_world) {
    for (std::uint32_t entry = 0; entry < overlay_.count(); ++entry) chunks_[entry].fills = 0;
    int count = 0;
    std::uint32_t points = 0;
    for (std::uint32_t i = 0; i < set_.used(); ++i) {
        if (!told(set_.at(i))) continue;
        const auto place = static_cast<std::uint16_t>(i);
        ExtentGrid grid;
        PlaneShape& shape = shapes_[count];
        shape = {};
        shape.normal = set_.at(i).normal;
        shape.offset = set_.at(i).offset;
        shape.area_m2 = set_.at(i).area_m2;
        shape.outline = outlines_ + points;
        places_[count++] = place;
        if (!extents_.raster(overlay_, chunks_, set_, place, &grid)) continue;
        shape.area_m2 = set_.at(i).seen_area_m2 = static_cast<double>(grid.seen_cells()) * grid.cell_area();
        OutlineCounts counts;
        const Outline outline = extents_.outline(grid, mask_of(kCellSeen), &counts);
        for (std::uint64_t p = 0; p < counts.points && points < kOutlinePoints; ++p, ++shape.outline_count)
            outlines_[points++] = to_float(grid.point(outline.points[p].u, outline.points[p].v));
        if (extents_.complete(volume, overlay_, chunks_, set_, place, grid) > 0) keep_fills(place, grid);
    }
    const Vec3d middle = cameras_.position * (cameras_.count > 0 ? 1 / cameras_.count : 0);
    labelled_up_ = {0, 0, 1};
    if (up_world)
        labelled_up_ = *up_world;
    else if (has_up_)
        labelled_up_ = up_;
    else if (norm(cameras_.up) > 0)
        labelled_up_ = estimate_up(shapes_, count, normalised(cameras_.up));
    classify_planes(shapes_, count, labelled_up_, cameras_.count > 0 ? &middle : nullptr, boxes_, labels_);
    for (int i = 0; i < count; ++i) set_.at(places_[i]).label = labels_[i];
    described_ = count;
}

// The filled cells of a plane become columns of the chunks that it passes.
void PlaneLayer::keep_fills(std::uint16_t plane, const ExtentGrid& g) {
    const double voxel = static_cast<double>(shape_.voxel_m);
    const auto keep = [&](Vec3i x) {
        const Vec3i c = chunk_of_voxel(x);
        if (!chunk_in_range(c)) return;
        const std::uint32_t known = overlay_.count(), entry = overlay_.insert(pack_key(c));
        if (entry == kNoChunk) {
            ++dropped_;
            return;
        }
        ChunkPlanes& chunk = chunks_[entry];
        if (entry == known) chunk.begin();
        int f = 0;
        while (f < chunk.fills && chunk.fill_plane[f] != plane) ++f;
        if (f == kChunkFills) return;  // where three planes meet two are enough
        if (f == chunk.fills) {
            chunk.fill_plane[f] = plane;
            chunk.fill_cells[f] = 0;
            ++chunk.fills;
        }
        chunk.fill_cells[f] |= std::uint64_t{1} << (8 * (x[g.along] & 7) + (x[g.across] & 7));
    };
    for (int v = 0; v < g.grid.height; ++v)
        for (int u = 0; u < g.grid.width; ++u) {
            if (g.grid.row(v)[u] != kCellFilled) continue;
            for (int s = 0; s < g.step * g.step; ++s) {
                Vec3i x;
                x[g.across] = (g.u0 + u) * g.step + s % g.step;
                x[g.along] = (g.v0 + v) * g.step + s / g.step;
                const double at = -(g.offset + g.normal[g.across] * (x[g.across] + 0.5) * voxel +
                                    g.normal[g.along] * (x[g.along] + 0.5) * voxel) /
                                  (g.normal[g.axis] * voxel);
                const auto layer = static_cast<std::int32_t>(std::floor(at));
                // Seven layers are in one chunk or in two.
                x[g.axis] = layer - kFillReach;
                keep(x);
                if ((layer - kFillReach) >> 3 == (layer + kFillReach) >> 3) continue;
                x[g.axis] = layer + kFillReach;
                keep(x);
            }
        }
}

// Voxels that were never seen, in the columns that planes complete, take the distance to the plane.
void PlaneLayer::fill(std::uint32_t entry, float units_to_m) {
    const ChunkPlanes& chunk = chunks_[entry];
    ChunkGeometry& out = overlay_.geometry(entry);
    const Vec3d centre = centre_of(overlay_.key(entry));
    const double voxel = static_cast<double>(shape_.voxel_m);
    const double units_per_voxel = voxel / static_cast<double>(units_to_m);
    for (int f = 0; f < chunk.fills; ++f) {
        const GlobalPlane& plane = set_.at(chunk.fill_plane[f]);
        if (plane.id == 0) continue;
        const Axes axes(plane.normal);
        for (int i = 0; i < kChunkVoxels; ++i) {
            const int at[3] = {i & 7, i >> 3 & 7, i >> 6};
            if (out.weight[i] != 0 || !(chunk.fill_cells[f] >> (8 * at[axes.second] + at[axes.first]) & 1))
                continue;
            const Vec3d x = centre + Vec3d{at[0] - 3.5, at[1] - 3.5, at[2] - 3.5} * voxel;
            const double voxels = plane.distance(x) / voxel;
            if (std::fabs(voxels) > kFillVoxels) continue;
            const double units = std::floor(voxels * units_per_voxel + 0.5);
            out.sdf[i] = static_cast<std::int16_t>(std::clamp(units, -32767.0, 32767.0));
            out.weight[i] = kFillWeight;
        }
    }
}

void PlaneLayer::draw_alone(const Volume& volume) {
    for (std::uint32_t entry = 0; entry < overlay_.count(); ++entry) {
        if (volume.find(overlay_.key(entry)) != kNoChunk) continue;
        ChunkPlanes& chunk = chunks_[entry];
        overlay_.set_alone(entry, chunk.fills > 0);
        if (chunk.fills == 0) continue;
        std::memset(&overlay_.geometry(entry), 0, sizeof(ChunkGeometry));
        fill(entry, volume.units_to_m());
        chunk.pulled = chunk.fills;
        std::copy_n(chunk.fill_plane, chunk.fills, chunk.pull);
    }
}

Outline PlaneLayer::outline(std::uint16_t plane, bool completed, ExtentGrid* grid, OutlineCounts* counts) {
    *counts = {};
    if (!extents_.raster(overlay_, chunks_, set_, plane, grid)) return {};
    if (completed)
        for (int v = 0; v < grid->grid.height; ++v)
            for (int u = 0; u < grid->grid.width; ++u) {
                std::uint8_t& cell = grid->grid.row(v)[u];
                if (cell == kCellUnknown && covers(plane, grid->point(u + 0.5, v + 0.5))) cell = kCellFilled;
            }
    const int both = mask_of(kCellSeen) | mask_of(kCellFilled);
    return extents_.outline(*grid, static_cast<CellMask>(both), counts);
}

bool PlaneLayer::covers(std::uint32_t p, Vec3d x) const {
    const double voxel = static_cast<double>(shape_.voxel_m);
    Vec3i at;
    if (!voxel_at(x, voxel, &at)) return false;
    const auto bit = [&](int axis) {
        const Axes axes(axis);
        return std::uint64_t{1} << (8 * (at[axes.second] & 7) + (at[axes.first] & 7));
    };
    const int axis = Axes(set_.at(p).normal).axis;
    // The surface may have been seen a voxel beside the plane, in the next chunk.
    for (int side = -1; side <= 1; ++side) {
        Vec3i y = at;
        y[axis] += side;
        const std::uint32_t entry = overlay_.find(pack_key(chunk_of_voxel(y)));
        if (entry == kNoChunk) continue;
        const ChunkPlanes& chunk = chunks_[entry];
        for (int i = 0; i < chunk.count; ++i)
            if (chunk.patch[i].plane == p && chunk.patch[i].cells & bit(chunk.patch[i].axis)) return true;
        for (int f = 0; f < chunk.fills; ++f)
            if (chunk.fill_plane[f] == p && chunk.fill_cells[f] & bit(axis)) return true;
    }
    return false;
}

std::uint16_t PlaneLayer::hit(Vec3d origin, Vec3d direction, double max_m, double* distance_m) const {
    std::uint16_t best = kNoPlane;
    *distance_m = max_m;
    for (std::uint32_t i = 0; i < set_.used(); ++i) {
        const GlobalPlane& plane = set_.at(i);
        const double towards = dot(plane.normal, direction);
        if (!told(plane) || !(towards < 0)) continue;
        const double t = -plane.distance(origin) / towards;
        if (!(t >= 0 && t < *distance_m) || !covers(i, origin + direction * t)) continue;
        *distance_m = t;
        best = static_cast<std::uint16_t>(i);
    }
    return best;
}

}  // namespace burin
