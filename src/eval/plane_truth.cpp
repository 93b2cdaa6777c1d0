// SPDX-License-Identifier: MIT
#include "eval/plane_truth.h"

#include <algorithm>

namespace burin {
namespace {

constexpr double kCube = 0.2;  // metres, of the index: a few planes each, and more than near_m() of fine maps

std::uint64_t cube_key(double x, double y, double z) {
    // 21 bits each: 400 km
    const auto bits = [](double v) {
        return static_cast<std::uint64_t>(static_cast<std::int64_t>(v) + (1 << 20)) & 0x1fffff;
    };
    return bits(x) << 42 | bits(y) << 21 | bits(z);
}

}  // namespace

TrueExtents::TrueExtents(const PlaneTruth& truth, const TrueExtentOptions& options, Jobs& jobs)
    : options_(options), planes_(truth.planes), extents_(truth.planes.size()) {
    // A few planes are nearly all of the area, so threads share the rows of each rather than the planes.
    for (std::size_t t = 0; t < planes_.size(); ++t) {
        TrueExtent& e = extents_[t];
        e.cells = PlaneRaster(planes_[t].normal, planes_[t].offset, planes_[t].rings, options.cell_m);
        e.open.assign(e.cells.size(), 0);
        e.flat.assign(e.cells.size(), 0);
        index(t);
        if (!counts(t)) continue;
        std::vector<std::uint8_t> clear(e.cells.size(), 0);
        const Vec3d n = planes_[t].normal;
        const auto w = static_cast<std::size_t>(e.cells.width());
        const double margin = options.flat_margin_voxels * options.voxel_m;
        jobs.run(e.cells.height(), [&](int j, int) {
            for (std::size_t c = static_cast<std::size_t>(j) * w, end = c + w; c < end; ++c) {
                if (!e.cells.inside(c)) continue;
                const Vec3d p = e.cells.centre(c);
                // On the surface, and a point just above is as far from everything as from this plane.
                constexpr double kLift = 1e-4, kOn = 1e-6;
                if (!(std::fabs(truth.distance_m(p)) < kOn && truth.distance_m(p + n * kLift) > 0.9 * kLift))
                    continue;
                e.open[c] = 1;
                // The ball that touches the plane here, as large as the margin, is free: nothing hangs over
                // it.
                clear[c] = truth.distance_m(p + n * margin) > 0.99 * margin;
            }
        });
        // Within the margin of any point of the cell: half a diagonal on either side.
        const double reach = margin / e.cells.cell_m() + std::sqrt(2.0);
        const int r = static_cast<int>(reach);
        jobs.run(e.cells.height(), [&](int j, int) {
            for (int i = 0; i < e.cells.width(); ++i) {
                bool flat = clear[static_cast<std::size_t>(j) * w + static_cast<std::size_t>(i)];
                for (int y = j - r; y <= j + r && flat; ++y)
                    for (int x = i - r; x <= i + r && flat; ++x) {
                        if ((x - i) * (x - i) + (y - j) * (y - j) > reach * reach) continue;
                        flat = x >= 0 && y >= 0 && x < e.cells.width() && y < e.cells.height() &&
                               e.open[static_cast<std::size_t>(y) * w + static_cast<std::size_t>(x)];
                    }
                e.flat[static_cast<std::size_t>(j) * w + static_cast<std::size_t>(i)] = flat;
            }
        });
    }
}

void TrueExtents::index(std::size_t plane) {
    const TrueExtent& e = extents_[plane];
    const double reach = near_m() + e.cells.cell_m();
    for (std::size_t c = 0; c < e.cells.size(); ++c) {
        if (!e.cells.inside(c)) continue;
        const Vec3d p = e.cells.centre(c);
        double low[3], high[3];
        for (int k = 0; k < 3; ++k) {
            low[k] = std::floor((p[k] - reach) / kCube);
            high[k] = std::floor((p[k] + reach) / kCube);
        }
        for (double z = low[2]; z <= high[2]; ++z)
            for (double y = low[1]; y <= high[1]; ++y)
                for (double x = low[0]; x <= high[0]; ++x) {
                    std::vector<std::uint32_t>& list = near_[cube_key(x, y, z)];
                    if (list.empty() || list.back() != plane)
                        list.push_back(static_cast<std::uint32_t>(plane));
                }
    }
}

const std::vector<std::uint32_t>& TrueExtents::near(Vec3d p) const {
    static const std::vector<std::uint32_t> kNone;
    const auto found =
        near_.find(cube_key(std::floor(p.x / kCube), std::floor(p.y / kCube), std::floor(p.z / kCube)));
    return found == near_.end() ? kNone : found->second;
}

}  // namespace burin
