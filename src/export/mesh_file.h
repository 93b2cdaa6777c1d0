// SPDX-License-Identifier: MIT
// Mesh export. Every writer goes through core/atomic_file.h: on any failure nothing is left under `path`, the
// status is one line, and a file that was there before is untouched. Positions are metres in the world frame
// of the data set (GLB alone is turned y-up). The mesh is only read; several threads may write different
// files at once.
#pragma once

#include <string>

#include "core/status.h"
#include "core/triangle_mesh.h"

namespace burin {

// The format follows from the extension: .ply .obj .stl .glb, upper or lower case. Error: another extension
// (unsupported), check_mesh, or io.
Status write_mesh(const std::string& path, const TriangleMesh& mesh);

// Wavefront text: `v x y z [r g b]` (colour 0..1 behind the position, as MeshLab and Blender read it), `vn`,
// `f`. Numbers are the shortest that read back to the same float.
Status write_obj(const std::string& path, const TriangleMesh& mesh);

// Binary STL: geometry alone, facet normals from the winding.
Status write_stl(const std::string& path, const TriangleMesh& mesh);

// glTF 2.0 binary: one mesh with one primitive, POSITION, NORMAL, COLOR_0, 32-bit indices. glTF is y-up: a
// z-up world point (x, y, z) is written as (x, z, -y). COLOR_0 is linear light by the specification
// (section 3.7.2.1), so sRGB is decoded, into 16 bits to keep the dark steps apart. Error: more than 4 GiB
// (the container's limit).
Status write_glb(const std::string& path, const TriangleMesh& mesh);

}  // namespace burin
