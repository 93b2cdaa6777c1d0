// SPDX-License-Identifier: MIT
// What planes did to a mesh: how flat the flat parts became, what became of the rest, which holes were
// closed, and whether the faces' labels are right. Lengths in metres.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/jobs.h"
#include "core/triangle_mesh.h"
#include "eval/plane_truth.h"

namespace burin {

struct PlaneSurfaceOptions {
    double missing_voxels = 1.5;    // surface farther from a point than this is not there
    double max_error_m = 0.005;     // of completed surface
    int distance_samples = 300000;  // vertices off the planes whose distance is measured, evenly spread
};

// De-noising. A vertex lies on a plane when its foot is in a flat cell (plane_truth.h) of a plane that
// counts and the plane is within near_voxels; it is measured against that plane. All others, near edges,
// curved surface, small planes, are measured against the true surface. Vertices of filled faces count as
// neither.
struct FlatnessFigures {
    std::int64_t plane_vertices = 0, other_vertices = 0;
    double plane_rms_m = 0, other_mean_m = 0;
    std::vector<double> rms_m;           // of every plane, 0 where no vertex is
    std::vector<std::int64_t> vertices;  // of every plane
};
FlatnessFigures measure_flatness(const TriangleMesh& mesh, const PlaneTruth& truth,
                                 const TrueExtents& extents, const PlaneSurfaceOptions& options, Jobs& jobs);

// Completion. Of every true plane that counts: its open cells; of these the missing ones, from which no seen
// face is within missing_voxels; of these the closed ones, to which some face of the completed mesh is nearer
// than max_error_m along the normal and missing_voxels along the plane.
// The true outlines also span what no frame could see (a ceiling of which a corner was seen), so the missing
// cells inside the convex hull of the cells that are not missing, the holes proper, are counted apart.
struct CompletionFigures {
    double open_m2 = 0, missing_m2 = 0, closed_m2 = 0;  // within the true outlines
    double holes_m2 = 0, closed_holes_m2 = 0;           // within the hull of what was seen of each plane
    // Faces marked as filled. Hidden: within max_error_m of a true plane, inside its outline and inside a
    // solid, such as the floor below a cupboard that stands on it; not false. False: not hidden and farther
    // than max_error_m from the true surface, in the open or inside a solid.
    double filled_m2 = 0, hidden_m2 = 0, false_m2 = 0;
    std::vector<CompletionFigures> planes;  // of every plane, without its filled faces; empty in these
};
// seen: the mesh without planes, or the completed one again, whose filled faces are then left out.
CompletionFigures measure_completion(const TriangleMesh& seen, const TriangleMesh& completed,
                                     const PlaneTruth& truth, const TrueExtents& extents,
                                     const PlaneSurfaceOptions& options, Jobs& jobs);

// Labels. Area of the faces that are not filled, by true and given label: of all, by the surface nearest to
// the face's centre, and of those that lie on an open cell of a true plane that counts, within near_voxels
// and 45 degrees of it.
struct LabelFigures {
    using Table = std::array<std::array<double, 8>, 8>;  // [true][given], m^2
    Table surface_m2{}, plane_m2{};
    // Share of what is truly `label` that is so labelled; of what is so labelled that truly is. 1 of nothing.
    static double recall(const Table& table, std::uint8_t label);
    static double precision(const Table& table, std::uint8_t label);
};
LabelFigures measure_labels(const TriangleMesh& mesh, const PlaneTruth& truth, const TrueExtents& extents,
                            Jobs& jobs);

}  // namespace burin
