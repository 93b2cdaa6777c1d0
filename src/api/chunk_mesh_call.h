// SPDX-License-Identifier: MIT
// Meshes of chunks asked for through the C boundary, at once or beside a frame; and the checks that all calls
// for meshes share.
#pragma once

#include "api/call.h"

namespace burin {

Status check_mesh_options(const burin_mesh_options* options, MeshOptions* out);
Status check_buffers(const burin_mesh_buffers* mesh);
Status check_chunk(const burin_chunk_key& key);
// Sets the counts. Error: the buffers hold less.
Status require_capacity(burin_mesh_buffers* mesh, std::uint64_t vertices, std::uint64_t triangles);
MeshBuffers buffers_of(const burin_mesh_buffers& mesh);

// See burin_chunk_meshes.
struct ChunkMeshCall {
    const burin_chunk_key* keys = nullptr;
    std::uint64_t count = 0;
    const burin_mesh_options* options = nullptr;
    burin_mesh_buffers* mesh = nullptr;
    burin_mesh_range* ranges = nullptr;
    std::uint64_t done = 0;
    MeshOptions checked_options;

    Status check();
    Status run(FusionSession& session, Jobs& jobs);
};

}  // namespace burin
