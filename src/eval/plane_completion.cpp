// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>

#include "eval/plane_surface.h"

namespace burin {
namespace {

constexpr int kBatch = 4096;                           // faces a job: some milliseconds
using Cells = std::vector<std::vector<std::uint8_t>>;  // of every plane

struct Corners {
    Vec3d a, b, c;
};

Corners corners_of(const TriangleMesh& mesh, std::size_t face) {
    const auto& t = mesh.triangles[face];
    return {to_double(mesh.positions[t[0]]), to_double(mesh.positions[t[1]]),
            to_double(mesh.positions[t[2]])};
}

// Calls body(face, batch) for every face, in batches; returns how many there are.
template <class Body>
void for_faces(const TriangleMesh& mesh, Jobs& jobs, const Body& body) {
    const std::size_t count = mesh.triangles.size();
    jobs.run(static_cast<int>((count + kBatch - 1) / kBatch), [&](int batch, int) {
        const std::size_t begin = static_cast<std::size_t>(batch) * kBatch,
                          end = std::min(count, begin + kBatch);
        for (std::size_t i = begin; i < end; ++i) body(i, static_cast<std::size_t>(batch));
    });
}

// Sets the cells of every plane that counts whose centre is near a face: up to `across` from the plane, and
// up to `along`(distance from the plane) along it.
template <class Along>
Cells touched(const TriangleMesh& mesh, bool also_filled, const PlaneTruth& truth, const TrueExtents& extents,
              double across, const Along& along, Jobs& jobs) {
    Cells out(extents.size());
    for (std::size_t t = 0; t < extents.size(); ++t) out[t].assign(extents[t].cells.size(), 0);
    // Parts of faces no longer than a voxel lie closer to any point of the face than missing_voxels is long.
    const double spacing = extents.options().voxel_m;
    for_faces(mesh, jobs, [&](std::size_t face, std::size_t) {
        if (!also_filled && !mesh.filled.empty() && mesh.filled[face]) return;
        const Corners f = corners_of(mesh, face);
        for_parts(f.a, f.b, f.c, spacing, [&](Vec3d p, double) {
            for (const std::uint32_t t : extents.near(p)) {
                const LabelledPlane& plane = truth.planes[t];
                if (!extents.counts(t)) continue;
                const double d = std::fabs(dot(plane.normal, p) + plane.offset);
                if (!(d < across)) continue;
                const PlaneRaster& cells = extents[t].cells;
                const double reach = along(d) / cells.cell_m(), x = cells.column(p), y = cells.row(p);
                const int x0 = std::max(0, static_cast<int>(std::ceil(x - reach - 0.5))),
                          x1 = std::min(cells.width() - 1, static_cast<int>(std::floor(x + reach - 0.5))),
                          y0 = std::max(0, static_cast<int>(std::ceil(y - reach - 0.5))),
                          y1 = std::min(cells.height() - 1, static_cast<int>(std::floor(y + reach - 0.5)));
                for (int j = y0; j <= y1; ++j)
                    for (int i = x0; i <= x1; ++i)
                        if ((i + 0.5 - x) * (i + 0.5 - x) + (j + 0.5 - y) * (j + 0.5 - y) <= reach * reach)
                            // The same value from any thread, so the order does not matter.
                            std::atomic_ref<std::uint8_t>(
                                out[t][static_cast<std::size_t>(j) * static_cast<std::size_t>(cells.width()) +
                                       static_cast<std::size_t>(i)])
                                .store(1, std::memory_order_relaxed);
            }
        });
    });
    return out;
}

CompletionFigures count_plane(const TrueExtent& e, const std::vector<std::uint8_t>& seen,
                              const std::vector<std::uint8_t>& closed) {
    CompletionFigures out;
    std::vector<std::uint8_t> present(seen.size(), 0);
    for (std::size_t c = 0; c < seen.size(); ++c) present[c] = seen[c] && e.open[c];
    const std::vector<std::uint8_t> hull = hull_of_cells(present, e.cells.width(), e.cells.height());
    const double area = e.cells.cell_area_m2();
    for (std::size_t c = 0; c < seen.size(); ++c) {
        if (!e.open[c]) continue;
        out.open_m2 += area;
        if (seen[c]) continue;
        out.missing_m2 += area;
        if (closed[c]) out.closed_m2 += area;
        if (!hull[c]) continue;
        out.holes_m2 += area;
        if (closed[c]) out.closed_holes_m2 += area;
    }
    return out;
}

// Whether a point of filled surface lies on a true plane where it runs inside a solid.
bool is_hidden(Vec3d p, const PlaneTruth& truth, const TrueExtents& extents, double max_error_m) {
    double distance = 0;
    const auto accept = [](const TrueExtent& e, std::uint32_t, std::size_t cell) {
        return e.cells.inside(cell);
    };
    const int plane = extents.plane_at(p, accept, &distance);
    if (plane < 0 || std::fabs(distance) > max_error_m) return false;
    // Lifted by twice the error, a point above the plane is in the solid that covers it, whichever side of
    // the plane the filled surface is on.
    const Vec3d n = truth.planes[static_cast<std::size_t>(plane)].normal;
    return truth.distance_m(p + n * (2 * max_error_m - distance)) < 0;
}

void count_filled(const TriangleMesh& mesh, const PlaneTruth& truth, const TrueExtents& extents,
                  const PlaneSurfaceOptions& options, Jobs& jobs, CompletionFigures* out) {
    if (mesh.filled.empty()) return;
    std::vector<CompletionFigures> parts((mesh.triangles.size() + kBatch - 1) / kBatch);
    for_faces(mesh, jobs, [&](std::size_t face, std::size_t batch) {
        if (!mesh.filled[face]) return;
        const Corners f = corners_of(mesh, face);
        CompletionFigures& part = parts[batch];
        for_parts(f.a, f.b, f.c, extents.options().cell_m, [&](Vec3d p, double area) {
            part.filled_m2 += area;
            if (is_hidden(p, truth, extents, options.max_error_m))
                part.hidden_m2 += area;
            else if (!(std::fabs(truth.surface_distance_m(p)) <= options.max_error_m))
                part.false_m2 += area;
        });
    });
    for (const CompletionFigures& part : parts) {
        out->filled_m2 += part.filled_m2;
        out->hidden_m2 += part.hidden_m2;
        out->false_m2 += part.false_m2;
    }
}

}  // namespace

CompletionFigures measure_completion(const TriangleMesh& seen, const TriangleMesh& completed,
                                     const PlaneTruth& truth, const TrueExtents& extents,
                                     const PlaneSurfaceOptions& options, Jobs& jobs) {
    const double reach = options.missing_voxels * extents.options().voxel_m;
    const Cells there = touched(
        seen, false, truth, extents, reach, [&](double d) { return std::sqrt(reach * reach - d * d); }, jobs);
    const Cells closed = touched(
        completed, true, truth, extents, options.max_error_m, [&](double) { return reach; }, jobs);
    CompletionFigures out;
    for (std::size_t t = 0; t < extents.size(); ++t) {
        out.planes.emplace_back();
        if (!extents.counts(t)) continue;
        const CompletionFigures plane = out.planes.back() = count_plane(extents[t], there[t], closed[t]);
        out.open_m2 += plane.open_m2;
        out.missing_m2 += plane.missing_m2;
        out.closed_m2 += plane.closed_m2;
        out.holes_m2 += plane.holes_m2;
        out.closed_holes_m2 += plane.closed_holes_m2;
    }
    count_filled(completed, truth, extents, options, jobs, &out);
    return out;
}

}  // namespace burin
