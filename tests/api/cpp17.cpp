// SPDX-License-Identifier: MIT
// Compiled as C++17 without exceptions and RTTI: the layers must do with that.
#include <burin/burin.hpp>
#if defined(BURIN_GLM)
#include <burin/glm.hpp>
#endif
#if __cplusplus != 201703L
#error "compile this as C++17"
#endif

burin_status in_cpp17(const burin_config& config, const burin_frame& frame, std::uint64_t* triangles);

burin_status in_cpp17(const burin_config& config, const burin_frame& frame, std::uint64_t* triangles) {
    burin::Map map;
    if (const burin_status status = map.create(config); status != BURIN_OK) return status;
    if (const burin_status status = map.integrate(frame); status != BURIN_OK) return status;
    burin::Mesh mesh;
    const burin_status status = map.mesh(mesh);
    *triangles = mesh.triangle_count();
    return status;
}
