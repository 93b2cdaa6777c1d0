// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/status.h"
#include "core/vec.h"

namespace burin {

// An indexed triangle mesh of tools and exporters, metres, counter-clockwise seen from outside (from the side
// the cameras saw). normals and colours are either empty or one per vertex, labels and filled empty or one
// per triangle.
struct TriangleMesh {
    std::vector<Vec3f> positions;
    std::vector<Vec3f> normals;                        // unit length, pointing to free space
    std::vector<std::array<std::uint8_t, 3>> colours;  // sRGB
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::vector<std::uint8_t> labels;  // none wall floor ceiling table seat window door = 0..7
    std::vector<std::uint8_t> filled;  // 1: completed by a plane, not seen; else 0
};

// "none", "wall" ... of 0..7; "unknown" for what is no label. Static.
inline constexpr std::uint8_t kLabelCount = 8;
const char* label_name(std::uint8_t label);

// What exporters and evaluation demand. Error (invalid_argument): normals or colours neither empty nor one
// per vertex, labels or filled neither empty nor one per triangle, over 2^31 - 1 of anything, an index out of
// range, a position that is not finite.
Status check_mesh(const TriangleMesh& mesh);

}  // namespace burin
