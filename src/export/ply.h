// SPDX-License-Identifier: MIT
// PLY (Turk 1994), the default mesh format.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/status.h"
#include "core/triangle_mesh.h"

namespace burin {

// Binary little-endian: float x y z [nx ny nz], uchar [red green blue], faces `list uchar int vertex_indices`
// and `uchar label` (none wall floor ceiling table seat window door = 0..7; 0 when the mesh has no labels).
// Normals, colours and, as the faces' `uchar filled`, the marks of completed surface are written when the
// mesh has them. Errors and atomicity as in export/mesh_file.h.
Status write_ply(const std::string& path, const TriangleMesh& mesh);

// Reads ascii and binary PLY of either byte order with any property order and any scalar type. Polygons
// become triangle fans; unknown elements and properties are skipped; a mesh without faces is a point cloud
// and no error. Colours (red green blue, diffuse_red ..., or r g b) may be 8 bit, 16 bit or float 0..1.
// Normals that are not finite become zero, others are brought to unit length. labels and the marks
// of filled faces are read when the faces carry them. Error: io, or format with the file, the value and what
// was expected; no value in the file is trusted, and no memory is reserved that the file's length does not
// justify.
Result<TriangleMesh> read_ply(const std::string& path);

// The same from memory; `name` stands for the file in messages.
Result<TriangleMesh> parse_ply(std::span<const std::uint8_t> bytes, const char* name);

}  // namespace burin
