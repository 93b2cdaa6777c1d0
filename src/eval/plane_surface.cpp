// SPDX-License-Identifier: MIT
#include "eval/plane_surface.h"

#include <algorithm>
#include <cmath>

namespace burin {
namespace {

constexpr std::size_t kBatch = 4096;  // vertices or faces a job: some milliseconds

int batches(std::size_t count) { return static_cast<int>((count + kBatch - 1) / kBatch); }

bool is_filled(const TriangleMesh& mesh, std::size_t face) {
    return !mesh.filled.empty() && mesh.filled[face];
}

}  // namespace

FlatnessFigures measure_flatness(const TriangleMesh& mesh, const PlaneTruth& truth,
                                 const TrueExtents& extents, const PlaneSurfaceOptions& options, Jobs& jobs) {
    std::vector<std::uint8_t> skip(mesh.positions.size(), 0);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        if (is_filled(mesh, i))
            for (const std::uint32_t v : mesh.triangles[i]) skip[v] = 1;
    const auto accept = [](const TrueExtent& e, std::uint32_t, std::size_t cell) {
        return e.flat[cell] != 0;
    };
    std::vector<int> plane(mesh.positions.size(), -1);
    std::vector<double> distance(mesh.positions.size(), 0);
    jobs.run_pieces(mesh.positions.size(), kBatch, [&](std::size_t i) {
        plane[i] = extents.plane_at(to_double(mesh.positions[i]), accept, &distance[i]);
    });
    FlatnessFigures out;
    out.rms_m.assign(truth.planes.size(), 0);
    out.vertices.assign(truth.planes.size(), 0);
    std::vector<std::size_t> others;
    for (std::size_t i = 0; i < plane.size();
         ++i) {  // in the order of the vertices, whatever thread measured
        if (skip[i]) continue;
        if (plane[i] < 0) {
            others.push_back(i);
            continue;
        }
        const auto t = static_cast<std::size_t>(plane[i]);
        ++out.vertices[t];
        out.rms_m[t] += distance[i] * distance[i];
    }
    double sum = 0;
    for (std::size_t t = 0; t < truth.planes.size(); ++t) {
        sum += out.rms_m[t];
        out.plane_vertices += out.vertices[t];
        if (out.vertices[t]) out.rms_m[t] = std::sqrt(out.rms_m[t] / static_cast<double>(out.vertices[t]));
    }
    if (out.plane_vertices) out.plane_rms_m = std::sqrt(sum / static_cast<double>(out.plane_vertices));

    out.other_vertices = static_cast<std::int64_t>(others.size());
    const std::size_t most = static_cast<std::size_t>(options.distance_samples),
                      count = std::min(others.size(), most);
    std::vector<double> error(count);
    jobs.run_pieces(count, kBatch, [&](std::size_t k) {
        const std::size_t i = others[others.size() * k / count];
        error[k] = std::fabs(truth.surface_distance_m(to_double(mesh.positions[i])));
    });
    for (const double e : error) out.other_mean_m += e / static_cast<double>(count);
    return out;
}

double LabelFigures::recall(const Table& table, std::uint8_t label) {
    double all = 0;
    for (const double area : table[label]) all += area;
    return all > 0 ? table[label][label] / all : 1;
}

double LabelFigures::precision(const Table& table, std::uint8_t label) {
    double all = 0;
    for (const auto& row : table) all += row[label];
    return all > 0 ? table[label][label] / all : 1;
}

LabelFigures measure_labels(const TriangleMesh& mesh, const PlaneTruth& truth, const TrueExtents& extents,
                            Jobs& jobs) {
    LabelFigures none;
    if (mesh.labels.empty()) return none;
    const int count = batches(mesh.triangles.size());
    std::vector<LabelFigures> parts(static_cast<std::size_t>(count));
    jobs.run(count, [&](int batch, int) {
        LabelFigures& out = parts[static_cast<std::size_t>(batch)];
        const std::size_t begin = static_cast<std::size_t>(batch) * kBatch,
                          end = std::min(mesh.triangles.size(), begin + kBatch);
        for (std::size_t i = begin; i < end; ++i) {
            if (is_filled(mesh, i)) continue;
            const auto& t = mesh.triangles[i];
            const Vec3d a = to_double(mesh.positions[t[0]]), b = to_double(mesh.positions[t[1]]),
                        c = to_double(mesh.positions[t[2]]);
            const Vec3d twice = cross(b - a, c - a), centre = (a + b + c) * (1.0 / 3);
            const double area = 0.5 * norm(twice);
            if (!(area > 0)) continue;
            const std::uint8_t given = mesh.labels[i] < 8 ? mesh.labels[i] : 0;
            out.surface_m2[truth.label(centre) & 7][given] += area;
            const auto accept = [&](const TrueExtent& e, std::uint32_t plane, std::size_t cell) {
                const LabelledPlane& p = truth.planes[plane];
                // cos 45 degrees: surface of an edge or of something on the plane faces elsewhere.
                return e.open[cell] && dot(twice, p.normal) > 0.7071 * 2 * area;
            };
            double distance = 0;
            const int plane = extents.plane_at(centre, accept, &distance);
            if (plane >= 0)
                out.plane_m2[truth.planes[static_cast<std::size_t>(plane)].label & 7][given] += area;
        }
    });
    for (const LabelFigures& part : parts)
        for (std::size_t i = 0; i < 8; ++i)
            for (std::size_t j = 0; j < 8; ++j) {
                none.surface_m2[i][j] += part.surface_m2[i][j];
                none.plane_m2[i][j] += part.plane_m2[i][j];
            }
    return none;
}

}  // namespace burin
