// SPDX-License-Identifier: MIT
#include "pipeline/mesh_runs.h"

#include <memory>

#include "support/frames.h"

namespace burin::bench {
namespace {

// A hundred chunks or more at a time, as a renderer would upload them: 1.5 MiB, which stays in the cache.
constexpr std::size_t kVertices = 1 << 15, kTriangles = 1 << 16;

Status status_of(burin_status status, burin_map map) {
    return status == BURIN_OK ? Status{}
                              : Status::error(static_cast<Code>(status), "%s", burin_last_error(map));
}

}  // namespace

IncrementalMesh::IncrementalMesh(bool colour)
    : keys_(1 << 16),
      positions_(3 * kVertices),
      normals_(3 * kVertices),
      colours_(colour ? 3 * kVertices : 0),
      triangles_(3 * kTriangles) {}

Status IncrementalMesh::update(burin_map map, const burin_mesh_options& options) {
    std::uint64_t count = 0;
    while (burin_dirty_chunks(map, keys_.data(), keys_.size(), &count) == BURIN_INSUFFICIENT_MEMORY)
        keys_.resize(count);
    ranges_.resize(keys_.size());
    for (std::uint64_t meshed = 0, done = 0; meshed < count; meshed += done) {
        burin_mesh_buffers out = {
            kVertices, kTriangles, positions_.data(), normals_.data(), nullptr, triangles_.data(), 0, 0};
        if (!colours_.empty()) out.colours = colours_.data();
        BURIN_TRY(status_of(burin_chunk_meshes(map, keys_.data() + meshed, count - meshed, &options, &out,
                                               ranges_.data(), &done),
                            map));
    }
    return {};
}

Status full_mesh(burin_map map, const burin_mesh_options& options, bool colour, TriangleMesh* mesh,
                 double* ms, double* processor_ms) {
    const double start = now_ms(), cpu_start = cpu_ms();
    std::uint64_t vertices = 0, triangles = 0;
    BURIN_TRY(status_of(burin_mesh_size(map, &options, &vertices, &triangles), map));
    const auto positions = std::make_unique_for_overwrite<float[]>(3 * vertices);
    const auto normals = std::make_unique_for_overwrite<float[]>(3 * vertices);
    const auto colours = std::make_unique_for_overwrite<std::uint8_t[]>(colour ? 3 * vertices : 0);
    const auto indices = std::make_unique_for_overwrite<std::uint32_t[]>(3 * triangles);
    burin_mesh_buffers out = {
        vertices, triangles, positions.get(), normals.get(), colour ? colours.get() : nullptr, indices.get(),
        0,        0};
    BURIN_TRY(status_of(burin_mesh(map, &options, &out), map));
    *processor_ms = cpu_ms() - cpu_start;
    *ms = now_ms() - start;

    *mesh = {};
    for (std::size_t i = 0; i < 3 * out.vertex_count; i += 3) {
        mesh->positions.push_back({positions[i], positions[i + 1], positions[i + 2]});
        mesh->normals.push_back({normals[i], normals[i + 1], normals[i + 2]});
    }
    for (std::size_t i = 0; i < 3 * out.triangle_count; i += 3)
        mesh->triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
    return {};
}

}  // namespace burin::bench
