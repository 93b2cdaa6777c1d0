// SPDX-License-Identifier: MIT
// The two ways to a mesh, as an application would take them through the C interface.
#pragma once

#include <cstdint>
#include <vector>

#include "burin/burin.h"
#include "core/status.h"
#include "core/triangle_mesh.h"

namespace burin::bench {

// What a renderer that follows along asks for after every frame: the chunks that changed.
class IncrementalMesh {
  public:
    explicit IncrementalMesh(bool colour);
    Status update(burin_map map, const burin_mesh_options& options);

  private:
    std::vector<burin_chunk_key> keys_;
    std::vector<burin_mesh_range> ranges_;
    std::vector<float> positions_, normals_;
    std::vector<std::uint8_t> colours_;
    std::vector<std::uint32_t> triangles_;
};

// The whole map, with normals: sizes, buffers and surface are timed, the copy into *mesh is not.
Status full_mesh(burin_map map, const burin_mesh_options& options, bool colour, TriangleMesh* mesh,
                 double* ms, double* processor_ms);

}  // namespace burin::bench
