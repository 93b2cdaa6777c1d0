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
constexpr int kFillReach = 3;   // layers of voxels that this needs, at either side of the plane's
constexpr int kClearReach = 6;  // and in front of it, with those that are cleared
// In front of a completed plane, so far, and beside it, what lies inside something else is no longer known:
// so no surface closes between the two. Voxels from the plane.
constexpr double kClearVoxels = 5.5;

}  // namespace

void PlaneLayer::note_camera(const Se3& T_world_camera) {
    cameras_.up = cameras_.up - T_world_camera.R.column(1);
    cameras_.position = cameras_.position + T_world_camera.t;
    ++cameras_.count;
}

MapCameras PlaneLayer::cameras() const {
    const Vec3d up = has_up_ ? up_ : cameras_.up, at = cameras_.position;
    return {{up.x, up.y, up.z}, {at.x, at.y, at.z}, cameras_.count, has_up_ ? 1.0 : 0.0};
}

void PlaneLayer::set_cameras(const MapCameras& c) {
    const Vec3d up{c.up[0], c.up[1], c.up[2]};
    cameras_ = {c.up_is_sure != 0 ? Vec3d{} : up, {c.position[0], c.position[1], c.position[2]}, c.count};
    has_up_ = c.up_is_sure != 0;
    if (has_up_) up_ = up;
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
    const auto keep = [&](Vec3i x, bool rim) {
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
            chunk.fill_cells[f] = chunk.fill_rim[f] = 0;
            ++chunk.fills;
        }
        (rim ? chunk.fill_rim : chunk.fill_cells)[f] |= std::uint64_t{1}
                                                        << (8 * (x[g.along] & 7) + (x[g.across] & 7));
    };
    const auto filled = [&](int u, int v) {
        return u >= 0 && v >= 0 && u < g.grid.width && v < g.grid.height && g.grid.row(v)[u] == kCellFilled;
    };
    for (int v = 0; v < g.grid.height; ++v)
        for (int u = 0; u < g.grid.width; ++u) {
            bool rim = false;
            if (!filled(u, v)) {
                for (int n = 0; n < 9 && !rim; ++n) rim = filled(u + n % 3 - 1, v + n / 3 - 1);
                if (!rim) continue;
            }
            for (int s = 0; s < g.step * g.step; ++s) {
                Vec3i x;
                x[g.across] = (g.u0 + u) * g.step + s % g.step;
                x[g.along] = (g.v0 + v) * g.step + s / g.step;
                const double at = -(g.offset + g.normal[g.across] * (x[g.across] + 0.5) * voxel +
                                    g.normal[g.along] * (x[g.along] + 0.5) * voxel) /
                                  (g.normal[g.axis] * voxel);
                const auto layer = static_cast<std::int32_t>(std::floor(at));
                // These layers are in one chunk or in two.
                const int up = g.normal[g.axis] > 0 ? 1 : -1;
                x[g.axis] = layer - kFillReach * up;
                keep(x, rim);
                const std::int32_t last = layer + kClearReach * up;
                if (x[g.axis] >> 3 == last >> 3) continue;
                x[g.axis] = last;
                keep(x, rim);
            }
        }
}

