// SPDX-License-Identifier: MIT
// What calls on a finished mesh demand of it, and of the map.
#pragma once

#include "api/call.h"

namespace burin {

inline Status require_planes(const MapState& state) {
    if (state.session.planes().enabled()) return {};
    return Status::error(Code::state, "config.planes is 0: the map looks for no planes");
}

// A mesh without triangles needs no arrays.
inline Status check_mesh_arrays(const burin_mesh_buffers* mesh) {
    if (!mesh) return null_argument("mesh");
    if (mesh->triangle_count == 0 || (mesh->positions && mesh->triangles)) return {};
    return null_argument(mesh->positions ? "mesh->triangles" : "mesh->positions");
}

inline Status check_indices(const burin_mesh_buffers& mesh) {
    for (std::uint64_t i = 0; i < 3 * mesh.triangle_count; ++i)
        if (mesh.triangles[i] >= mesh.vertex_count)
            return Status::error(Code::invalid_argument, "mesh: index %u, expected below %llu",
                                 mesh.triangles[i], static_cast<unsigned long long>(mesh.vertex_count));
    return {};
}

}  // namespace burin
