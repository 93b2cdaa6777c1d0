// SPDX-License-Identifier: MIT
// True planes as grids of cells that say where their surface lies open, and which of them is near a point.
#pragma once

#include <cstdint>
#include <functional>
#include <unordered_map>
#include <vector>

#include "core/jobs.h"
#include "core/triangle_mesh.h"
#include "eval/plane_metrics.h"
#include "eval/plane_raster.h"

namespace burin {

// What is known of a scene. The functions are called from several threads at once.
struct PlaneTruth {
    std::vector<LabelledPlane> planes;
    std::function<double(Vec3d)>
        distance_m;  // signed, negative inside; exact outside, inside only its sign is used
    std::function<double(Vec3d)> surface_distance_m;  // the sign is ignored; exact within centimetres
    std::function<std::uint8_t(Vec3d)> label;         // of the surface nearest to a point
};

struct TrueExtentOptions {
    double min_area_m2 = 0.25;  // true planes of which less was seen do not count: no cell of them is open
    double voxel_m = 0.005;
    double cell_m = 0.01;
    double flat_margin_voxels = 3;  // from a flat cell to the outline, and to any other surface
    double near_voxels = 4;         // a point this near to a plane may belong to it: the truncation of a map
};

struct TrueExtent {
    PlaneRaster cells;  // inside: within the true outline, which is convex and may hide parts
    // Of every cell: open, when its centre is on the surface (not inside or under another solid, nor where
    // the outline spans a gap); flat, when moreover all cells within the margin are open and nothing hangs
    // over it.
    std::vector<std::uint8_t> open, flat;
};

class TrueExtents {
  public:
    TrueExtents(const PlaneTruth& truth, const TrueExtentOptions& options, Jobs& jobs);

    const TrueExtent& operator[](std::size_t plane) const { return extents_[plane]; }
    std::size_t size() const { return extents_.size(); }
    const TrueExtentOptions& options() const { return options_; }
    double near_m() const { return options_.near_voxels * options_.voxel_m; }

    bool counts(std::size_t plane) const { return planes_[plane].seen_area_m2 >= options_.min_area_m2; }

    // The planes whose outline may lie within near_m() of a point.
    const std::vector<std::uint32_t>& near(Vec3d p) const;
    // The plane nearest to p among those with p within near_m() of a cell that `accept`(extent, cell) takes;
    // -1 when there is none. *distance_m is signed.
    template <class Accept>
    int plane_at(Vec3d p, const Accept& accept, double* distance_m) const {
        int best = -1;
        for (const std::uint32_t t : near(p)) {
            const double d = dot(planes_[t].normal, p) + planes_[t].offset;
            if (!(std::fabs(d) <= near_m()) || (best >= 0 && std::fabs(d) >= std::fabs(*distance_m)))
                continue;
            const std::ptrdiff_t cell = extents_[t].cells.cell_at(p);
            if (cell < 0 || !accept(extents_[t], t, static_cast<std::size_t>(cell))) continue;
            best = static_cast<int>(t);
            *distance_m = d;
        }
        return best;
    }

  private:
    void index(std::size_t plane);

    TrueExtentOptions options_;
    std::vector<LabelledPlane> planes_;
    std::vector<TrueExtent> extents_;
    std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> near_;  // of a cube of space: its planes
};

// Calls body(point, area_m2) for the centres of equal parts of a triangle no longer than spacing_m, no more
// than 65536 of them.
template <class Body>
void for_parts(Vec3d a, Vec3d b, Vec3d c, double spacing_m, const Body& body) {
    const Vec3d ab = b - a, ac = c - a;
    const double longest = std::max(norm(ab), std::max(norm(ac), norm(c - b)));
    constexpr double kMostParts = 256;  // along a side
    const int n = static_cast<int>(std::min(kMostParts, std::max(1.0, std::ceil(longest / spacing_m))));
    const double area = 0.5 * norm(cross(ab, ac)) / (static_cast<double>(n) * n), step = 1.0 / n;
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n - j; ++i) {
            body(a + ab * ((i + 1 / 3.0) * step) + ac * ((j + 1 / 3.0) * step), area);
            if (i + j + 1 < n) body(a + ab * ((i + 2 / 3.0) * step) + ac * ((j + 2 / 3.0) * step), area);
        }
}

}  // namespace burin