// Voxels that were never seen, and those that are inside something else (extents.cpp has made sure that no
// surface of it is near), take the distance to the plane in the columns that it completes.
void PlaneLayer::fill(std::uint32_t entry, float units_to_m) {
    const ChunkPlanes& chunk = chunks_[entry];
    ChunkGeometry& out = overlay_.geometry(entry);
    const Vec3d centre = centre_of(overlay_.key(entry));
    const double voxel = static_cast<double>(shape_.voxel_m);
    const double units_per_voxel = voxel / static_cast<double>(units_to_m);
    std::int8_t by[kChunkVoxels];  // which fill a voxel is of
    std::memset(by, -1, sizeof by);
    for (int f = 0; f < chunk.fills; ++f) {
        const GlobalPlane& plane = set_.at(chunk.fill_plane[f]);
        if (plane.id == 0) continue;
        const Axes axes(plane.normal);
        for (int i = 0; i < kChunkVoxels; ++i) {
            const int at[3] = {i & 7, i >> 3 & 7, i >> 6};
            const int column = 8 * at[axes.second] + at[axes.first];
            const bool own = chunk.fill_cells[f] >> column & 1;
            if (!own && !(chunk.fill_rim[f] >> column & 1)) continue;
            const Vec3d x = centre + Vec3d{at[0] - 3.5, at[1] - 3.5, at[2] - 3.5} * voxel;
            const double voxels = plane.distance(x) / voxel;
            const bool known = out.weight[i] != 0, inside = known && voxels > 0 && out.sdf[i] < 0;
            // One completed plane just behind another: the one in front counts. Elsewhere the first.
            const bool behind =
                by[i] >= 0 && dot(set_.at(chunk.fill_plane[by[i]]).normal, plane.normal) < 0.9;
            if (behind || (by[i] < 0 && known && !inside)) continue;
            if (!own || std::fabs(voxels) > kFillVoxels) {
                if (by[i] < 0 && inside && voxels < kClearVoxels) out.weight[i] = 0;
                continue;
            }
            const auto units = static_cast<std::int16_t>(
                std::clamp(std::floor(voxels * units_per_voxel + 0.5), -32767.0, 32767.0));
            out.sdf[i] = by[i] < 0 ? units : std::min(out.sdf[i], units);
            out.weight[i] = kFillWeight;
            by[i] = static_cast<std::int8_t>(f);
        }
    }
}

// The meshes of what lies around a chunk read its voxels.
void PlaneLayer::mark_around(Volume& volume, ChunkKey key) {
    const Vec3i c = unpack_key(key);
    for (int i = 0; i < 27; ++i) {
        const Vec3i beside{c.x + i % 3 - 1, c.y + i / 3 % 3 - 1, c.z + i / 9 - 1};
        if (!chunk_in_range(beside)) continue;
        if (const std::uint32_t slot = volume.find(pack_key(beside)); slot != kNoChunk) {
            volume.flags(slot) |= kChunkStale;
            volume.mesh_lag(slot) = 65535;
            continue;
        }
        const std::uint32_t entry = overlay_.find(pack_key(beside));
        if (entry != kNoChunk && (overlay_.alone(entry) || i == 13)) overlay_.set_stale(entry, true);
    }
}

void PlaneLayer::draw_alone(Volume& volume) {
    for (std::uint32_t entry = 0; entry < overlay_.count(); ++entry) {
        if (volume.find(overlay_.key(entry)) != kNoChunk) continue;
        ChunkPlanes& chunk = chunks_[entry];
        const bool was = overlay_.alone(entry), is = chunk.fills > 0;
        if (!was && !is) continue;
        overlay_.set_alone(entry, is);
        ChunkGeometry& geometry = overlay_.geometry(entry);
        const ChunkGeometry before = geometry;
        std::memset(&geometry, 0, sizeof geometry);
        fill(entry, volume.units_to_m());
        chunk.pulled = chunk.fills;
        std::copy_n(chunk.fill_plane, chunk.fills, chunk.pull);
        if (was != is || std::memcmp(&before, &geometry, sizeof geometry) != 0)
            mark_around(volume, overlay_.key(entry));
    }
}

std::uint32_t PlaneLayer::list_stale(const Volume& volume, const std::uint32_t** entries) {
    std::uint32_t count = 0;
    for (std::uint32_t entry = 0; options_.enabled && entry < overlay_.count(); ++entry)
        if (overlay_.stale(entry) && volume.find(overlay_.key(entry)) == kNoChunk) members_[count++] = entry;
    std::sort(members_, members_ + count,
              [this](std::uint32_t a, std::uint32_t b) { return overlay_.key(a) < overlay_.key(b); });
    *entries = members_;
    return count;
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
