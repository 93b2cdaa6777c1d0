// SPDX-License-Identifier: MIT
#include "core/triangle_mesh.h"

#include <cmath>

namespace burin {

const char* label_name(std::uint8_t label) {
    static constexpr const char* kNames[kLabelCount] = {"none",  "wall", "floor",  "ceiling",
                                                        "table", "seat", "window", "door"};
    return label < kLabelCount ? kNames[label] : "unknown";
}

Status check_mesh(const TriangleMesh& mesh) {
    const std::size_t vertices = mesh.positions.size(), triangles = mesh.triangles.size();
    // int indices in PLY; also keeps the byte counts of every format inside 64 bits.
    constexpr std::size_t kMaxCount = 0x7fffffff;
    if (vertices > kMaxCount || triangles > kMaxCount)
        return Status::error(Code::invalid_argument,
                             "mesh has %zu vertices and %zu triangles, expected at most %zu", vertices,
                             triangles, kMaxCount);
    if (!mesh.normals.empty() && mesh.normals.size() != vertices)
        return Status::error(Code::invalid_argument, "mesh has %zu normals, expected 0 or %zu (one a vertex)",
                             mesh.normals.size(), vertices);
    if (!mesh.colours.empty() && mesh.colours.size() != vertices)
        return Status::error(Code::invalid_argument, "mesh has %zu colours, expected 0 or %zu (one a vertex)",
                             mesh.colours.size(), vertices);
    if (!mesh.labels.empty() && mesh.labels.size() != triangles)
        return Status::error(Code::invalid_argument,
                             "mesh has %zu labels, expected 0 or %zu (one a triangle)", mesh.labels.size(),
                             triangles);
    if (!mesh.filled.empty() && mesh.filled.size() != triangles)
        return Status::error(Code::invalid_argument,
                             "mesh has %zu marks of filled triangles, expected 0 or %zu (one a triangle)",
                             mesh.filled.size(), triangles);
    for (std::size_t i = 0; i < vertices; ++i) {
        const Vec3f p = mesh.positions[i];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
            return Status::error(Code::invalid_argument,
                                 "mesh vertex %zu is (%g, %g, %g), expected finite numbers", i, p.x, p.y,
                                 p.z);
    }
    for (std::size_t i = 0; i < triangles; ++i)
        for (const std::uint32_t v : mesh.triangles[i])
            if (v >= vertices)
                return Status::error(Code::invalid_argument,
                                     "mesh triangle %zu uses vertex %u, expected below %zu", i, v, vertices);
    return {};
}

}  // namespace burin
