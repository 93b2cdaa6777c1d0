// SPDX-License-Identifier: MIT
// The C++ layers as others use them: C++17, no exceptions.
#include <burin/burin.hpp>
#if __has_include(<glm/glm.hpp>)
#include <burin/glm.hpp>
#endif
#include <cstdio>
#include <cstring>

int main(int argc, char** argv) {
    if (argc != 2 || std::strcmp(burin_version(), argv[1]) != 0) return 1;
#if __has_include(<glm/glm.hpp>)
    if (burin::view(burin_pose{0, 0, 0, 0, 0, 0, 1})[2][2] != -1.0f) return 1;
#endif
    burin_config config = burin_config_default();
    config.budget_bytes = 16u << 20;
    burin::Map map;
    burin_statistics statistics;
    if (map.create(config) != BURIN_OK || map.stats(statistics) != BURIN_OK) {
        std::fprintf(stderr, "burin::Map: %s\n", map.last_error());
        return 1;
    }
    burin::Mesh mesh;
    return map.mesh(mesh) == BURIN_OK && mesh.triangle_count() == 0 ? 0 : 1;
}
